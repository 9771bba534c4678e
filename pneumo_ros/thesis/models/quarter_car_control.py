# SPDX-License-Identifier: Apache-2.0
"""The quarter car's controllers and their closed loop in one compiled run: Sections 6.3 to 6.6 for ensembles.

As in the thesis the controller knows the true heights, rates and acceleration and one inlet valve acts, held over a
control period. What it does not know (area, volume, height, mass) is set by :class:`Belief`.

Kernel arguments
----------------
states, x, start : (N, 5), (5,) plant state of :mod:`pneumo_ros.thesis.models.quarter_car`
state : (4,) reference and its two derivatives, m, m/s, m/s2, and the error's integral, m s
acceleration, area : of the sprung mass, m/s2, and effective area, m2
a, P : (1,) area over the mean area, and its gain (1, 1)
mass, damping, ambient : as the estimator believes them, kg, N s/m, Pa
road, steps : (N + 1,) m, and RK4 steps in a period
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.control.laws.common import Error, Gains
from pneumo_ros.control.laws.family import FLC, LAWS, wanted_jerk
from pneumo_ros.control.linearisation import Compensation, Spring, believed_volume, openings
from pneumo_ros.control.reference_model import advance_reference, reference_jerk
from pneumo_ros.estimation.least_squares import METHODS, update
from pneumo_ros.plant.air_spring import MEAN_AREA, AreaSurface, Gas, effective_area
from pneumo_ros.plant.integrator import substeps
from pneumo_ros.thesis.models.quarter_car import Corner, QuarterCar, QuarterTrim, quarter_derivative, simulate_quarter
from pneumo_ros.units import CUBIC_INCH, GRAVITY, INCH, SQUARE_INCH

THESIS = Compensation(0.0, 0.0, 0.0)


class Belief(NamedTuple):
    """What the controller believes where it cannot know; SI.

    Attributes
    ----------
    area : constant effective area, m2; 0 uses the estimator's
    volume : constant volume, m3; 0 knows it
    height_error : added to the height it reads, m
    mass : sprung mass, kg; taken too large, the estimated area is too large by the same factor (Eqs. 6.56-6.57)
    """

    area: float
    volume: float
    height_error: float
    mass: float


class AreaEstimator(NamedTuple):
    """The scalar area estimator of Section 6.6.2 (Eqs. 6.50-6.55).

    Attributes
    ----------
    method : index into METHODS
    forgetting : lambda_0, 1/s
    bound : k_0, s3/m2
    start : initial area, m2
    gain_start : P(0), s3/m2
    """

    method: int
    forgetting: float
    bound: float
    start: float
    gain_start: float


class QuarterLaw(NamedTuple):
    """A quarter car's controller: law, gains, reference model, valve; SI."""

    law: int
    gains: Gains
    reference_pole: float
    target: float
    outlet: float
    inlet_max: float
    belief: Belief
    estimator: AreaEstimator
    period: float


@dataclass(frozen=True)
class QuarterRun:
    """A run of N periods: times (N + 1,), states (N + 1, 5), inlets (N,) m2, road (N + 1,) m,
    acceleration (N + 1,) m/s2, areas true and estimated (N,) m2."""

    times: NDArray[np.float64]
    states: NDArray[np.float64]
    inlets: NDArray[np.float64]
    road: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    areas: NDArray[np.float64]
    estimated_areas: NDArray[np.float64]


def quarter_law(
    car: QuarterCar,
    trim: QuarterTrim,
    law: str,
    *,
    period: float,
    inlet_max: float,
    pole: float = 10.0,
    reference_pole: float = 10.0,
    sliding_in_s3: float = 1000.0,
    layer_in_s: float = 1.0,
    area_in2: float = 0.0,
    volume_in3: float = 0.0,
    height_error_in: float = 0.0,
    mass_scale: float = 1.0,
    method: str = "bounded",
    forgetting: float = 50.0,
) -> QuarterLaw:
    """A controller that levels a quarter car to its trim height; gains and uncertainties in the thesis's units.

    ``area_in2 = 0`` estimates the area by ``method``; ``volume_in3 = 0`` knows the volume.
    """
    belief = Belief(
        area_in2 * SQUARE_INCH, volume_in3 * CUBIC_INCH, height_error_in * INCH, car.corner.sprung_mass * mass_scale
    )
    gains = Gains(pole, sliding_in_s3 * INCH, layer_in_s * INCH)
    estimator = AreaEstimator(METHODS.index(method), forgetting, 20.0, MEAN_AREA, 1.0)
    target = float(trim.state[0])
    return QuarterLaw(LAWS.index(law), gains, reference_pole, target, trim.outlet, inlet_max, belief, estimator, period)


def drive_quarter(
    car: QuarterCar, start: NDArray[np.float64], law: QuarterLaw, road: NDArray[np.float64]
) -> QuarterRun:
    """Close the loop from a state (5,) over road heights (N + 1,), m."""
    road = np.ascontiguousarray(road, dtype=float)
    results = _drive(
        np.asarray(start, dtype=float), road, law, substeps(law.period, car.step), car.corner, car.gas, car.surface
    )
    return _run_of(car, law.period, road, *results)


def coast_quarter(car: QuarterCar, trim: QuarterTrim, road: NDArray[np.float64], period: float) -> QuarterRun:
    """The passive quarter car, valves at trim, over the same road."""
    count = len(road) - 1
    states = car.simulate(trim.state, np.tile(trim.command, (count, 1)), road, period)
    return _run_of(car, period, road, states, np.full(count, trim.inlet), np.zeros(count))


def _run_of(
    car: QuarterCar,
    period: float,
    road: NDArray[np.float64],
    states: NDArray[np.float64],
    inlets: NDArray[np.float64],
    estimated: NDArray[np.float64],
) -> QuarterRun:
    acceleration, areas = _observe(states, car.corner, car.gas, car.surface)
    times = np.arange(len(states), dtype=np.float64) * period
    return QuarterRun(times, states, inlets, road, acceleration, areas[:-1], estimated)


@njit(cache=True, error_model="numpy")
def _observe(
    states: NDArray[np.float64], corner: Corner, gas: Gas, surface: AreaSurface
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sprung acceleration, m/s2, and effective area, m2, of each state."""
    count = states.shape[0]
    acceleration, areas = np.empty(count), np.empty(count)
    for i in range(count):
        x = (states[i, 0], states[i, 1], states[i, 2], states[i, 3], states[i, 4])
        acceleration[i] = quarter_derivative(x, 0.0, 0.0, 0.0, corner, gas, surface)[2]
        areas[i] = effective_area(x[0] - x[1], x[4] - gas.ambient_pressure, surface)
    return acceleration, areas


@njit(cache=True, error_model="numpy")
def control_quarter(
    state: NDArray[np.float64], x: NDArray[np.float64], acceleration: float, area: float, law: QuarterLaw, gas: Gas,
    surface: AreaSurface,
) -> tuple[NDArray[np.float64], float]:  # fmt: skip
    """One step: reference and integral (4,), plant state (5,), acceleration, believed area -> new (4,), inlet, m2."""
    reference = (state[0], state[1], state[2])
    if law.law == FLC:
        reference = (law.target, 0.0, 0.0)
    lead = reference_jerk(reference, law.target, law.reference_pole)
    e = Error(x[0] - reference[0], x[2] - reference[1], acceleration - reference[2], state[3], lead)
    jerk, _ = wanted_jerk(law.law, e, law.gains)
    height = x[0] - x[1] + law.belief.height_error
    volume, mean_area = believed_volume(height, law.belief.volume, gas)
    spring = Spring(x[4], height, x[2] - x[3], 0.0, area, volume, mean_area)
    inlet, _ = openings(law.belief.mass * jerk, spring, law.outlet, THESIS, gas, surface)
    moved = advance_reference(reference, law.target, law.reference_pole, law.period)
    new = np.array([moved[0], moved[1], moved[2], state[3] + law.period * e.value])
    return new, min(max(inlet, 0.0), law.inlet_max)


@njit(cache=True, error_model="numpy")
def estimate_area(
    a: NDArray[np.float64],
    P: NDArray[np.float64],
    x: NDArray[np.float64],
    acceleration: float,
    mass: float,
    damping: float,
    law: QuarterLaw,
    ambient: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """One step of Eqs. 6.52-6.55 with gauge pressure and bushing: a is area over the mean area, (1,), P (1, 1)."""
    W = np.array([[(x[4] - ambient) * MEAN_AREA / mass]])
    predicted = W[0, 0] * a[0] - GRAVITY - damping * (x[2] - x[3]) / mass
    residual = np.array([acceleration - predicted])
    e = law.estimator
    return update(e.method, a, P, W, residual, e.forgetting, e.bound, law.period)


@njit(cache=True, error_model="numpy")
def _drive(
    start: NDArray[np.float64],
    road: NDArray[np.float64],
    law: QuarterLaw,
    steps: int,
    corner: Corner,
    gas: Gas,
    surface: AreaSurface,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    count = road.shape[0] - 1
    states, inlets, estimated = np.empty((count + 1, 5)), np.empty(count), np.empty(count)
    states[0] = start
    control = np.array([start[0], 0.0, 0.0, 0.0])
    a, P = np.array([law.estimator.start / MEAN_AREA]), np.array([[law.estimator.gain_start]])
    for i in range(count):
        x = states[i]
        now = (x[0], x[1], x[2], x[3], x[4])
        acceleration = quarter_derivative(now, 0.0, 0.0, road[i], corner, gas, surface)[2]
        a, P = estimate_area(a, P, x, acceleration, law.belief.mass, corner.damping, law, gas.ambient_pressure)
        estimated[i] = a[0] * MEAN_AREA
        area = law.belief.area if law.belief.area > 0.0 else estimated[i]
        control, inlets[i] = control_quarter(control, x, acceleration, area, law, gas, surface)
        command = np.array([[inlets[i], law.outlet]])
        states[i + 1] = simulate_quarter(x, command, road[i : i + 2], law.period, steps, corner, gas, surface)[1]
    return states, inlets, estimated
