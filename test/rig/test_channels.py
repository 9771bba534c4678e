# SPDX-License-Identifier: Apache-2.0
"""One list of channels, columns that mean what they say, one formula of a point on the body."""

from __future__ import annotations

import numpy as np

from pneumo_ros.plant.sensors import read_channels, truth
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import channels, load_rig
from pneumo_ros.units import GRAVITY

STATE = np.array([0.05, 0.02, -0.003, 0.004, 0.1, -0.2, 0.3, -0.4, 2.5e5, 4.1e5])


def test_columns_are_those_of_the_fields() -> None:
    state, whole, estimate = (
        [name for name, _ in fields]
        for fields in (channels.STATE_FIELDS, channels.TRUTH_FIELDS, channels.ESTIMATE_FIELDS)
    )
    assert state[channels.PITCH] == "pitch_nose_up" and state[channels.HEAVE_RATE] == "heave_rate"
    assert state[channels.UNSPRUNG_REAR_RATE] == "unsprung_rear_rate"
    assert state[channels.PRESSURE_REAR] == "rear_pressure" and len(channels.UNITS) == len(channels.CHANNELS) == 6
    assert whole[channels.TRUE_PITCH_ACCELERATION] == "pitch_nose_up_acceleration"
    for names, columns, quantity in (
        (whole, channels.TRUE_AREAS, "area"),
        (whole, channels.TRUE_TYRE_FORCES, "tyre_force"),
        (estimate, channels.ESTIMATED_HEIGHTS, "height"),
        (estimate, channels.ESTIMATED_HEIGHT_RATES, "height_rate"),
        (estimate, channels.ESTIMATED_HEIGHT_ACCELERATIONS, "height_acceleration"),
        (estimate, channels.ESTIMATED_PRESSURES, "pressure"),
        (estimate, channels.ESTIMATED_AREAS, "area"),
    ):
        assert [names[k] for k in columns] == [f"front_{quantity}", f"rear_{quantity}"]


def test_points_of_the_body_by_hand() -> None:
    a, b = 0.3142, 0.1938
    front, rear = channels.sprung_points(0.05, 0.02, a, b)
    assert np.isclose(front, 0.056284, rtol=1e-12) and np.isclose(rear, 0.046124, rtol=1e-12)
    heights = channels.spring_heights(np.tile(STATE, (3, 1)), a, b)
    assert np.allclose(heights, [[0.059284] * 3, [0.042124] * 3], rtol=1e-12)


def test_the_true_columns_obey_newton_with_the_sensors_heights() -> None:
    rig = load_rig()
    car, trim = nominal_half_car(rig)
    a, b = rig.front_arm.value, rig.rear_arm.value
    whole = truth(car, STATE, trim.command, np.zeros(2))
    assert whole[:10].tolist() == STATE.tolist()
    read = dict(zip(channels.CHANNELS, read_channels(STATE, a, b), strict=True))
    heights = np.array([read["sprung_front"] - read["unsprung_front"], read["sprung_rear"] - read["unsprung_rear"]])
    rates = np.array(channels.sprung_points(STATE[channels.HEAVE_RATE], STATE[channels.PITCH_RATE], a, b)) - STATE[6:8]
    gauge = np.array([read["front_pressure"], read["rear_pressure"]]) - rig.ambient_pressure.value
    stop = car.body.stop_stiffness * np.maximum(0.0, car.body.stop_height - heights)
    force = gauge * whole[list(channels.TRUE_AREAS)] - rig.bushing_damping.value * rates + stop
    assert np.isclose(whole[channels.TRUE_HEAVE_ACCELERATION], force.sum() / rig.sprung_mass.value - GRAVITY, rtol=1e-9)
    turn = (a * force[0] - b * force[1]) / rig.pitch_inertia.value
    assert np.isclose(whole[channels.TRUE_PITCH_ACCELERATION], turn, rtol=1e-9)
