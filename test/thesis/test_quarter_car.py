# SPDX-License-Identifier: Apache-2.0
"""The quarter car against the half car it is a corner of, and at rest."""

from __future__ import annotations

import numpy as np
import pytest

from pneumo_ros.errors import InputError
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig
from pneumo_ros.thesis.models.quarter_car import constant_area_surface, quarter_car
from pneumo_ros.units import GRAVITY, SQUARE_INCH


def test_rest_is_an_equilibrium() -> None:
    for surface, mean_area in ((None, None), (constant_area_surface(5 * SQUARE_INCH), 5 * SQUARE_INCH)):
        car, trim = quarter_car(load_rig(), 25.0, surface, mean_area)
        rates = car.rates(trim.state, trim.command, 0.0)
        assert np.max(np.abs(rates[:4])) < 1e-8 and abs(rates[4]) < 1e-3
        assert (trim.state[4] - 101325.0) > 0.0


def test_symmetric_half_car_in_heave_is_two_quarter_cars() -> None:
    rig = load_rig().with_values(front_arm=0.25, rear_arm=0.25)
    half, rest = nominal_half_car(rig)
    quarter, trim = quarter_car(rig, rig.sprung_mass.value / 2.0)
    t = np.arange(2001) * 0.002
    road = 0.004 * np.sin(2 * np.pi * 2.5 * t)
    command = np.tile(rest.command, (2000, 1))
    command[500:, :2] *= 1.5
    both = half.simulate(rest.state, command, np.column_stack([road, road]), 0.002)
    one = quarter.simulate(trim.state, command[:, [0, 2]], road, 0.002)
    assert isinstance(half, HalfCar)
    np.testing.assert_allclose(one[:, 0], both[:, 0], atol=1e-9)
    np.testing.assert_allclose(one[:, 4], both[:, 8], rtol=1e-9)
    assert one[:, 0].std() > 1e-3


def test_cylinder_carries_weight_by_pressure_alone() -> None:
    area = 5 * SQUARE_INCH
    car, trim = quarter_car(load_rig(), 25.0, constant_area_surface(area), area)
    assert (trim.state[4] - 101325.0) * area == pytest.approx(25.0 * GRAVITY)
    assert car.gas.volume_offset == 0.0


def test_impossible_load_is_refused() -> None:
    with pytest.raises(InputError, match="cannot carry"):
        quarter_car(load_rig(), 500.0)
