# SPDX-License-Identifier: Apache-2.0
"""What is measured, commanded, estimated and simulated: the names, their columns, and where a point of the body is.

All displacements are upwards from the ground datum; pitch is positive nose up.
"""

from __future__ import annotations

from typing import Any

from numba.extending import register_jitable

DISPLACEMENTS = ("sprung_front", "sprung_rear", "unsprung_front", "unsprung_rear")  # LVDTs, sprung above the axles
PRESSURES = ("front_pressure", "rear_pressure")
CHANNELS = (*DISPLACEMENTS, *PRESSURES)  # what is measured of the rig
UNITS = ("m",) * len(DISPLACEMENTS) + ("Pa",) * len(PRESSURES)  # of CHANNELS
VALVES = ("front_inlet", "rear_inlet", "front_outlet", "rear_outlet")  # commanded orifice areas, m2
ROADS = ("front", "rear")  # road height under each axle, m

# The state of the half car, (10,), and columns of it.
STATE_FIELDS = (
    ("heave", "m"), ("pitch_nose_up", "rad"), ("unsprung_front", "m"), ("unsprung_rear", "m"),
    ("heave_rate", "m/s"), ("pitch_nose_up_rate", "rad/s"),
    ("unsprung_front_rate", "m/s"), ("unsprung_rear_rate", "m/s"),
    ("front_pressure", "Pa"), ("rear_pressure", "Pa"),
)  # fmt: skip
HEAVE, PITCH, UNSPRUNG_FRONT, UNSPRUNG_REAR = range(4)
HEAVE_RATE, PITCH_RATE, UNSPRUNG_FRONT_RATE, UNSPRUNG_REAR_RATE = range(4, 8)
PRESSURE_FRONT, PRESSURE_REAR = 8, 9

# What a simulation knows beyond the sensors, (16,): the state first. Pairs are front and rear.
TRUTH_FIELDS = (
    *STATE_FIELDS,
    ("heave_acceleration", "m/s2"), ("pitch_nose_up_acceleration", "rad/s2"),
    ("front_area", "m2"), ("rear_area", "m2"),
    ("front_tyre_force", "N"), ("rear_tyre_force", "N"),
)  # fmt: skip
TRUE_HEAVE_ACCELERATION, TRUE_PITCH_ACCELERATION = 10, 11
TRUE_AREAS, TRUE_TYRE_FORCES = (12, 13), (14, 15)

# The estimate, (16,). Pairs are front and rear.
ESTIMATE_FIELDS = (
    ("heave", "m"), ("pitch_nose_up", "rad"),
    ("heave_rate", "m/s"), ("pitch_nose_up_rate", "rad/s"),
    ("heave_acceleration", "m/s2"), ("pitch_nose_up_acceleration", "rad/s2"),
    ("front_height", "m"), ("rear_height", "m"),
    ("front_height_rate", "m/s"), ("rear_height_rate", "m/s"),
    ("front_height_acceleration", "m/s2"), ("rear_height_acceleration", "m/s2"),
    ("front_pressure", "Pa"), ("rear_pressure", "Pa"),
    ("front_area", "m2"), ("rear_area", "m2"),
)  # fmt: skip
ESTIMATED_HEIGHTS, ESTIMATED_HEIGHT_RATES, ESTIMATED_HEIGHT_ACCELERATIONS = (6, 7), (8, 9), (10, 11)
ESTIMATED_PRESSURES, ESTIMATED_AREAS = (12, 13), (14, 15)


@register_jitable(inline="always")
def sprung_points(heave: Any, pitch: Any, front_arm: float, rear_arm: float) -> tuple[Any, Any]:
    """Body above the front and above the rear axle, m, for small angles; of rates, their rates.

    Parameters
    ----------
    heave : of the centre of mass, m; a scalar or an array
    pitch : nose up, rad; the same shape
    front_arm, rear_arm : centre of mass to axle, m, both positive
    """
    return heave + front_arm * pitch, heave - rear_arm * pitch


def spring_heights(states: Any, front_arm: float, rear_arm: float) -> tuple[Any, Any]:
    """Front and rear air spring height, m, of half-car states (..., 10) or more columns that begin like one."""
    front, rear = sprung_points(states[..., HEAVE], states[..., PITCH], front_arm, rear_arm)
    return front - states[..., UNSPRUNG_FRONT], rear - states[..., UNSPRUNG_REAR]


def channels_of_states(states: Any, front_arm: float, rear_arm: float) -> tuple[Any, ...]:
    """Columns of :data:`CHANNELS`, m and Pa, of half-car states (..., 10)."""
    return (
        *sprung_points(states[..., HEAVE], states[..., PITCH], front_arm, rear_arm),
        *(states[..., column] for column in (UNSPRUNG_FRONT, UNSPRUNG_REAR, PRESSURE_FRONT, PRESSURE_REAR)),
    )
