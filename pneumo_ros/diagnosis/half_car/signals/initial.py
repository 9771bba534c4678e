# SPDX-License-Identifier: Apache-2.0
"""The state a log starts from: positions, rates and pressures smoothed from the first few hundredths of a second."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import Rig

# s: half a period of wheel hop (9 Hz), which a cubic follows to 1 % of its amplitude, while 30 samples of 10 um noise
# give rates to 2 mm/s [physics]
WINDOW: Final = 0.06
DEGREE: Final = 3  # degree of the polynomial in the window [physics]
# Standard deviations of the noise that a window's cubic misses, above which it is more than noise [taste]
NOT_FOLLOWED: Final = 1.5
UNKNOWN_HEIGHT_STD: Final = 5e-3  # m, a spring's height when one of its two sensors is missing [taste]
UNKNOWN_RATE_STD: Final = 0.05  # m/s, of a point whose sensor is missing [taste]
UNKNOWN_PRESSURE_STD: Final = 0.1  # relative, of a pressure whose sensor is missing [taste]


class Initial(NamedTuple):
    """State (10,) of the half car and its standard deviation (10,), in the units of the state."""

    state: NDArray[np.float64]
    std: NDArray[np.float64]


class _Point(NamedTuple):
    value: float
    rate: float
    value_std: float
    rate_std: float


def estimate_initial(
    measured: NDArray[np.float64], weight: NDArray[np.float64], noise: NDArray[np.float64], period: float, rig: Rig
) -> Initial:
    """State at row 0 by a local cubic on each channel.

    Parameters
    ----------
    measured, weight : (N, 6) as in :class:`pneumo_ros.diagnosis.half_car.signals.Signals`
    noise : (6,) standard deviation of each channel's noise
    period : s
    rig : arms, and its static state where a channel is missing

    A channel without samples there is replaced by what rest at design height would give, with a wide std: a
    fit of the initial state then starts from a prior as wide as what is known.
    """
    count = max(DEGREE + 3, round(WINDOW / period) + 1)
    points = [_smoothed(measured[:count, i], weight[:count, i], noise[i], period) for i in range(6)]
    rest = trim(rig)
    ends = [_end(points[0], points[2], rig, rest.state[2]), _end(points[1], points[3], rig, rest.state[3])]
    pressures = [points[4 + i] or _unknown_pressure(rest.pressures[i]) for i in (0, 1)]
    return _assembled(ends, pressures, rig)


def _smoothed(values: NDArray[np.float64], weight: NDArray[np.float64], noise: float, period: float) -> _Point | None:
    real = np.flatnonzero(weight)
    if len(real) < DEGREE + 2:
        return None
    # Time in units of the window keeps the normal equations well scaled.
    span = period * max(len(values) - 1, 1)
    basis = np.vander(real * period / span, DEGREE + 1, increasing=True)
    inverse = np.linalg.pinv(basis)
    coefficient = inverse @ values[real]
    missed = float(np.sqrt(np.sum((values[real] - basis @ coefficient) ** 2) / (len(real) - DEGREE - 1)))
    # What the cubic cannot follow is in its coefficients as well: a log that begins on a rough road says less of its
    # start than its noise would have it.
    std = np.sqrt((inverse**2).sum(axis=1)) * (missed if missed > NOT_FOLLOWED * noise else noise)
    return _Point(coefficient[0], coefficient[1] / span, std[0], std[1] / span)


def _end(sprung: _Point | None, unsprung: _Point | None, rig: Rig, axle_at_rest: float) -> tuple[_Point, _Point]:
    height = rig.design_height.value
    if sprung is None and unsprung is None:
        unsprung = _Point(axle_at_rest, 0.0, UNKNOWN_HEIGHT_STD, UNKNOWN_RATE_STD)
    if unsprung is None and sprung is not None:
        unsprung = _beside(sprung, -height)
    if sprung is None and unsprung is not None:
        sprung = _beside(unsprung, height)
    assert sprung is not None and unsprung is not None
    return sprung, unsprung


def _beside(known: _Point, distance: float) -> _Point:
    return _Point(known.value + distance, known.rate, UNKNOWN_HEIGHT_STD, UNKNOWN_RATE_STD)


def _unknown_pressure(pressure: float) -> _Point:
    return _Point(pressure, 0.0, UNKNOWN_PRESSURE_STD * pressure, np.inf)


def _assembled(ends: list[tuple[_Point, _Point]], pressures: list[_Point], rig: Rig) -> Initial:
    (sf, uf), (sr, ur) = ends
    a, b = rig.front_arm.value, rig.rear_arm.value
    base = a + b

    def heave(front: float, rear: float) -> float:
        return (b * front + a * rear) / base

    def heave_std(front: float, rear: float) -> float:
        return float(np.hypot(b * front, a * rear) / base)

    state = [
        heave(sf.value, sr.value), (sf.value - sr.value) / base, uf.value, ur.value,
        heave(sf.rate, sr.rate), (sf.rate - sr.rate) / base, uf.rate, ur.rate,
        pressures[0].value, pressures[1].value,
    ]  # fmt: skip
    std = [
        heave_std(sf.value_std, sr.value_std), float(np.hypot(sf.value_std, sr.value_std) / base),
        uf.value_std, ur.value_std,
        heave_std(sf.rate_std, sr.rate_std), float(np.hypot(sf.rate_std, sr.rate_std) / base),
        uf.rate_std, ur.rate_std,
        pressures[0].value_std, pressures[1].value_std,
    ]  # fmt: skip
    return Initial(np.array(state), np.array(std))
