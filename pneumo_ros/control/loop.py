# SPDX-License-Identifier: Apache-2.0
"""The closed loop without ROS: plant, sensors, estimator and controller in one compiled run, for tests and ensembles.

Order within a period, as in a session: the plant's state is measured, the estimator and the controller step, and their
command holds from this sample (or ``delay`` periods later) to the next.

Kernel arguments
----------------
x : (10,) plant state, see :mod:`pneumo_ros.rig.channels`
command, trim_command : (4,) openings, m2: in force, and those at rest
road, noise : (N + 1, 2) heights of the ground, m; (N, 6) sensor noise, m and Pa
out : (16,) estimate, written in place
delay : periods that a command takes to the valve
exact, passive : the estimator is told the true kinematics; the valves stay at ``trim_command``
period, steps : s, and RK4 steps in it
derivatives, areas, gain : the estimator's state, (4, n + 1), (2,), (2, 2)
gains : of its differentiators
control : (8,) the controller's state
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.control.half_car import Controller, Law, control_half_car
from pneumo_ros.estimation.half_car import Estimator, Model, estimate_areas, estimate_half_car
from pneumo_ros.plant.air_spring import AreaSurface, Gas
from pneumo_ros.plant.equations import Body, derivative
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.plant.integrator import simulate, substeps
from pneumo_ros.rig import Rig
from pneumo_ros.rig.channels import sprung_points


@dataclass(frozen=True)
class Run:
    """A closed-loop run of N periods; row i holds what is true at times[i].

    Attributes
    ----------
    times : (N + 1,) s
    states : (N + 1, 10) of the plant
    measurements : (N, 6), estimates : (N, 16), commands : (N, 4) m2, telemetry : (N, 4)
    road : (N + 1, 2) m
    """

    times: NDArray[np.float64]
    states: NDArray[np.float64]
    measurements: NDArray[np.float64]
    estimates: NDArray[np.float64]
    commands: NDArray[np.float64]
    telemetry: NDArray[np.float64]
    road: NDArray[np.float64]


def close_loop(
    car: HalfCar,
    rig: Rig,
    estimator: Estimator,
    controller: Controller,
    road: NDArray[np.float64],
    *,
    seed: int = 0,
    delay: int = 0,
    exact: bool = False,
    offsets: Sequence[float] = (0.0,) * 6,
) -> Run:
    """Run a closed loop from rest at the controller's trim.

    Parameters
    ----------
    car : the plant
    rig : whose sensor noise is added
    road : (N + 1, 2) heights at the control periods, m
    seed : of the sensor noise
    delay : whole periods between sample and valve
    exact : True gives estimator and controller the true rates and accelerations, as the thesis's simulations do
    offsets : of the six sensors, m and Pa
    """
    road = np.ascontiguousarray(road, dtype=float)
    count, period = len(road) - 1, controller.law.period
    noise = np.random.default_rng(seed).standard_normal((count, 6))
    noise *= [rig.displacement_noise.value] * 4 + [rig.pressure_noise.value] * 2
    start = controller.at_rest.state
    noise += np.asarray(offsets, dtype=float)
    first = measure(start, car.body) + noise[0]
    initial = estimator.init(first)
    results = _close(
        start, road, noise, delay, exact, period, substeps(period, car.step),
        car.body, car.front, car.rear, car.surface,
        *initial, estimator.gains, estimator.model, estimator.surface,
        controller.name == "passive", controller.init(), controller.at_rest.command,
        controller.law, controller.front, controller.rear, controller.surface,
    )  # fmt: skip
    states, measurements, estimates, commands, telemetry = results
    times = np.arange(count + 1, dtype=np.float64) * period
    return Run(times, states, measurements, estimates, commands, telemetry, road)


@njit(cache=True)
def measure(x: NDArray[np.float64], body: Body) -> NDArray[np.float64]:
    """Exact measurement (6,) of a plant state (10,): sprung and unsprung points, m, pressures, Pa."""
    front, rear = sprung_points(x[0], x[1], body.front_arm, body.rear_arm)
    return np.array([front, rear, x[2], x[3], x[8], x[9]])


@njit(cache=True, error_model="numpy")
def exact_kinematics(
    x: NDArray[np.float64],
    command: NDArray[np.float64],
    road: NDArray[np.float64],
    body: Body,
    front: Gas,
    rear: Gas,
    surface: AreaSurface,
    out: NDArray[np.float64],
) -> None:
    """Overwrite the kinematic part of an estimate (16,) with the truth of a plant state (10,)."""
    rates = derivative(
        (x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9]),
        command[0], command[1], command[2], command[3], road[0], road[1], body, front, rear, surface,
    )  # fmt: skip
    a, b = body.front_arm, body.rear_arm
    for order in range(2):
        i = 4 * order
        out[2 * order], out[2 * order + 1] = x[i], x[i + 1]
        top_f, top_r = sprung_points(x[i], x[i + 1], a, b)
        out[6 + 2 * order], out[7 + 2 * order] = top_f - x[i + 2], top_r - x[i + 3]
    out[4], out[5] = rates[4], rates[5]
    top_f, top_r = sprung_points(rates[4], rates[5], a, b)
    out[10], out[11] = top_f - rates[6], top_r - rates[7]


@njit(cache=True, error_model="numpy")
def _close(
    x: NDArray[np.float64],
    road: NDArray[np.float64],
    noise: NDArray[np.float64],
    delay: int,
    exact: bool,
    period: float,
    steps: int,
    body: Body,
    front: Gas,
    rear: Gas,
    surface: AreaSurface,
    derivatives: NDArray[np.float64],
    areas: NDArray[np.float64],
    gain: NDArray[np.float64],
    gains: NDArray[np.float64],
    model: Model,
    estimator_surface: AreaSurface,
    passive: bool,
    control: NDArray[np.float64],
    trim_command: NDArray[np.float64],
    law: Law,
    believed_front: Gas,
    believed_rear: Gas,
    believed_surface: AreaSurface,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    count = road.shape[0] - 1
    states, estimates = np.empty((count + 1, 10)), np.empty((count, 16))
    measurements, telemetry = np.empty((count, 6)), np.zeros((count, 4))
    computed, applied = np.empty((count, 4)), np.empty((count, 4))
    states[0] = x
    for i in range(count):
        before = (areas, gain)
        measurements[i] = measure(states[i], body) + noise[i]
        derivatives, areas, gain, estimates[i] = estimate_half_car(
            derivatives, areas, gain, measurements[i], gains, model, estimator_surface
        )
        if exact:
            command = applied[i - 1] if i > 0 else trim_command
            exact_kinematics(states[i], command, road[i], body, front, rear, surface, estimates[i])
            areas, gain = estimate_areas(estimates[i], before[0], before[1], model, estimator_surface)
        if passive:
            computed[i] = trim_command
        else:
            control, computed[i], telemetry[i] = control_half_car(
                control, estimates[i], law, believed_front, believed_rear, believed_surface
            )
        applied[i] = computed[i - delay] if i >= delay else trim_command
        states[i + 1] = simulate(
            states[i], applied[i : i + 1], road[i : i + 2], period, steps, body, front, rear, surface
        )[1]
    return states, measurements, estimates, applied, telemetry
