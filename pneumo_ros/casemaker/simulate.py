# SPDX-License-Identifier: Apache-2.0
"""Runs the richer rig: RK4 at a fixed step, valves and controller in the loop, sensors sampled every period.

Kernel arguments
----------------
x : (SIZE,) state
at, index : first of the end's own states, and the state that holds its pressure (8 front, 9 rear)
arm, unsprung : signed distance of the strut from the centre of gravity, and height of the axle, m
inlet : opening at rest, m2
true : what a sensor looks at, m or Pa
time : s
memory, slot : (2,) positions of the sensors' rod ends, m, updated in place, and which of them
law, rows, laws : a sensor's second law (COLUMNS,), those of an end (ROWS, COLUMNS), of both (2, ROWS, COLUMNS)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.casemaker.air import sonic_mass
from pneumo_ros.casemaker.controller import Controller, control
from pneumo_ros.casemaker.derivative import (
    CHAMBER,
    FRONT,
    GAUGE,
    LOOSE,
    MASS,
    MODE,
    REAR,
    SIZE,
    SPOOL,
    TANK,
    WALL,
    derivative,
)
from pneumo_ros.casemaker.laws.ground import sensor_error
from pneumo_ros.casemaker.laws.slots import CROSS, DELAY, GAUGE_LAG, SPRUNG, UNSPRUNG
from pneumo_ros.casemaker.laws.slots import GAUGE as GAUGE_ERROR
from pneumo_ros.casemaker.laws.slots import MODE as MODE_LAW
from pneumo_ros.casemaker.parameters import End, Frame, RicherRig
from pneumo_ros.casemaker.valve import delayed, spool_target
from pneumo_ros.plant.air_spring import AreaSurface
from pneumo_ros.units import GRAVITY

STEP = 0.25e-3  # s: a bristle that gives way at 0.2 mm and 0.3 m/s has a rate of 1500/s


NOT_GIVEN = np.zeros((0, 2))


class Rest(NamedTuple):
    """Where a run starts and what its valves do at rest.

    Attributes
    ----------
    state : (SIZE,)
    inlets, outlets : openings, m2
    """

    state: NDArray[np.float64]
    inlets: tuple[float, float]
    outlets: tuple[float, float]


class Run(NamedTuple):
    """What came out: N periods, N + 1 samples.

    Attributes
    ----------
    states : (N + 1, SIZE)
    measured : (N + 1, 6) sprung front and rear, unsprung front and rear [m], pressures [Pa]; noise included
    inlets : (N + 1, 2) commanded openings, m2; row k holds from sample k on
    """

    states: NDArray[np.float64]
    measured: NDArray[np.float64]
    inlets: NDArray[np.float64]


@njit(cache=True)
def _start_end(x: NDArray[np.float64], at: int, index: int, arm: float, unsprung: float, inlet: float, end: End,
               frame: Frame) -> None:  # fmt: skip
    height = x[0] + arm * x[1] - unsprung
    x[at + MODE] = height
    x[at + SPOOL] = inlet
    x[at + MASS] = sonic_mass(x[index], height, end, frame)
    x[at + GAUGE] = x[index]
    x[at + WALL] = frame.supply_temperature
    x[at + CHAMBER] = x[index]


def initial_state(core: NDArray[np.float64], inlets: tuple[float, float], rig: RicherRig) -> NDArray[np.float64]:
    """Complete a plant state (10,) with the extras at rest, (SIZE,)."""
    x = np.zeros(SIZE)
    x[:10] = core
    _start_end(x, FRONT, 8, rig.front.arm, x[2], inlets[0], rig.front, rig.frame)
    _start_end(x, REAR, 9, rig.rear.arm, x[3], inlets[1], rig.rear, rig.frame)
    for law in rig.laws:
        if law.row == MODE_LAW and law.number == 2:  # hangs between both plates
            at, end = (FRONT, 0) if law.end == "front" else (REAR, 1)
            x[at + MODE] = 0.5 * (x[0] + (rig.front, rig.rear)[end].arm * x[1] + x[2 + end])
    x[TANK] = rig.frame.supply_pressure
    if rig.frame.loose_mass > 0.0:
        x[LOOSE] = x[0] + rig.frame.loose_arm * x[1] - GRAVITY / rig.frame.loose_frequency**2
    return x


@njit(cache=True)
def _sense_height(
    true: float, time: float, memory: NDArray[np.float64], slot: int, law: NDArray[np.float64], end: End
) -> float:
    """LVDT on the body: play of its rod end, then scale, offset and curvature."""
    memory[slot] = min(max(memory[slot], true - end.sprung_play), true + end.sprung_play)
    seen = memory[slot]
    stroke = seen - end.sprung_centre
    error = sensor_error(law, seen, time) if law[0] > 0.0 else 0.0
    return end.sprung_scale * seen + end.sprung_offset + end.sprung_curve * stroke * stroke + error


@njit(cache=True)
def _sense_pressure(
    x: NDArray[np.float64], time: float, at: int, true: float, rows: NDArray[np.float64], end: End
) -> float:
    """Gauge line, scale, offset and what else is wrong with it."""
    felt = x[at + GAUGE] if end.pressure_frequency > 0.0 or rows[GAUGE_LAG, 0] > 0.0 else true
    error = sensor_error(rows[GAUGE_ERROR], felt, time) if rows[GAUGE_ERROR, 0] > 0.0 else 0.0
    return end.pressure_scale * felt + end.pressure_offset + error


@njit(cache=True)
def _sense_axle(true: float, time: float, law: NDArray[np.float64], end: End) -> float:
    error = sensor_error(law, true, time) if law[0] > 0.0 else 0.0
    return end.unsprung_scale * true + end.unsprung_offset + error


@njit(cache=True)
def sense(
    x: NDArray[np.float64], time: float, memory: NDArray[np.float64], laws: NDArray[np.float64], front: End, rear: End
) -> tuple[float, float, float, float, float, float]:
    """What the six sensors say, without noise; ``memory`` (2,) are the rod ends' positions, updated in place."""
    top_front, top_rear = x[0] + front.arm * x[1], x[0] + rear.arm * x[1]
    sf = _sense_height(top_front, time, memory, 0, laws[0, SPRUNG], front)
    sr = _sense_height(top_rear, time, memory, 1, laws[1, SPRUNG], rear)
    if laws[0, CROSS, 0] > 0.0:  # a channel picks up its neighbour
        sf += laws[0, CROSS, 1] * (top_rear - laws[0, CROSS, 2])
    if laws[1, CROSS, 0] > 0.0:
        sr += laws[1, CROSS, 1] * (top_front - laws[1, CROSS, 2])
    return (
        sf,
        sr,
        _sense_axle(x[2], time, laws[0, UNSPRUNG], front),
        _sense_axle(x[3], time, laws[1, UNSPRUNG], rear),
        _sense_pressure(x, time, FRONT, x[8], laws[0], front),
        _sense_pressure(x, time, REAR, x[9], laws[1], rear),
    )


@njit(cache=True, error_model="numpy")
def run(
    x0: NDArray[np.float64],
    road: NDArray[np.float64],
    shake: NDArray[np.float64],
    noise: NDArray[np.float64],
    given: NDArray[np.float64],
    rest_inlets: tuple[float, float],
    outlets: tuple[float, float],
    static: tuple[float, float],
    period: float,
    steps: int,
    gains: Controller,
    frame: Frame,
    front: End,
    rear: End,
    laws: NDArray[np.float64],
    surface: AreaSurface,
    states: NDArray[np.float64],
    measured: NDArray[np.float64],
    inlets: NDArray[np.float64],
) -> None:
    """Simulate N periods into ``states``, ``measured`` and ``inlets``, as of :class:`Run`.

    They are not returned: Ctrl-C that came meanwhile is raised while numba makes Python's objects of what a compiled
    function returns, and of several arrays it makes a tuple all the same, of one that is not there.

    Parameters
    ----------
    x0 : (SIZE,)
    road : (N + 1, 2) commanded ground, m, linear between samples
    shake : (N + 1, 2) relative excitation added to each inlet command (share of its opening at rest)
    noise : (N + 1, 6) sensor noise, m and Pa
    given : (N + 1, 2) inlet commands of a log, m2, instead of the controller's; empty: the controller drives
    rest_inlets, outlets : openings at rest and of the constant outlets, m2
    static : tyre deflections at rest, m
    period, steps : s, and RK4 steps in it
    laws : second laws, (2, ROWS, COLUMNS)
    """
    count = road.shape[0] - 1
    x, probe = x0.copy(), x0.copy()
    k1, k2, k3, k4 = np.zeros(SIZE), np.zeros(SIZE), np.zeros(SIZE), np.zeros(SIZE)
    play = np.array([x[0] + front.arm * x[1], x[0] + rear.arm * x[1]])
    seen = sense(x, 0.0, play, laws, front, rear)
    memory_front, memory_rear = np.array([seen[0] - seen[2], 0.0]), np.array([seen[1] - seen[3], 0.0])
    dt, duration = period / steps, period * count
    held_front, held_rear = rest_inlets
    for i in range(count + 1):
        seen = sense(x, i * period, play, laws, front, rear)
        for m in range(6):
            measured[i, m] = seen[m] + noise[i, m]
        states[i] = x
        if given.shape[0] > 0:
            inlets[i] = given[i]
        else:
            hf, hr = measured[i, 0] - measured[i, 2], measured[i, 1] - measured[i, 3]
            uf = control(memory_front, hf, front.design_height, rest_inlets[0], period, gains)
            ur = control(memory_rear, hr, rear.design_height, rest_inlets[1], period, gains)
            inlets[i, 0] = min(max(uf + rest_inlets[0] * shake[i, 0], 0.0), gains.limit)
            inlets[i, 1] = min(max(ur + rest_inlets[1] * shake[i, 1], 0.0), gains.limit)
        if i == count:
            break
        slopes = ((road[i + 1, 0] - road[i, 0]) / period, (road[i + 1, 1] - road[i, 1]) / period)
        for j in range(steps):
            t = (i * steps + j) * dt
            cf = delayed(inlets[: i + 1, 0], t, laws[0, DELAY], front.valve_delay, period)
            cr = delayed(inlets[: i + 1, 1], t, laws[1, DELAY], rear.valve_delay, period)
            held_front = spool_target(cf, cr, rest_inlets[1], held_front, dt, front)
            held_rear = spool_target(cr, cf, rest_inlets[0], held_rear, dt, rear)
            spools = (held_front, held_rear)
            r0 = (road[i, 0] + slopes[0] * j * dt, road[i, 1] + slopes[1] * j * dt)
            rm = (r0[0] + 0.5 * dt * slopes[0], r0[1] + 0.5 * dt * slopes[1])
            r1 = (r0[0] + dt * slopes[0], r0[1] + dt * slopes[1])
            derivative(x, k1, t, duration, spools, outlets, r0, slopes, static, frame, front, rear, laws,
                       surface)  # fmt: skip
            for m in range(SIZE):
                probe[m] = x[m] + 0.5 * dt * k1[m]
            derivative(probe, k2, t + 0.5 * dt, duration, spools, outlets, rm, slopes, static, frame, front, rear, laws,
                       surface)  # fmt: skip
            for m in range(SIZE):
                probe[m] = x[m] + 0.5 * dt * k2[m]
            derivative(probe, k3, t + 0.5 * dt, duration, spools, outlets, rm, slopes, static, frame, front, rear, laws,
                       surface)  # fmt: skip
            for m in range(SIZE):
                probe[m] = x[m] + dt * k3[m]
            derivative(probe, k4, t + dt, duration, spools, outlets, r1, slopes, static, frame, front, rear, laws,
                       surface)  # fmt: skip
            for m in range(SIZE):
                x[m] += dt / 6.0 * (k1[m] + 2.0 * (k2[m] + k3[m]) + k4[m])


def simulate(
    rig: RicherRig,
    rest: Rest,
    road: NDArray[np.float64],
    shake: NDArray[np.float64],
    noise: NDArray[np.float64],
    surface: AreaSurface,
    gains: Controller,
    period: float,
    given: NDArray[np.float64] | None = None,
    step: float = STEP,
) -> Run:
    """One session from rest; arguments as :func:`run`, ``step`` of the integrator in s."""
    samples = len(road)
    out = Run(np.empty((samples, SIZE)), np.empty((samples, 6)), np.empty((samples, 2)))
    run(
        rest.state,
        np.ascontiguousarray(road, dtype=float),
        np.ascontiguousarray(shake, dtype=float),
        np.ascontiguousarray(noise, dtype=float),
        NOT_GIVEN if given is None else np.ascontiguousarray(given, dtype=float),
        rest.inlets,
        rest.outlets,
        (-float(rest.state[2]), -float(rest.state[3])),
        period,
        max(1, round(period / step)),
        gains,
        *rig[:3],
        rig.rows,
        surface,
        *out,
    )
    return out
