# SPDX-License-Identifier: Apache-2.0
"""The free run of a co-simulation: it steps itself, what acts at its slots is held over each of its steps.

Arguments as of :func:`pneumo_ros.own_rig.loop.run`. An input that is not held goes in as its middle over the step.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.own_rig.bridge import compiled
from pneumo_ros.own_rig.fmu.calls import get2 as get_values
from pneumo_ros.own_rig.fmu.calls import set2 as set_values
from pneumo_ros.own_rig.fmu.calls import step2 as step
from pneumo_ros.own_rig.fmu.calls import weighted_sums
from pneumo_ros.slots.flow import MEMORIES as FLOW_MEMORIES
from pneumo_ros.slots.flow import advance as advance_flow
from pneumo_ros.slots.flow import flow
from pneumo_ros.slots.flow import start as start_flow
from pneumo_ros.slots.force import MEMORIES as FORCE_MEMORIES
from pneumo_ros.slots.force import advance as advance_force
from pneumo_ros.slots.force import force
from pneumo_ros.slots.force import start as start_force

MEMORIES = max(FORCE_MEMORIES, FLOW_MEMORIES)


@compiled
def see(p: Any, c: Array) -> None:
    """Coordinates of the slots."""
    if p.state[0] == 0 and get_values(p, p.seen, p.numbers) > 1:
        p.state[0] = 1
    weighted_sums(p, c)


@compiled
def move(p: Any, inputs: Array, time: float, h: float, f: Array) -> None:
    """One step with inputs and what acts held."""
    for j in range(len(inputs)):
        p.values[j] = inputs[j]
    for k in range(len(f)):
        p.values[len(inputs) + k] = f[k]
    if p.state[0] == 0 and (set_values(p, p.driven, p.values) > 1 or step(p, time, h) > 1):
        p.state[0] = 1


@compiled
def evaluate(terms: Any, on: Any, P: Array, S: Array, c: Array, z: Array, f: Array) -> None:
    """What acts at each slot."""
    for s in range(len(terms)):
        f[s] = 0.0
        if on[s]:
            f[s] = force(c[s], z[s], P[s], S[s]) if terms[s] == 0 else flow(c[s], z[s], P[s], S[s])


@compiled
def run(
    x0: Array, u: Array, held: Any, period: float, substeps: int, p: Any, terms: Any, on: Any, P: Array, S: Array,
    since: float, out: Array, where: Array, acted: Array,
) -> None:  # fmt: skip
    """As :func:`pneumo_ros.own_rig.loop.run`; it ends with the row at which the FMU fails."""
    rows, slots = len(u), len(terms)
    c, z, f = np.zeros((slots, 3)), np.zeros((slots, MEMORIES)), np.zeros(slots)
    inputs, h = np.zeros(len(held)), period / substeps
    for i in range(rows):
        for k in range(substeps if i > 0 else 1):
            if i > 0:
                for j in range(len(held)):
                    rise = 0.0 if held[j] else (u[i, j] - u[i - 1, j]) / substeps
                    inputs[j] = u[i - 1, j] + rise * (k + 0.5)
                move(p, inputs, (i - 1) * period + k * h, h, f)
            see(p, c)
            for s in range(slots):
                if on[s] and terms[s] == 0:
                    if i == 0:
                        start_force(c[s], z[s], S[s])
                    else:
                        advance_force(c[s], z[s], h, P[s], S[s])
                elif on[s]:
                    if i == 0:
                        start_flow(c[s], z[s], since, P[s], S[s])
                    else:
                        advance_flow(c[s], z[s], h, P[s], S[s])
            evaluate(terms, on, P, S, c, z, f)
        if p.state[0] != 0 or get_values(p, p.read, out[i]) > 1:
            p.state[0] = 1
            out[i] = np.nan
            break
        where[i], acted[i] = c, f
