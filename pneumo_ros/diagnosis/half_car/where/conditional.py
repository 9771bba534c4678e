# SPDX-License-Identifier: Apache-2.0
"""Conditional runs: one subsystem simulated, the others fed from measurement.

A subsystem whose own run stays close although the whole drifts off is sound; one that leaves the log while everything
around it is measured holds (part of) the fault. Rates of the fed states are smoothed derivatives: they only feed
damping and volume change of the simulated subsystem.

Kernel arguments
----------------
x, k, dt : state, its rate, and a step, s
fed, following : measured states (N, 10), or two consecutive rows of them
part : how far between these two rows, 0..1
own : (10,) states that are simulated; the others are taken from ``fed``
start : (10,) first state
commands, road : (N, 4) openings, m2; (N, 2) heights of the ground, m
period : s
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.signals import MEASURED, Signals
from pneumo_ros.diagnosis.half_car.where.features import SMOOTHING
from pneumo_ros.plant.air_spring import AreaSurface, Gas
from pneumo_ros.plant.equations import Body, State, derivative
from pneumo_ros.plant.half_car import HalfCar


class Subsystem(NamedTuple):
    """A part that can be run alone: the states it owns and the channels that judge it."""

    states: tuple[int, ...]
    channels: tuple[int, ...]


# Parts that can be run alone, with the states they own and the channels that judge them [definition]
SUBSYSTEMS: Final = {
    "body": Subsystem((0, 1, 4, 5), (0, 1)),
    "front_axle": Subsystem((2, 6), (2,)),
    "rear_axle": Subsystem((3, 7), (3,)),
    "front_air": Subsystem((8,), (4,)),
    "rear_air": Subsystem((9,), (5,)),
}


def measured_states(signals: Signals) -> Array:
    """(N, 10) states of the half car as the sensors show them, smoothed over 30 ms."""
    dt = signals.period
    count = max(5, round(SMOOTHING / dt))
    count += 1 - count % 2
    y = savgol_filter(signals.measured, count, 3, axis=0)
    rate = savgol_filter(signals.measured[:, :4], count, 3, deriv=1, delta=dt, axis=0)
    a, b = signals.rig.front_arm.value, signals.rig.rear_arm.value

    def body(ends: Array) -> list[Array]:
        front, rear = ends[:, 0], ends[:, 1]
        return [(b * front + a * rear) / (a + b), (front - rear) / (a + b)]

    return np.column_stack([*body(y), y[:, 2], y[:, 3], *body(rate), rate[:, 2], rate[:, 3], y[:, 4], y[:, 5]])


def conditional_gaps(car: HalfCar, signals: Signals) -> dict[str, float]:
    """Normalised RMS error of each subsystem run alone, over its own channels; the log's std is the yardstick."""
    fed = measured_states(signals)
    return {name: _gap_alone(car, signals, fed, part) for name, part in SUBSYSTEMS.items()}


def _gap_alone(car: HalfCar, signals: Signals, fed: Array, part: Subsystem) -> float:
    own = np.zeros(10, dtype=np.bool_)
    own[list(part.states)] = True
    start = np.where(own, signals.initial, fed[0])
    states = run_conditional(
        start, fed, own, signals.commands, signals.road, signals.period, car.body, car.front, car.rear, car.surface
    )
    predicted = channels(states, car.body)
    squares = []
    for c in part.channels:
        weight = signals.weight[:, c]
        error = (predicted[:, c] - signals.measured[:, c]) / signals.scale[c]
        squares.append(float((weight * error**2).sum() / max(weight.sum(), 1.0)))
    return float(np.sqrt(np.mean(squares)))


def channels(states: Array, body: Body) -> Array:
    """(N, 10) states -> (N, 6) channels of :data:`~pneumo_ros.diagnosis.half_car.signals.MEASURED`."""
    front = states[:, 0] + body.front_arm * states[:, 1]
    rear = states[:, 0] - body.rear_arm * states[:, 1]
    out = np.column_stack([front, rear, states[:, 2], states[:, 3], states[:, 8], states[:, 9]])
    assert out.shape[1] == len(MEASURED)
    return out


@njit(cache=True, inline="always")
def _merged(x: State, fed: Array, following: Array, part: float, own: NDArray[np.bool_]) -> State:
    """Own states from ``x``, the others between two measured rows."""
    return (
        x[0] if own[0] else fed[0] + part * (following[0] - fed[0]),
        x[1] if own[1] else fed[1] + part * (following[1] - fed[1]),
        x[2] if own[2] else fed[2] + part * (following[2] - fed[2]),
        x[3] if own[3] else fed[3] + part * (following[3] - fed[3]),
        x[4] if own[4] else fed[4] + part * (following[4] - fed[4]),
        x[5] if own[5] else fed[5] + part * (following[5] - fed[5]),
        x[6] if own[6] else fed[6] + part * (following[6] - fed[6]),
        x[7] if own[7] else fed[7] + part * (following[7] - fed[7]),
        x[8] if own[8] else fed[8] + part * (following[8] - fed[8]),
        x[9] if own[9] else fed[9] + part * (following[9] - fed[9]),
    )


@njit(cache=True)
def _stepped(x: State, k: State, dt: float) -> State:
    return (
        x[0] + dt * k[0], x[1] + dt * k[1], x[2] + dt * k[2], x[3] + dt * k[3], x[4] + dt * k[4],
        x[5] + dt * k[5], x[6] + dt * k[6], x[7] + dt * k[7], x[8] + dt * k[8], x[9] + dt * k[9],
    )  # fmt: skip


@njit(cache=True, error_model="numpy", nogil=True)
def run_conditional(
    start: Array,
    fed: Array,
    own: NDArray[np.bool_],
    commands: Array,
    road: Array,
    period: float,
    body: Body,
    front: Gas,
    rear: Gas,
    surface: AreaSurface,
) -> Array:
    """Heun's method at the log's rate with the states not ``own`` taken from ``fed`` (N, 10); returns (N, 10).

    Second order suffices: what is fed is known no better between samples.
    """
    count = fed.shape[0]
    out = np.empty((count, 10))
    x = (start[0], start[1], start[2], start[3], start[4], start[5], start[6], start[7], start[8], start[9])
    for i in range(count):
        j = min(i + 1, count - 1)
        x = _merged(x, fed[i], fed[j], 0.0, own)
        for m in range(10):
            out[i, m] = x[m]
        u0, u1, u2, u3 = commands[i, 0], commands[i, 1], commands[i, 2], commands[i, 3]
        k1 = derivative(x, u0, u1, u2, u3, road[i, 0], road[i, 1], body, front, rear, surface)
        ahead = _merged(_stepped(x, k1, period), fed[i], fed[j], 1.0, own)
        k2 = derivative(ahead, u0, u1, u2, u3, road[j, 0], road[j, 1], body, front, rear, surface)
        x = _stepped(_stepped(x, k1, 0.5 * period), k2, 0.5 * period)
    return out
