# SPDX-License-Identifier: Apache-2.0
"""The plant against the independent check values, and against conservation of mass and energy."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from helpers.folders import ROOT
from scipy.interpolate import CubicSpline

from pneumo_ros.plant.air_spring import (
    air_mass,
    effective_area,
    inlet_flow,
    load_surface,
    outlet_flow,
    pressure_power,
    spring_volume,
    volume_at_pressure,
)
from pneumo_ros.plant.half_car import HalfCar, half_car
from pneumo_ros.plant.integrator import DEFAULT_STEP, substeps
from pneumo_ros.plant.orifice import critical_ratio, flow_function, mass_flow
from pneumo_ros.plant.trim import Trim, nominal_half_car
from pneumo_ros.rig import load_rig
from pneumo_ros.units import ATMOSPHERE, GRAVITY, INCH, PSI

CHECKS = ROOT / "test" / "data" / "contract"


@pytest.fixture(scope="module")
def car_and_trim() -> tuple[HalfCar, Trim]:
    return nominal_half_car(load_rig())


def table(path: Path) -> np.ndarray:
    return np.genfromtxt(path, delimiter=",", skip_header=1)


def test_effective_area_meets_the_check_values() -> None:
    surface = load_surface()
    rows = table(CHECKS / "check_area.csv")
    ours = [effective_area(height, gauge, surface) for height, gauge, _ in rows]
    assert np.max(np.abs(ours - rows[:, 2])) < 2e-8


def test_orifice_flow_meets_the_check_values() -> None:
    rows = table(CHECKS / "check_orifice_flow.csv")
    ours = np.array([mass_flow(area, up, down, 293.15, 1.4) for area, up, down, _ in rows])
    zero = rows[:, 3] == 0.0
    assert zero.any() and np.all(ours[zero] == 0.0)
    assert np.max(np.abs(ours[~zero] / rows[~zero, 3] - 1.0)) < 1e-5


def test_static_state_meets_the_check_values(car_and_trim: tuple[HalfCar, Trim]) -> None:
    _, trim = car_and_trim
    check = json.loads((CHECKS / "check_static_state.json").read_text())
    keys = ["heave_m", "pitch_rad", "unsprung_front_m", "unsprung_rear_m", "pressure_front_pa", "pressure_rear_pa"]
    ours = [*trim.state[:4], *trim.pressures, *trim.inlets]
    theirs = [check[key] for key in [*keys, "inlet_front_m2", "inlet_rear_m2"]]
    np.testing.assert_allclose(ours, theirs, rtol=1e-5)


def test_trajectory_meets_the_check_values(car_and_trim: tuple[HalfCar, Trim]) -> None:
    car, trim = car_and_trim
    rows = table(CHECKS / "check_trajectory.csv.xz")
    commands = np.column_stack([rows[:-1, 1:3], np.tile(trim.outlets, (len(rows) - 1, 1))])
    ours = car.simulate(rows[0, 5:], commands, rows[:, 3:5], 1e-3)
    assert np.max(np.abs(ours - rows[:, 5:]).max(axis=0) / rows[:, 5:].std(axis=0)) < 1e-4


def test_a_slow_clock_takes_no_second_step() -> None:
    """A crystal off by 100 ppm stretches the period of a log, and a second step would double the time of every run."""
    assert [substeps(period, 2e-3) for period in (1e-3, 2e-3, 2.0002e-3, 4.0004e-3, 2.1e-3)] == [1, 1, 1, 2, 2]


def test_rest_is_an_equilibrium(car_and_trim: tuple[HalfCar, Trim]) -> None:
    car, trim = car_and_trim
    rates = car.rates(trim.state, trim.command, np.zeros(2))
    assert np.max(np.abs(rates[:8])) < 1e-8
    assert np.max(np.abs(rates[8:])) < 1e-3  # Pa/s, against 3e5 Pa


def excited_run(car: HalfCar, trim: Trim, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """One second at 0.1 ms output with road and valves moving; returns time, states, commands, road."""
    period, count = 1e-4, 10_000
    t = np.arange(count + 1) * period
    road = np.column_stack([4e-3 * np.sin(2 * np.pi * 3 * t), 3e-3 * np.sin(2 * np.pi * 5 * t)])
    commands = np.tile(trim.command, (count, 1))
    commands[count // 2 :, 0] *= 3.0
    car = HalfCar(car.body, car.front, car.rear, car.surface, step)
    return t, car.simulate(trim.state, commands, road, period), commands, road


def test_air_mass_balance_closes(car_and_trim: tuple[HalfCar, Trim]) -> None:
    """The mass in a spring changes by exactly what the orifices pass (Eq. 4.20): 1e-6 of the mass passed."""
    car, trim = car_and_trim
    t, states, commands, _ = excited_run(car, trim, DEFAULT_STEP)
    height = states[:, 0] + car.body.front_arm * states[:, 1] - states[:, 2]
    mass = np.array([air_mass(p, h, car.front) for p, h in zip(states[:, 8], height, strict=True)])

    def net(i: int, row: int) -> tuple[float, float]:
        power = pressure_power(states[i, 8], car.front)
        into = inlet_flow(commands[row, 0], states[i, 8], power, car.front)
        return into, into - outlet_flow(commands[row, 2], states[i, 8], power, car.front)

    half = len(t) // 2
    passed = gained = 0.0
    for span, row in ((range(half + 1), 0), (range(half, len(t)), len(commands) - 1)):
        flows = np.array([net(i, row) for i in span])
        sums = CubicSpline(t[span.start : span.stop], flows).integrate(t[span.start], t[span.stop - 1])
        passed, gained = passed + sums[0], gained + sums[1]
    assert abs(mass[-1] - mass[0] - gained) < 1e-6 * passed


def test_mechanical_energy_balance_closes(car_and_trim: tuple[HalfCar, Trim]) -> None:
    """Kinetic, gravity and tyre energy change by the work of springs and road: 1e-5 of the work done."""
    car, trim = car_and_trim
    t, x, _, road = excited_run(car, trim, DEFAULT_STEP)
    body = car.body
    road_rate = np.column_stack([
        4e-3 * 2 * np.pi * 3 * np.cos(2 * np.pi * 3 * t), 3e-3 * 2 * np.pi * 5 * np.cos(2 * np.pi * 5 * t)
    ])  # fmt: skip
    energy = 0.5 * (body.sprung_mass * x[:, 4] ** 2 + body.pitch_inertia * x[:, 5] ** 2)
    energy += GRAVITY * (
        body.sprung_mass * x[:, 0] + body.unsprung_mass_front * x[:, 2] + body.unsprung_mass_rear * x[:, 3]
    )
    power = np.zeros(len(t))
    for side, arm, axle, gas, scale, damping, mass, stiffness in (
        (0, body.front_arm, 2, car.front, body.area_scale_front, body.damping_front, body.unsprung_mass_front,
         body.tyre_stiffness_front),
        (1, -body.rear_arm, 3, car.rear, body.area_scale_rear, body.damping_rear, body.unsprung_mass_rear,
         body.tyre_stiffness_rear),
    ):  # fmt: skip
        squeeze = road[:, side] - x[:, axle]
        energy += 0.5 * mass * x[:, axle + 4] ** 2 + 0.5 * stiffness * squeeze**2
        height, rate = x[:, 0] + arm * x[:, 1] - x[:, axle], x[:, 4] + arm * x[:, 5] - x[:, axle + 4]
        gauge = x[:, 8 + side] - gas.ambient_pressure
        area = np.array([effective_area(h, p, car.surface) for h, p in zip(height, gauge, strict=True)])
        power += (gauge * scale * area - damping * rate) * rate + stiffness * squeeze * road_rate[:, side]
    work = CubicSpline(t, power).antiderivative()(t)
    done = CubicSpline(t, np.abs(power)).integrate(t[0], t[-1])
    assert np.max(np.abs(energy - energy[0] - work)) < 1e-5 * done


def test_step_order_is_four(car_and_trim: tuple[HalfCar, Trim]) -> None:
    """Halving the step of a smooth run shrinks the error about sixteenfold."""
    car, trim = car_and_trim
    period = 8e-3
    t = np.arange(126) * period
    road = np.column_stack([1e-3 * t, 1e-3 * t])
    commands = np.tile(trim.command * 1.05, (125, 1))

    def end(step: float) -> np.ndarray:
        return HalfCar(car.body, car.front, car.rear, car.surface, step).simulate(trim.state, commands, road, period)[
            -1
        ]

    exact = end(period / 64)
    coarse, fine = (np.linalg.norm((end(period / k) - exact) / trim.state.std()) for k in (1, 2))
    assert 8.0 < coarse / fine < 40.0


def test_reference_pressure_stays_when_the_rig_is_perturbed() -> None:
    rig = load_rig()
    _, trim = nominal_half_car(rig)
    car = half_car(rig.with_values(sprung_mass=60.0), trim.pressures)
    assert car.front.reference_pressure == trim.pressures[0]
    assert np.allclose((np.array(trim.pressures) - ATMOSPHERE) / PSI, [25.487, 47.564], atol=1e-3)


@pytest.mark.parametrize("n", [1.0, 1.05, 1.4, 1.67])
def test_flow_function_peaks_at_the_critical_ratio(n: float) -> None:
    critical = critical_ratio(n)
    peak = flow_function(critical, n)
    assert flow_function(critical * 0.98, n) < peak > flow_function(min(critical * 1.02, 1.0), n)


def test_isothermal_limit_is_smooth() -> None:
    assert flow_function(0.8, 1.0) == pytest.approx(flow_function(0.8, 1.0 + 1e-6), rel=1e-5)


def test_flow_never_reverses() -> None:
    assert mass_flow(1e-6, 2e5, 3e5, 293.15, 1.4) == 0.0


def test_volume_is_the_catalogue_at_60_psig() -> None:
    assert spring_volume(1.8 * INCH) == pytest.approx(4.39 * INCH**3, rel=2e-3)
    assert volume_at_pressure(1.8 * INCH, 60 * PSI + ATMOSPHERE, 1.4, ATMOSPHERE) == spring_volume(1.8 * INCH)
