# SPDX-License-Identifier: Apache-2.0
"""Equations of motion of the half car on two air springs (Eqs. 4.63-4.72, corrected by errata 1, 7, 8), compiled.

State (10), :data:`~pneumo_ros.rig.channels.STATE_FIELDS`: heave, pitch, unsprung front, unsprung rear [m, rad, m, m],
their rates, front and rear spring pressure [Pa absolute]. All z are upwards from the ground datum; pitch is positive
nose up. Inputs: commanded orifice areas [m2] and road heights [m], front and rear.

Kernel arguments
----------------
x : (10,): heave, pitch, two axle heights, their rates, two absolute pressures; m, rad, m/s, rad/s, Pa
height, height_rate : of a spring, m and m/s, extension positive
pressure, ambient : absolute, Pa
scale, damping : factor on the effective area, 1; of the bushing, N s/m
inlet_front, inlet_rear, outlet_front, outlet_rear : openings, m2
road_front, road_rear : heights of the ground, m
"""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from pneumo_ros.plant.air_spring import AreaSurface, Gas, effective_area, pressure_rate
from pneumo_ros.rig.channels import sprung_points
from pneumo_ros.units import GRAVITY

State = tuple[float, float, float, float, float, float, float, float, float, float]


class Body(NamedTuple):
    """Masses, arms and what lies between body and ground, SI."""

    sprung_mass: float
    pitch_inertia: float
    front_arm: float
    rear_arm: float
    unsprung_mass_front: float
    unsprung_mass_rear: float
    tyre_stiffness_front: float
    tyre_stiffness_rear: float
    damping_front: float
    damping_rear: float
    area_scale_front: float
    area_scale_rear: float
    stop_height: float
    stop_stiffness: float


@njit(cache=True, error_model="numpy")
def spring_force(
    height: float,
    height_rate: float,
    pressure: float,
    scale: float,
    damping: float,
    ambient: float,
    body: Body,
    surface: AreaSurface,
) -> float:
    """Force of one spring with its bushing and bump stop, N, positive upwards on the body."""
    gauge = pressure - ambient
    stop = body.stop_stiffness * max(0.0, body.stop_height - height)
    return gauge * scale * effective_area(height, gauge, surface) - damping * height_rate + stop


@njit(cache=True, error_model="numpy", inline="always")
def accelerations(
    spring_front: float,
    spring_rear: float,
    tyre_front: float,
    tyre_rear: float,
    extra_force: float,
    extra_moment: float,
    body: Body,
) -> tuple[float, float, float, float]:
    """Newton's law for body and axles (Eqs. 4.63-4.66): heave, m/s2, pitch, rad/s2, front and rear axle, m/s2.

    Parameters
    ----------
    spring_front, spring_rear : N, positive upwards on the body
    tyre_front, tyre_rear : N, positive upwards on the axle
    extra_force, extra_moment : what else acts on the body, N and N m nose up
    body : masses and arms
    """
    return (
        (spring_front + spring_rear + extra_force) / body.sprung_mass - GRAVITY,
        (body.front_arm * spring_front - body.rear_arm * spring_rear + extra_moment) / body.pitch_inertia,
        (tyre_front - spring_front) / body.unsprung_mass_front - GRAVITY,
        (tyre_rear - spring_rear) / body.unsprung_mass_rear - GRAVITY,
    )


@njit(cache=True, error_model="numpy", inline="always")
def derivative(
    x: State,
    inlet_front: float,
    inlet_rear: float,
    outlet_front: float,
    outlet_rear: float,
    road_front: float,
    road_rear: float,
    body: Body,
    front: Gas,
    rear: Gas,
    surface: AreaSurface,
) -> State:
    """Right-hand side of Eqs. 4.63-4.68."""
    heave, pitch, zuf, zur, heave_rate, pitch_rate, vuf, vur, pf, pr = x
    zf, zr = sprung_points(heave, pitch, body.front_arm, body.rear_arm)
    vf, vr = sprung_points(heave_rate, pitch_rate, body.front_arm, body.rear_arm)
    hf, hr, hf_rate, hr_rate = zf - zuf, zr - zur, vf - vuf, vr - vur
    ff = spring_force(hf, hf_rate, pf, body.area_scale_front, body.damping_front, front.ambient_pressure, body, surface)
    fr = spring_force(hr, hr_rate, pr, body.area_scale_rear, body.damping_rear, rear.ambient_pressure, body, surface)
    tf = body.tyre_stiffness_front * (road_front - zuf)
    tr = body.tyre_stiffness_rear * (road_rear - zur)
    heave2, pitch2, front2, rear2 = accelerations(ff, fr, tf, tr, 0.0, 0.0, body)
    return (
        heave_rate,
        pitch_rate,
        vuf,
        vur,
        heave2,
        pitch2,
        front2,
        rear2,
        pressure_rate(pf, hf, hf_rate, inlet_front, outlet_front, front),
        pressure_rate(pr, hr, hr_rate, inlet_rear, outlet_rear, rear),
    )
