# SPDX-License-Identifier: Apache-2.0
"""The half car's estimator against the plant's own equations: where these hold, nothing is left to estimate."""

from __future__ import annotations

import numpy as np
import pytest

from pneumo_ros.estimation.half_car import (
    HEIGHT_UNIT,
    SLOPE_STEP,
    SMALLEST_SLOPE,
    Estimator,
    believed_areas,
    build_estimator,
    estimate_areas,
    kinematics,
    regression,
)
from pneumo_ros.estimation.least_squares import METHODS, initial_gain
from pneumo_ros.parameters import Value
from pneumo_ros.plant.air_spring import MEAN_AREA, effective_area, load_surface
from pneumo_ros.rig import load_rig
from pneumo_ros.rig.channels import ESTIMATE_FIELDS
from pneumo_ros.units import GRAVITY

PERIOD = 2e-3  # s
RIG = load_rig().with_values(front_arm=0.31, rear_arm=0.23, bushing_damping=60.0)
SURFACE = load_surface()
HEIGHTS, RATES, PRESSURES = (0.0452, 0.0471), (0.031, -0.052), (2.71e5, 4.18e5)  # m, m/s, Pa absolute


def built(**values: Value) -> Estimator:
    return build_estimator(RIG, PERIOD, values)


def true_areas() -> tuple[float, float]:
    front, rear = (
        effective_area(h, p - RIG.ambient_pressure.value, SURFACE) for h, p in zip(HEIGHTS, PRESSURES, strict=True)
    )
    return front, rear


def balanced() -> np.ndarray:
    """An estimate (16,) in which forces and accelerations agree (Eqs. 4.63 and 4.64, gauge pressures), rate by rate."""
    areas = true_areas()
    front, rear = (
        (p - RIG.ambient_pressure.value) * area - RIG.bushing_damping.value * rate
        for p, area, rate in zip(PRESSURES, areas, RATES, strict=True)
    )
    heave = (front + rear) / RIG.sprung_mass.value - GRAVITY
    pitch = (RIG.front_arm.value * front - RIG.rear_arm.value * rear) / RIG.pitch_inertia.value
    return np.array([0.0, 0.0, 0.0, 0.0, heave, pitch, *HEIGHTS, *RATES, 0.0, 0.0, *PRESSURES, *areas])


@pytest.mark.parametrize("first", [0, 2])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_four_points_of_a_rigid_body_and_two_axles(order: int, first: int) -> None:
    """Front point up by a tau, rear one down by b tau; each height is its point above its axle."""
    heave, pitch, axles = 0.7, -0.3, (0.2, 0.05)
    d = np.full((4, first + 4), np.nan)
    d[:, first + order] = [heave + RIG.front_arm.value * pitch, heave - RIG.rear_arm.value * pitch, *axles]
    found = kinematics(d, order, first, built().model)
    assert found == pytest.approx((heave, pitch, d[0, first + order] - 0.2, d[1, first + order] - 0.05), rel=1e-12)


def test_nothing_is_left_where_forces_and_accelerations_agree() -> None:
    _, residual = regression(balanced(), true_areas(), (MEAN_AREA, MEAN_AREA), built().model)
    assert np.abs(residual).max() < 1e-9


@pytest.mark.parametrize("known", [False, True])
def test_the_regressor_is_the_residuals_slope(known: bool) -> None:
    model, x, step = built(known_surface=known).model, balanced(), 1e-7
    at = np.array([0.02, -0.03]) if known else np.array([0.9, 1.1])
    areas, slopes = believed_areas(x, at, model, SURFACE)
    W, residual = regression(x, areas, slopes, model)
    for k in range(2):
        moved = at + step * (np.arange(2) == k)
        other, _ = believed_areas(x, moved, model, SURFACE)
        _, there = regression(x, other, slopes, model)
        # The surface's slope is taken over 10 um, within which it changes by half a per mille.
        np.testing.assert_allclose((residual - there) / step, W[:, k], rtol=1e-3 if known else 1e-6, atol=1e-6)


def test_both_rows_are_in_metres_per_second_squared() -> None:
    """A force F at one end gives F/m and F a/(m rho): the pitch row by the radius of gyration rho."""
    model = built().model
    radius = float(np.sqrt(RIG.pitch_inertia.value / RIG.sprung_mass.value))
    W, _ = regression(balanced(), true_areas(), (MEAN_AREA, MEAN_AREA), model)
    front, rear = ((p - RIG.ambient_pressure.value) * MEAN_AREA / RIG.sprung_mass.value for p in PRESSURES)
    wanted = [[front, rear], [RIG.front_arm.value / radius * front, -RIG.rear_arm.value / radius * rear]]
    np.testing.assert_allclose(W, wanted, rtol=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_areas_that_nobody_knows_are_found(method: str) -> None:
    model = built(method=method).model
    a, gain = np.array([0.8, 1.3]), initial_gain(2, 10.0)
    for _ in range(4000):
        x = balanced()
        x[14:] = 0.0
        a, gain = estimate_areas(x, a, gain, model, SURFACE)
    known = 2e-4 if method == "least_squares" else 1e-6  # one that forgets nothing comes nearer as 1/t
    np.testing.assert_allclose(x[14:], true_areas(), rtol=known)
    np.testing.assert_allclose(a * MEAN_AREA, true_areas(), rtol=known)
    np.testing.assert_array_equal(x[:14], balanced()[:14])


def test_heights_that_are_read_wrong_are_found_where_the_surface_is_known() -> None:
    wrong = np.array([8e-4, -5e-4])  # m
    model = built(known_surface=True).model
    a, gain = np.zeros(2), initial_gain(2, 10.0)
    for _ in range(4000):
        x = balanced()
        x[6:8] += wrong
        x[14:] = 0.0
        a, gain = estimate_areas(x, a, gain, model, SURFACE)
    np.testing.assert_allclose(HEIGHT_UNIT * a, -wrong, atol=1e-6)
    np.testing.assert_allclose(x[6:8], HEIGHTS, atol=1e-6)
    np.testing.assert_allclose(x[14:], true_areas(), rtol=1e-3)


def test_accelerations_from_pressures_forget_the_differentiators() -> None:
    model = built(acceleration_from_pressure=True).model
    x = balanced()
    x[4:6] += [0.7, -2.0]
    known = np.array(true_areas()) / MEAN_AREA
    estimate_areas(x, known, initial_gain(2, 1e-9), model, SURFACE)  # too slow to take them for areas
    np.testing.assert_allclose(x[4:6], balanced()[4:6], atol=1e-6)


def test_the_area_falls_with_the_height_even_where_the_surface_is_flat() -> None:
    model = built(known_surface=True).model
    x = balanced()
    _, slopes = believed_areas(x, np.zeros(2), model, SURFACE)
    for height, pressure, slope in zip(HEIGHTS, PRESSURES, slopes, strict=True):
        gauge = pressure - RIG.ambient_pressure.value
        rise = effective_area(height + SLOPE_STEP, gauge, SURFACE) - effective_area(height, gauge, SURFACE)
        assert slope == pytest.approx(HEIGHT_UNIT * min(rise / SLOPE_STEP, -SMALLEST_SLOPE), rel=1e-9)
        assert slope <= -HEIGHT_UNIT * SMALLEST_SLOPE
    x[6] = 1.0  # far outside the table
    assert believed_areas(x, np.zeros(2), model, SURFACE)[1][0] == -HEIGHT_UNIT * SMALLEST_SLOPE


def test_the_model_is_the_rigs_and_a_payload_scales_mass_and_inertia_alone() -> None:
    model, heavy = built().model, built(mass_scale=1.25).model
    assert (model.front_arm, model.rear_arm, model.damping) == (0.31, 0.23, 60.0)
    assert (model.mass, model.inertia) == (RIG.sprung_mass.value, RIG.pitch_inertia.value)
    assert (heavy.mass, heavy.inertia) == (1.25 * model.mass, 1.25 * model.inertia)
    assert heavy._replace(mass=model.mass, inertia=model.inertia) == model
    assert (model.ambient, model.period, model.filtering) == (RIG.ambient_pressure.value, PERIOD, 0)
    assert METHODS[model.method] == "bounded" and (model.forgetting, model.gain_bound) == (50.0, 20.0)


def test_it_starts_at_rest_where_it_is_and_tells_its_fields_in_order() -> None:
    """Body up by 1 mm/s and axles still: after half a second the rates are the motion's, in the columns that say so."""
    estimator = built(order=2, sprung_bound=5.0, unsprung_bound=9.0)
    assert estimator.differentiator.bounds.tolist() == [5.0, 5.0, 9.0, 9.0]
    start = np.array([0.0291, 0.0207, -0.0166, -0.0250, *PRESSURES])
    state = estimator.init(start)
    assert state.areas.tolist() == [1.0, 1.0] and state.derivatives.shape == (4, 3)
    assert state.derivatives[:, 0].tolist() == start[:4].tolist() and not state.derivatives[:, 1:].any()
    np.testing.assert_array_equal(state.gain, initial_gain(2, 10.0))
    assert built(known_surface=True).init(start).areas.tolist() == [0.0, 0.0]
    assert built(area_start=1.2).init(start).areas.tolist() == [1.2, 1.2]
    for i in range(250):
        time = (i + 1) * PERIOD
        measurement = start + 1e-3 * time * np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
        state, found = estimator.step(state, measurement)
    told = {name: value for (name, _), value in zip(ESTIMATE_FIELDS, found, strict=True)}
    rear, front = RIG.rear_arm.value, RIG.front_arm.value
    heave = (rear * measurement[0] + front * measurement[1]) / (front + rear)
    np.testing.assert_allclose(found[:2], [heave, (measurement[0] - measurement[1]) / (front + rear)], atol=1e-6)
    np.testing.assert_allclose(found[2:4], [1e-3, 0.0], atol=2e-5)
    np.testing.assert_allclose(found[6:8], [measurement[0] - start[2], measurement[1] - start[3]], atol=1e-6)
    np.testing.assert_allclose(found[8:10], [1e-3, 1e-3], atol=2e-5)
    assert (told["front_pressure"], told["rear_pressure"]) == PRESSURES
    assert told["heave_rate"] == found[2] and told["front_height_rate"] == found[8]
    assert np.isfinite(found).all()
