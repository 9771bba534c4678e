# SPDX-License-Identifier: Apache-2.0
"""The free run: RK4 with fixed sub-steps; the memories of slots move once a sub-step by what their travel has moved.

``u`` (N, U) are the inputs, linear between rows or ``held``; ``terms`` (K,) says what evaluates a slot (0 force, 1
flow), ``on`` (K,) whether it is at work, ``P`` and ``S`` (K, ...) its values and scales, ``c`` (K, 3) its coordinates,
``z`` its memories and ``f`` (K,) what acts there.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.own_rig.bridge import compiled, coordinates, derivative, reading, settle
from pneumo_ros.slots.flow import MEMORIES as FLOW_MEMORIES
from pneumo_ros.slots.flow import advance as advance_flow
from pneumo_ros.slots.flow import flow
from pneumo_ros.slots.flow import start as start_flow
from pneumo_ros.slots.force import MEMORIES as FORCE_MEMORIES
from pneumo_ros.slots.force import advance as advance_force
from pneumo_ros.slots.force import force
from pneumo_ros.slots.force import start as start_force

LARGEST = 1e100  # of a state: beyond it a run has diverged
MEMORIES = max(FORCE_MEMORIES, FLOW_MEMORIES)


@compiled
def begin(
    x: Array, u: Array, p: Array, terms: Any, on: Any, P: Array, S: Array, since: float, c: Array, z: Array
) -> None:
    """Memories of the first row."""
    coordinates(x, u, p, c)
    for s in range(len(terms)):
        if on[s]:
            if terms[s] == 0:
                start_force(c[s], z[s], S[s])
            else:
                start_flow(c[s], z[s], since, P[s], S[s])


@compiled
def advance(
    x: Array, u: Array, p: Array, terms: Any, on: Any, P: Array, S: Array, h: float, c: Array, z: Array
) -> None:
    """Memories one sub-step later."""
    coordinates(x, u, p, c)
    for s in range(len(terms)):
        if on[s]:
            if terms[s] == 0:
                advance_force(c[s], z[s], h, P[s], S[s])
            else:
                advance_flow(c[s], z[s], h, P[s], S[s])


@compiled
def act(x: Array, u: Array, p: Array, terms: Any, on: Any, P: Array, S: Array, c: Array, z: Array, f: Array) -> None:
    """What acts at each slot."""
    coordinates(x, u, p, c)
    for s in range(len(terms)):
        f[s] = 0.0
        if on[s]:
            if terms[s] == 0:
                f[s] = force(c[s], z[s], P[s], S[s])
            else:
                f[s] = flow(c[s], z[s], P[s], S[s])


@compiled
def step(
    x: Array, ends: Array, h: float, p: Array, terms: Any, on: Any, P: Array, S: Array, c: Array, z: Array, f: Array,
    K: Array, trial: Array,
) -> None:  # fmt: skip
    """One RK4 step; ``ends`` (3, U) are the inputs at its beginning, middle and end."""
    for stage in range(4):
        if stage == 0:
            trial[:] = x
        else:
            part = h if stage == 3 else 0.5 * h
            for j in range(len(x)):
                trial[j] = x[j] + part * K[stage - 1, j]
        now = ends[0] if stage == 0 else (ends[2] if stage == 3 else ends[1])
        act(trial, now, p, terms, on, P, S, c, z, f)
        derivative(trial, now, p, f, K[stage])
    for j in range(len(x)):
        x[j] += h / 6.0 * (K[0, j] + 2.0 * (K[1, j] + K[2, j]) + K[3, j])


@compiled
def between(u: Array, held: Any, i: int, substep: int, substeps: int, ends: Array) -> None:
    """Inputs at beginning, middle and end of a sub-step after row ``i``."""
    for j in range(len(held)):
        rise = 0.0 if held[j] else (u[i + 1, j] - u[i, j]) / substeps
        ends[0, j] = u[i, j] + rise * substep
        ends[1, j] = ends[0, j] + 0.5 * rise
        ends[2, j] = ends[0, j] + rise


@compiled
def finite(x: Array) -> bool:
    """Whether a run is still one."""
    ok = True
    for j in range(len(x)):
        if not abs(x[j]) < LARGEST:
            ok = False
    return ok


@compiled
def run(
    x0: Array, u: Array, held: Any, period: float, substeps: int, p: Array, terms: Any, on: Any, P: Array, S: Array,
    since: float, out: Array, where: Array, acted: Array,
) -> None:  # fmt: skip
    """Into channels ``out`` (N, C), coordinates ``where`` (N, K, 3) and what acts ``acted`` (N, K); it ends with the
    row at which the run diverges.
    """
    rows, slots = len(u), len(terms)
    c, z, f = np.zeros((slots, 3)), np.zeros((slots, MEMORIES)), np.zeros(slots)
    x, trial, K, ends = x0.copy(), x0.copy(), np.zeros((4, len(x0))), np.zeros((3, len(held)))
    h = period / substeps
    begin(x, u[0], p, terms, on, P, S, since, c, z)
    for i in range(rows):
        if not finite(x):
            break
        act(x, u[i], p, terms, on, P, S, c, z, f)
        where[i], acted[i] = c, f
        reading(x, u[i], p, f, out[i])
        if i < rows - 1:
            for k in range(substeps):
                between(u, held, i, k, substeps, ends)
                if len(x) > 0:
                    step(x, ends, h, p, terms, on, P, S, c, z, f, K, trial)
                settle(x, ends[2], p)
                advance(x, ends[2], p, terms, on, P, S, h, c, z)
