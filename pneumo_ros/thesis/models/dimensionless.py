# SPDX-License-Identifier: Apache-2.0
"""The dimensionless equations, in Pi-numbers alone: two cars with equal Pi-numbers are one car here.

Conventional half car: Eqs. 3.39-3.42 with their typing corrected (signs of pitch as in the plant, damping ratios over
damping, own forces). Pneumatic: Eqs. 4.42, 4.61, 4.76-4.78 in
the variables of Eqs. 4.30-4.41 and 4.56-4.58, with gauge pressure and gravity written out, which adds three
numbers the thesis hides: g/(h w^2), P3/P1 and c/(m w).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pneumo_ros.plant.air_spring import AreaSurface, effective_area, load_surface
from pneumo_ros.thesis.models.conventional import Conventional
from pneumo_ros.thesis.models.similar_systems import Car, Rates, Spring, Vector, flow_number


class ConventionalPi(NamedTuple):
    """Pi-numbers of the conventional half car over length l, mass m_s and frequency w (Eqs. 3.15-3.28)."""

    stiffness_front: float
    stiffness_rear: float
    damping_front: float
    damping_rear: float
    tyre_front: float
    tyre_rear: float
    unsprung_front: float
    unsprung_rear: float
    front_arm: float
    rear_arm: float
    inertia: float


def conventional_pi(car: Conventional, length: float, frequency: float) -> ConventionalPi:
    """Pi-numbers of a car over a length, m, and a frequency, rad/s."""
    stiffness, damping = car.sprung_mass * frequency**2, car.sprung_mass * frequency
    return ConventionalPi(
        car.stiffness_front / stiffness,
        car.stiffness_rear / stiffness,
        car.damping_front / damping,
        car.damping_rear / damping,
        car.tyre_stiffness_front / stiffness,
        car.tyre_stiffness_rear / stiffness,
        car.unsprung_mass_front / car.sprung_mass,
        car.unsprung_mass_rear / car.sprung_mass,
        car.front_arm / length,
        car.rear_arm / length,
        car.pitch_inertia / (car.sprung_mass * length**2),
    )


def conventional_rates(p: ConventionalPi) -> Rates:
    """Eqs. 3.39-3.42: state (8) over length and length times frequency, time times frequency; road (2,)."""

    def rates(x: Vector, _: Vector, road: Vector) -> Vector:
        a, b = p.front_arm, p.rear_arm
        front = -p.stiffness_front * (x[0] + a * x[1] - x[2]) - p.damping_front * (x[4] + a * x[5] - x[6])
        rear = -p.stiffness_rear * (x[0] - b * x[1] - x[3]) - p.damping_rear * (x[4] - b * x[5] - x[7])
        return np.array([
            x[4], x[5], x[6], x[7],
            front + rear,
            (a * front - b * rear) / p.inertia,
            (p.tyre_front * (road[0] - x[2]) - front) / p.unsprung_front,
            (p.tyre_rear * (road[1] - x[3]) - rear) / p.unsprung_rear,
        ])  # fmt: skip

    return rates


class SpringPi(NamedTuple):
    """Numbers of one air spring (Eqs. 4.28, 4.33-4.35 and what errata 18 adds).

    Attributes
    ----------
    flow : Pi_12 = n sqrt(R T1) A/(w V2) with the orifice A and the volume V2 at design height
    exponent, ambient, reference : n, P3/P1, P_ref/P1
    volume_offset, volume_slope : V/V2 = offset + slope h
    height, pressure : design height and supply pressure in the units of the 2M2A's table
    """

    flow: float
    exponent: float
    ambient: float
    reference: float
    volume_offset: float
    volume_slope: float
    height: float
    pressure: float


class CarPi(NamedTuple):
    """Numbers of the pneumatic cars (Eqs. 4.29, 4.59-4.60, 4.73-4.75).

    Attributes
    ----------
    gravity : g/(h w^2)
    sprung, unsprung : Pi_P, Pi_Pu = P1 A_eff/(m h w^2)
    pitch_front, pitch_rear : Pi_PJ = a P1 A_eff/(J w^2), b P1 A_eff/(J w^2)
    tyre : Pi_Ku = K_u/(m_u w^2)
    damping : c w h/(P1 A_eff): bushing force over spring force
    front_arm, rear_arm : over h
    front, rear : the springs
    """

    gravity: float
    sprung: float
    unsprung: float
    pitch_front: float
    pitch_rear: float
    tyre: float
    damping: float
    front_arm: float
    rear_arm: float
    front: SpringPi
    rear: SpringPi


def car_pi(car: Car, height: float, area: float, orifice: float, frequency: float) -> CarPi:
    """Numbers of a car over design height h, m, effective area A_eff and orifice A, m2, and frequency w, rad/s."""
    force = car.front.supply * area
    return CarPi(
        car.gravity / (height * frequency**2),
        force / (car.sprung_mass * height * frequency**2),
        force / (car.unsprung_mass * height * frequency**2),
        car.front_arm * force / (car.inertia * frequency**2),
        car.rear_arm * force / (car.inertia * frequency**2),
        car.tyre_stiffness / (car.unsprung_mass * frequency**2),
        car.front.damping * frequency * height / force,
        car.front_arm / height,
        car.rear_arm / height,
        _spring_pi(car.front, height, orifice, frequency),
        _spring_pi(car.rear, height, orifice, frequency),
    )


def _spring_pi(s: Spring, height: float, orifice: float, frequency: float) -> SpringPi:
    volume = s.volume_offset + s.mean_area * height
    return SpringPi(
        s.exponent * s.gas_speed * orifice / (frequency * volume),
        s.exponent,
        s.ambient / s.supply,
        s.reference / s.supply,
        s.volume_offset / volume,
        s.mean_area * height / volume,
        height / s.length_scale,
        s.supply / s.pressure_scale,
    )


def _spring(
    p: float, h: float, v: float, u: float, w: float, s: SpringPi, area_unit: float, surface: AreaSurface
) -> tuple[float, float]:
    """Pressure force over P1 A_eff, and pressure rate over P1 w (second line of Eq. 4.42)."""
    gauge = p - s.ambient
    area = effective_area(h * s.height, gauge * s.pressure, surface) / area_unit
    theta = (p / s.reference) ** ((s.exponent - 1.0) / s.exponent)
    fill = theta * flow_number(p, s.exponent) * u
    empty = p * math.sqrt(theta) * flow_number(s.ambient / p, s.exponent) * w
    volume = s.volume_offset + s.volume_slope * h
    return gauge * float(area), (s.flow * (fill - empty) - s.exponent * p * s.volume_slope * v) / volume


def air_spring_rates(n: CarPi, area_unit: float, surface: AreaSurface | None = None) -> Rates:
    """Eq. 4.42: state (3) over h, h w and P1; ``area_unit`` is A_eff in the 2M2A table's unit, m2."""
    table = surface or load_surface()

    def rates(x: Vector, u: Vector, road: Vector) -> Vector:
        h, v = x[0] - road[0], x[1] - road[1]
        force, pressure_rate = _spring(x[2], h, v, u[0], u[1], n.front, area_unit, table)
        return np.array([x[1], n.sprung * (force - n.damping * v) - n.gravity, pressure_rate])

    return rates


def quarter_rates(n: CarPi, area_unit: float, surface: AreaSurface | None = None) -> Rates:
    """Eqs. 4.42 and 4.61: state (5), road (1,)."""
    table = surface or load_surface()

    def rates(x: Vector, u: Vector, road: Vector) -> Vector:
        h, v = x[0] - x[1], x[2] - x[3]
        force, pressure_rate = _spring(x[4], h, v, u[0], u[1], n.front, area_unit, table)
        force -= n.damping * v
        axle = n.tyre * (road[0] - x[1]) - n.unsprung * force - n.gravity
        return np.array([x[2], x[3], n.sprung * force - n.gravity, axle, pressure_rate])

    return rates


def half_rates(n: CarPi, area_unit: float, surface: AreaSurface | None = None) -> Rates:
    """Eq. 4.76: state (10), road (2,)."""
    table = surface or load_surface()

    def rates(x: Vector, u: Vector, road: Vector) -> Vector:
        a, b = n.front_arm, n.rear_arm
        hf, hr = x[0] + a * x[1] - x[2], x[0] - b * x[1] - x[3]
        vf, vr = x[4] + a * x[5] - x[6], x[4] - b * x[5] - x[7]
        ff, pf = _spring(x[8], hf, vf, u[0], u[2], n.front, area_unit, table)
        fr, pr = _spring(x[9], hr, vr, u[1], u[3], n.rear, area_unit, table)
        ff, fr = ff - n.damping * vf, fr - n.damping * vr
        return np.array([
            x[4], x[5], x[6], x[7],
            n.sprung * (ff + fr) - n.gravity,
            n.pitch_front * ff - n.pitch_rear * fr,
            n.tyre * (road[0] - x[2]) - n.unsprung * ff - n.gravity,
            n.tyre * (road[1] - x[3]) - n.unsprung * fr - n.gravity,
            pf, pr,
        ])  # fmt: skip

    return rates
