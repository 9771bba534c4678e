# SPDX-License-Identifier: Apache-2.0
"""The three calls whose arguments differ between FMI 2 and FMI 3, compiled; a status above 1 is a failure.

And what both kinds of FMU make of the numbers that they got: the slots' coordinates.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from pneumo_ros.arrays import Array

compiled = njit(error_model="numpy", nogil=True, cache=True)


@compiled
def set2(p: Any, references: Any, values: Array) -> int:
    """Set numbers by the address of their references, FMI 2."""
    n = len(values)
    if n == 0:
        return 0
    return int(p.set_values(p.instance, references, n, values.ctypes.data))


@compiled
def get2(p: Any, references: Any, values: Array) -> int:
    """Get numbers by the address of their references, FMI 2."""
    n = len(values)
    if n == 0:
        return 0
    return int(p.get_values(p.instance, references, n, values.ctypes.data))


@compiled
def step2(p: Any, time: float, h: float) -> int:
    """Let a co-simulation step, FMI 2."""
    return int(p.step(p.instance, time, h, True))


@compiled
def set3(p: Any, references: Any, values: Array) -> int:
    """Set numbers by the address of their references, FMI 3."""
    n = len(values)
    if n == 0:
        return 0
    return int(p.set_values(p.instance, references, n, values.ctypes.data, n))


@compiled
def get3(p: Any, references: Any, values: Array) -> int:
    """Get numbers by the address of their references, FMI 3."""
    n = len(values)
    if n == 0:
        return 0
    return int(p.get_values(p.instance, references, n, values.ctypes.data, n))


@compiled
def step3(p: Any, time: float, h: float) -> int:
    """Let a co-simulation step, FMI 3; one that stops early or ends has failed."""
    flags = p.state[2:]
    flags[:] = 0
    status = int(p.step(p.instance, time, h, True, flags[0:].ctypes.data, flags[1:].ctypes.data, flags[2:].ctypes.data,
                        p.after[1:].ctypes.data))  # fmt: skip
    return 3 if flags[1] or flags[2] else status


@compiled
def weighted_sums(p: Any, out: Array) -> None:
    """Coordinates (K, 3) of the slots, into ``out``: weighted sums of the numbers got last."""
    for k in range(out.shape[0]):
        for j in range(3):
            out[k, j] = 0.0
            for i in range(len(p.numbers)):
                out[k, j] += p.weights[3 * k + j, i] * p.numbers[i]
