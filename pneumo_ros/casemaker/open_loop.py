# SPDX-License-Identifier: Apache-2.0
"""The richer rig driven by a log's commands: what a rig with some of the effects would have shown in that log."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.casemaker.controller import LEVELLING
from pneumo_ros.casemaker.derivative import FRONT, HOSE, REAR, SPOOL, TANK, inlet_flow
from pneumo_ros.casemaker.laws.slots import SUPPLY
from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.scene import PERIOD, Session
from pneumo_ros.casemaker.simulate import Rest, initial_state, sense, simulate
from pneumo_ros.casemaker.trim import prepared, supply_at_rest
from pneumo_ros.plant.air_spring import AreaSurface

STEP = 0.5e-3  # s: a bristle's 1500/s is still stable, and the log's first digits are what is asked


def shown(rig: RicherRig, full: RicherRig, session: Session, surface: AreaSurface) -> NDArray[np.float64]:
    """Outputs of ``rig``, (N + 1, 6) without noise, by a log's commands and from its first reading.

    Parameters
    ----------
    full : the rig that made the log
    """
    truth = session.run.states[0]
    state = _start(rig, read(full, truth), truth[:10], session.run.inlets[0])
    if _supplied(rig) == _supplied(full):  # a sticking regulator may rest anywhere in its band: where it really was
        state[TANK], state[HOSE] = truth[TANK], truth[HOSE]
    rest = Rest(state, (float(session.run.inlets[0, 0]), float(session.run.inlets[0, 1])), session.outlets)
    none = np.zeros((len(session.time), 6))
    run = simulate(prepared(rig, rest), rest, session.road, none[:, :2], none, surface, LEVELLING, PERIOD,
                   given=session.run.inlets, step=STEP)  # fmt: skip
    return run.measured


def _supplied(rig: RicherRig) -> tuple[object, ...]:
    frame = rig.frame
    return frame.tank_volume, frame.regulator, frame.supply_pressure, tuple(x for x in rig.laws if x.row == SUPPLY)


def read(rig: RicherRig, state: NDArray[np.float64]) -> NDArray[np.float64]:
    """What the sensors of a rig say of a state at the first instant, (6,)."""
    tops = np.array([state[0] + rig.front.arm * state[1], state[0] + rig.rear.arm * state[1]])
    return np.array(sense(state, 0.0, tops, rig.rows, rig.front, rig.rear))


def _start(
    rig: RicherRig, seen: NDArray[np.float64], core: NDArray[np.float64], inlets: NDArray[np.float64]
) -> NDArray[np.float64]:
    """State at which the sensors of ``rig`` say ``seen``; the rest of it is at rest."""
    commands = (float(inlets[0]), float(inlets[1]))
    a, b = rig.front.arm, rig.rear.arm
    core = core.copy()
    for _ in range(12):
        state = initial_state(core, commands, rig)
        off = seen - read(rig, state)
        pitch = (off[0] - off[1]) / (a - b)
        core = core + np.array([off[0] - a * pitch, pitch, off[2], off[3], 0.0, 0.0, 0.0, 0.0, off[4], off[5]])
    state = initial_state(core, commands, rig)
    tank, flow = rig.frame.supply_pressure, 0.0
    for _ in range(40 if rig.frame.tank_volume > 0.0 else 1):
        flow = _inflow(state, tank, rig)
        tank += 0.4 * (supply_at_rest((flow, 0.0), rig) - tank)
    state[TANK], state[HOSE] = tank, flow
    return state


def _inflow(state: NDArray[np.float64], tank: float, rig: RicherRig) -> float:
    rows, temperature = rig.rows, rig.frame.supply_temperature
    return float(sum(
        inlet_flow(state[at + SPOOL], tank, state[8 + i], temperature, rows[i], end, rig.frame)
        for i, (at, end) in enumerate(((FRONT, rig.front), (REAR, rig.rear)))
    ))  # fmt: skip
