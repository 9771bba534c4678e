# SPDX-License-Identifier: Apache-2.0
"""What :mod:`pneumo_ros.own_rig.loop` calls of an FMU for model exchange: rates, channels, coordinates, changes.

``p`` is its :class:`~pneumo_ros.own_rig.fmu.handle.Handle`; the last input is the time. For FMI 3 the imported calls
are the other ones.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.own_rig.bridge import compiled
from pneumo_ros.own_rig.fmu.calls import get2 as get_values
from pneumo_ros.own_rig.fmu.calls import set2 as set_values
from pneumo_ros.own_rig.fmu.calls import weighted_sums

WHOLE = 1e-9  # s that a change may lie beyond the end of a step


@compiled
def drive(x: Array, u: Array, p: Any) -> bool:
    """Time, states and inputs of the instance; whether it took them."""
    if p.state[0] != 0:
        return False
    last = len(u) - 1
    for j in range(last):  # slices cost ten times what the calls do
        p.values[j] = u[j]
    status = p.set_time(p.instance, u[last])
    if len(x) > 0:
        status = max(status, p.set_states(p.instance, x.ctypes.data, len(x)))
    status = max(status, set_values(p, p.driven, p.values))
    if status > 1:
        p.state[0] = 1
    return p.state[0] == 0


@compiled
def derivative(x: Array, u: Array, p: Any, f: Array, out: Array) -> None:
    """Rates of the states, into ``out``; NaN after a failure."""
    for k in range(len(f)):
        p.values[len(u) - 1 + k] = f[k]
    if drive(x, u, p) and p.rates(p.instance, out.ctypes.data, len(out)) > 1:
        p.state[0] = 1
    if p.state[0] != 0:
        out[:] = np.nan


@compiled
def reading(x: Array, u: Array, p: Any, f: Array, out: Array) -> None:
    """The measured channels, into ``out``; NaN after a failure."""
    for k in range(len(f)):
        p.values[len(u) - 1 + k] = f[k]
    if drive(x, u, p) and get_values(p, p.read, out) > 1:
        p.state[0] = 1
    if p.state[0] != 0:
        out[:] = np.nan


@compiled
def coordinates(x: Array, u: Array, p: Any, out: Array) -> None:
    """Coordinates (K, 3) of the slots, into ``out``, while nothing acts there."""
    for k in range(len(out)):
        p.values[len(u) - 1 + k] = 0.0
    if drive(x, u, p) and get_values(p, p.seen, p.numbers) > 1:
        p.state[0] = 1
    weighted_sums(p, out)


@compiled
def settle(x: Array, u: Array, p: Any) -> None:
    """At the end of a step: where an indicator has changed its sign or a change is due, the instance settles."""
    if p.state[1] == 0 or not drive(x, u, p):
        return
    flags, last, now = p.state[2:], p.signs[0], p.signs[1]
    flags[:] = 0
    status = p.completed(p.instance, True, flags.ctypes.data, flags[1:].ctypes.data)
    due = flags[0] != 0 or u[len(u) - 1] >= p.after[0] - WHOLE
    if len(now) > 0:
        status = max(status, p.indicators(p.instance, now.ctypes.data, len(now)))
        for i in range(len(now)):
            due = due or (now[i] > 0.0) != (last[i] > 0.0)
    if status > 1 or flags[1] != 0 or (due and p.event() != 0):
        p.state[0] = 1
    elif due:
        x[:] = p.after[2:]
