# SPDX-License-Identifier: Apache-2.0
"""Controllers: the laws, the core against the plant, and the closed loop's figures."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from pneumo_ros.control.guard import guarded_step
from pneumo_ros.control.half_car import CONTROLLERS, PARAMETERS, Controller, build_controller, control_half_car
from pneumo_ros.control.laws.common import Error, Gains, saturation
from pneumo_ros.control.laws.family import LAWS, wanted_jerk
from pneumo_ros.control.linearisation import Compensation, Spring, force_rates, openings
from pneumo_ros.control.loop import Run, close_loop
from pneumo_ros.control.reference_model import advance_reference, reference_jerk
from pneumo_ros.errors import InputError
from pneumo_ros.estimation.half_car import build_estimator
from pneumo_ros.plant.air_spring import effective_area
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.plant.trim import Trim, nominal_half_car
from pneumo_ros.ride.comfort import mean_personal_rating, rms, tyre_load_variation
from pneumo_ros.rig import Rig, load_rig
from pneumo_ros.road import RoadSpec, make_road
from pneumo_ros.units import GRAVITY, INCH, SQUARE_INCH

PERIOD = 0.002
SETTLED = int(3.0 / PERIOD)
SEEDS = (1, 2, 3, 4, 5)


@pytest.fixture(scope="module")
def rig() -> Rig:
    return load_rig()


@pytest.fixture(scope="module")
def car_and_trim(rig: Rig) -> tuple[HalfCar, Trim]:
    return nominal_half_car(rig)


@cache
def class_d(seed: int, duration: float = 12.0) -> np.ndarray:
    return make_road(RoadSpec(seed=seed)).sample(np.arange(int(duration / PERIOD) + 1) * PERIOD)[0]


def heave_rms(run: Run) -> float:
    return rms(np.gradient(run.states[:, 4], PERIOD)[SETTLED:])


def drive(rig: Rig, seed: int, values: dict | None = None, **options: object) -> Run:
    car, _ = nominal_half_car(rig)
    estimator, controller = build_estimator(rig, PERIOD), build_controller(rig, PERIOD, values)
    return close_loop(car, rig, estimator, controller, class_d(seed), seed=seed, **options)


def true_areas(run: Run, car: HalfCar) -> np.ndarray:
    x = run.states[:-1]
    heights = (x[:, 0] + car.body.front_arm * x[:, 1] - x[:, 2], x[:, 0] - car.body.rear_arm * x[:, 1] - x[:, 3])
    return np.array([
        [effective_area(h[i], x[i, 8 + side] - 101325.0, car.surface) for i in range(len(x))]
        for side, h in enumerate(heights)
    ]).T  # fmt: skip


def test_boundary_layer_is_odd_continuous_and_one_at_its_edge() -> None:
    assert saturation(0.25, 0.25) == 1.0 and saturation(-9.0, 0.25) == -1.0 and saturation(0.0, 1.0) == 0.0
    assert saturation(0.25 - 1e-12, 0.25) == pytest.approx(1.0, abs=1e-5)
    assert saturation(-0.1, 0.25) == -saturation(0.1, 0.25)
    assert saturation(0.5, 1.0) == pytest.approx(1.0 / 3.0)


def test_linear_laws_are_a_triple_pole() -> None:
    error = Error(0.3, -0.2, 0.7, 0.0, 5.0)
    wanted, _ = wanted_jerk(LAWS.index("mrflc"), error, Gains(4.0, 0.0, 1.0))
    assert wanted == pytest.approx(5.0 - 12.0 * 0.7 + 48.0 * 0.2 - 64.0 * 0.3)


@pytest.mark.parametrize("law", [name for name in LAWS if "smc" in name or "smflc" in name])
def test_sliding_laws_drive_their_surface_to_zero(law: str) -> None:
    """On a triple integrator with the law's own jerk, S S' < 0 outside the layer and the error vanishes."""
    gains, dt = Gains(5.0, 200.0, 0.1), 1e-3
    y, v, a, integral = 0.02, 0.0, 0.0, 0.0
    for _ in range(8000):
        jerk, _ = wanted_jerk(LAWS.index(law), Error(y, v, a, integral, 0.0), gains)
        y, v, a, integral = y + dt * v, v + dt * a, a + dt * jerk, integral + dt * y
    assert abs(y) < (5e-3 if law == "third_order_smc" else 1e-4)


def test_reference_model_is_exact_and_settles() -> None:
    """Many small steps equal one large one, the derivative matches, and the end is the target."""
    state = (0.1, -0.3, 2.0)
    small = state
    for _ in range(100):
        small = advance_reference(small, 0.05, 10.0, 0.002)
    np.testing.assert_allclose(small, advance_reference(state, 0.05, 10.0, 0.2), rtol=1e-9, atol=1e-12)
    ahead = advance_reference(state, 0.05, 10.0, 1e-6)
    assert (ahead[2] - state[2]) / 1e-6 == pytest.approx(reference_jerk(state, 0.05, 10.0), rel=1e-3)
    np.testing.assert_allclose(advance_reference(state, 0.05, 10.0, 5.0), [0.05, 0.0, 0.0], atol=1e-12)


def test_force_rates_invert_the_geometry() -> None:
    front, rear = force_rates(3.0, -7.0, 50.0, 2.9, 0.31, 0.19)
    assert (front + rear) / 50.0 == pytest.approx(3.0)
    assert (0.31 * front - 0.19 * rear) / 2.9 == pytest.approx(-7.0)


def test_core_inverts_the_plant(car_and_trim: tuple[HalfCar, Trim]) -> None:
    """Openings for a wanted force rate, put into the plant, give it: exactly once dA/dt and bushing are fed forward."""
    car, trim = car_and_trim
    x = trim.state.copy()
    x[4:8] = [0.05, 0.1, -0.04, 0.03]
    quiet = HalfCar(car.body._replace(damping_front=0.0, damping_rear=0.0), car.front, car.rear, car.surface)

    def force(state: np.ndarray) -> float:
        h, gauge = state[0] + quiet.body.front_arm * state[1] - state[2], state[8] - 101325.0
        return float(gauge * effective_area(h, gauge, car.surface))

    height, rate = x[0] + car.body.front_arm * x[1] - x[2], x[4] + car.body.front_arm * x[5] - x[6]
    area = effective_area(height, x[8] - 101325.0, car.surface)
    volume = car.front.volume_offset + car.front.mean_area * height
    spring = Spring(x[8], height, rate, 0.0, area, volume, car.front.mean_area)
    for wanted in (400.0, 0.0, -150.0):
        for two_valve in (0.0, 1.0):
            inlet, outlet = openings(
                wanted, spring, trim.outlets[0], Compensation(1.0, 0.0, two_valve), car.front, car.surface
            )
            command = np.array([max(inlet, 0.0), trim.command[1], outlet, trim.outlets[1]])
            if inlet < 0.0:
                continue
            ahead = quiet.rates(x, command, np.zeros(2))
            got = (force(x + 1e-7 * ahead) - force(x - 1e-7 * ahead)) / 2e-7
            assert got == pytest.approx(wanted, abs=1.0)


def test_at_rest_every_active_controller_commands_trim(rig: Rig, car_and_trim: tuple[HalfCar, Trim]) -> None:
    _, trim = car_and_trim
    x = trim.state
    estimate = np.zeros(16)
    estimate[:2] = x[:2]
    estimate[6:8] = rig.design_height.value
    estimate[12:14] = x[8:]
    surface = nominal_half_car(rig)[0].surface
    estimate[14:] = [effective_area(rig.design_height.value, p - 101325.0, surface) for p in x[8:]]
    for name in CONTROLLERS:
        controller = build_controller(rig, PERIOD, {"controller": name})
        _, command, _ = controller.step(controller.init(), estimate)
        net = [trim.command] if name != "two_valve" else [np.zeros(4)]
        np.testing.assert_allclose(command, net[0], atol=1e-12)


@pytest.mark.parametrize("delay", [0, 1])
def test_active_control_lowers_heave_by_45_percent_seed_by_seed(rig: Rig, delay: int) -> None:
    for seed in SEEDS:
        active = heave_rms(drive(rig, seed, delay=delay))
        assert active < 0.55 * heave_rms(drive(rig, seed, {"controller": "passive"})), seed


def test_it_does_so_with_the_uncertainties_of_the_thesis(rig: Rig) -> None:
    values = {"volume_estimate_in3": 4.0, "height_error_in": 0.2}
    for seed in SEEDS:
        passive = heave_rms(drive(rig, seed, {"controller": "passive"}))
        assert heave_rms(drive(rig, seed, values)) < 0.55 * passive


def test_active_control_loads_the_tyres_less_than_passive(rig: Rig) -> None:
    def variation(run: Run) -> float:
        force = 14000.0 * (run.road - run.states[:, 2:4])[SETTLED:]
        static = [(0.1938 / 0.508 * 50.33 + 4.54) * GRAVITY, (0.3142 / 0.508 * 50.33 + 4.54) * GRAVITY]
        return float(np.mean([tyre_load_variation(force[:, i], static[i]) for i in (0, 1)]))

    for seed in SEEDS:
        assert variation(drive(rig, seed)) < variation(drive(rig, seed, {"controller": "passive"}))


def test_area_estimate_converges_in_half_a_second_and_stays_near(rig: Rig, car_and_trim: tuple[HalfCar, Trim]) -> None:
    """From 50 % off to within 10 % in under 0.5 s; rms error after 1 s under 8 % of the static area (0.13 in2)."""
    car, _ = car_and_trim
    for seed in SEEDS:
        run = drive(rig, seed)
        error = run.estimates[:, 14:] - true_areas(run, car)
        share = np.abs(error / true_areas(run, car)).max(axis=1)
        inside = np.flatnonzero(share < 0.10)
        assert share[0] > 0.1 and inside[0] < int(0.2 / PERIOD)
        assert np.mean(share[inside[0] : int(0.5 / PERIOD)] < 0.10) > 0.95
        assert rms(error[int(1.0 / PERIOD) :]) < 0.13 * SQUARE_INCH


def test_exact_accelerations_sharpen_the_area_estimate(rig: Rig, car_and_trim: tuple[HalfCar, Trim]) -> None:
    """With the true accelerations the bandwidth can rise, and the error falls below 0.05 in2."""
    car, _ = car_and_trim
    quiet = rig.with_values(displacement_noise=0.0, pressure_noise=0.0)
    estimator = build_estimator(rig, PERIOD, {"forgetting": 200.0})
    run = close_loop(car, quiet, estimator, build_controller(rig, PERIOD), class_d(1), exact=True)
    assert rms((run.estimates[:, 14:] - true_areas(run, car))[SETTLED:]) < 0.05 * SQUARE_INCH


def test_loop_is_the_plant_the_estimator_and_the_controller_step_by_step(rig: Rig) -> None:
    """What a node computes call by call is what the compiled loop computes, bit by bit."""
    run = drive(rig, 2)
    estimator, controller = build_estimator(rig, PERIOD), build_controller(rig, PERIOD)
    state, control = estimator.init(run.measurements[0]), controller.init()
    car, _ = nominal_half_car(rig)
    for i in range(200):
        state, estimate = estimator.step(state, run.measurements[i])
        control, command, _ = controller.step(control, estimate)
        assert np.array_equal(command, run.commands[i]) and np.array_equal(estimate, run.estimates[i])
        after = car.advance(run.states[i], command, run.road[i : i + 2], PERIOD)
        assert np.array_equal(after, run.states[i + 1])


def test_live_gain_change_keeps_the_state_and_only_changes_the_law(rig: Rig) -> None:
    controller = build_controller(rig, PERIOD)
    changed = controller.with_values({"pole": 20.0}, rig)
    assert isinstance(changed, Controller) and changed.law.heave.pole == 20.0
    assert changed.law._replace(heave=controller.law.heave, pitch=controller.law.pitch) == controller.law


def test_gains_are_converted_from_inch_seconds(rig: Rig) -> None:
    law = build_controller(rig, PERIOD, {"sliding_heave_in_s3": 20000.0, "layer_heave_in_s": 10.0}).law
    assert law.heave.sliding == pytest.approx(20000.0 * INCH) and law.heave.layer == pytest.approx(10.0 * INCH)


def test_every_parameter_is_declared_completely() -> None:
    from pneumo_ros.estimation.half_car import PARAMETERS as ESTIMATION
    from pneumo_ros.road import PARAMETERS as ROAD

    for parameter in (*PARAMETERS, *ESTIMATION, *ROAD):
        assert parameter.description and parameter.checked(parameter.default) == parameter.default
        if isinstance(parameter.default, float | int) and not isinstance(parameter.default, bool):
            assert parameter.unit and np.isfinite([parameter.low, parameter.high]).all()


@pytest.mark.parametrize(("key", "value"), [("pole", 1e9), ("pole", float("nan")), ("pole", "x"), ("polle", 1.0)])
def test_bad_parameter_is_one_line_with_its_range(rig: Rig, key: str, value: object) -> None:
    with pytest.raises(InputError) as error:
        build_controller(rig, PERIOD, {key: value}, "config.yaml")
    assert key in str(error.value) and "allowed" in str(error.value) and "\n" not in str(error.value)


def test_mean_personal_rating_is_limited_and_in_g() -> None:
    assert mean_personal_rating(0.05 * GRAVITY) == pytest.approx(3.43)
    assert mean_personal_rating(0.0) == 5.0 and mean_personal_rating(10.0) == 0.0


@pytest.mark.parametrize("name", CONTROLLERS[1:])
def test_packed_parameters_are_the_controllers(name: str) -> None:
    """The one array that a session hands to compiled code holds every parameter in its place."""
    controller = build_controller(load_rig(), 0.002, {"controller": name, "height_error_in": 0.2, "mass_scale": 1.3})
    rng = np.random.default_rng(3)
    typical = np.array([0.02, 0.016, 0.1, 0.1, 1, 2, 0.045, 0.046, 0.1, 0.1, 1, 1, 2.7e5, 4.2e5, 1e-3, 1e-3])
    for _ in range(10):
        estimate, state = typical * rng.uniform(0.8, 1.2, 16), rng.normal(0.0, 0.01, 8)
        whole = control_half_car(state, estimate, controller.law, controller.front, controller.rear, controller.surface)
        for packed, direct in zip(controller.step(state, estimate), whole, strict=True):
            np.testing.assert_array_equal(packed, direct)


def test_a_command_that_is_not_finite_never_leaves_and_spoils_no_state() -> None:
    """An estimate with a NaN: the valves go to trim, and the next sound estimate is answered as if nothing had been."""
    controller = build_controller(load_rig(), 0.002)
    state, sound = controller.init(), np.full(16, 1e-3)
    spoiled = sound.copy()
    spoiled[0] = np.nan
    refused = guarded_step(controller, state, spoiled)
    assert refused.refused and refused.state is state
    assert np.array_equal(refused.command, controller.at_rest.command)
    after, never = guarded_step(controller, refused.state, sound), guarded_step(controller, state, sound)
    assert not after.refused and np.array_equal(after.command, never.command)
