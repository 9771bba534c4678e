# SPDX-License-Identifier: Apache-2.0
"""Four systems written with every constant as a parameter, so that similitude can be tried on them.

Air spring under a mass (Eqs. 4.22-4.23), quarter car (4.53-4.55) and half car (4.63-4.72) on air springs; their
dimensionless forms are in :mod:`pneumo_ros.thesis.models.dimensionless`. The compiled plant
has gravity and the atmosphere built in; similitude needs them free, because both must scale: g with C_L/C_T^2, the
atmosphere with C_P. Nature lets neither (errata 18).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.plant.air_spring import MEAN_AREA, VOLUME_OFFSET, AreaSurface, effective_area, load_surface
from pneumo_ros.plant.orifice import critical_ratio, flow_function
from pneumo_ros.thesis.models.similitude import Scales
from pneumo_ros.units import ATMOSPHERE, GAS_CONSTANT, GRAVITY

Vector = NDArray[np.float64]
Rates = Callable[[Vector, Vector, Vector], Vector]  # state, orifice areas, road -> rates


class Spring(NamedTuple):
    """An air spring with orifices at some scale.

    Attributes
    ----------
    exponent : n
    supply, ambient, reference : absolute pressures, Pa; reference where the spring's air has the supply's temperature
    gas_speed : sqrt(R T1), m/s
    volume_offset, mean_area : V = volume_offset + mean_area h, m3 and m2
    length_scale, pressure_scale : of the effective area surface: A(h, p) = length_scale^2 A_2M2A(h/length_scale, ...)
    damping : of the bushing, N s/m
    """

    exponent: float
    supply: float
    ambient: float
    reference: float
    gas_speed: float
    volume_offset: float
    mean_area: float
    length_scale: float
    pressure_scale: float
    damping: float


class Car(NamedTuple):
    """A half car at some scale; the quarter car uses the front, the air spring alone the sprung mass."""

    sprung_mass: float
    inertia: float
    front_arm: float
    rear_arm: float
    unsprung_mass: float
    tyre_stiffness: float
    gravity: float
    front: Spring
    rear: Spring


def rig_car(reference_front: float, reference_rear: float) -> Car:
    """The rig of Table 3.4 with static pressures, Pa absolute."""
    from pneumo_ros.rig import load_rig

    rig = load_rig()

    def spring(reference: float) -> Spring:
        speed = math.sqrt(GAS_CONSTANT * rig.supply_temperature.value)
        return Spring(1.4, rig.supply_pressure.value, ATMOSPHERE, reference, speed, VOLUME_OFFSET, MEAN_AREA, 1.0, 1.0,
                      rig.bushing_damping.value)  # fmt: skip

    return Car(
        rig.sprung_mass.value,
        rig.pitch_inertia.value,
        rig.front_arm.value,
        rig.rear_arm.value,
        rig.unsprung_mass_front.value,
        rig.tyre_stiffness_front.value,
        GRAVITY,
        spring(reference_front),
        spring(reference_rear),
    )


def full_scale(car: Car, scales: Scales) -> Car:
    """A car brought to full scale by the laws, gravity and atmosphere included."""
    f = scales.factor

    def spring(s: Spring) -> Spring:
        return Spring(
            s.exponent,
            s.supply * f("pressure"),
            s.ambient * f("pressure"),
            s.reference * f("pressure"),
            s.gas_speed * math.sqrt(scales.temperature),
            s.volume_offset * f("volume"),
            s.mean_area * f("area"),
            s.length_scale * scales.length,
            s.pressure_scale * f("pressure"),
            s.damping * f("damping"),
        )

    return Car(
        car.sprung_mass * f("mass"),
        car.inertia * f("inertia"),
        car.front_arm * f("length"),
        car.rear_arm * f("length"),
        car.unsprung_mass * f("mass"),
        car.tyre_stiffness * f("stiffness"),
        car.gravity * f("acceleration"),
        spring(car.front),
        spring(car.rear),
    )


def area_of(height: float, gauge: float, s: Spring, surface: AreaSurface) -> float:
    """Effective area, m2, of the scaled surface."""
    return s.length_scale**2 * float(effective_area(height / s.length_scale, gauge / s.pressure_scale, surface))


def flow_number(ratio: float, n: float) -> float:
    """Flow function with its critical clamp and check valve: K N of Eqs. 4.8-4.12 times sqrt(R)."""
    return 0.0 if ratio >= 1.0 else float(flow_function(max(ratio, critical_ratio(n)), n))


def spring_rates(
    pressure: float, height: float, rate: float, inlet: float, outlet: float, s: Spring, surface: AreaSurface
) -> tuple[float, float]:
    """Force, N, and pressure rate, Pa/s (Eqs. 4.22, 4.23 with gauge pressure)."""
    gauge = pressure - s.ambient
    force = gauge * area_of(height, gauge, s, surface) - s.damping * rate
    volume = s.volume_offset + s.mean_area * height
    theta = (pressure / s.reference) ** ((s.exponent - 1.0) / s.exponent)  # T2/T1, Eq. 4.17
    fill = inlet * s.supply * theta * flow_number(pressure / s.supply, s.exponent)
    empty = outlet * pressure * math.sqrt(theta) * flow_number(s.ambient / pressure, s.exponent)
    return force, s.exponent / volume * (s.gas_speed * (fill - empty) - pressure * s.mean_area * rate)


def air_spring_rates(car: Car, surface: AreaSurface | None = None) -> Rates:
    """State (3) z, z', P of a mass on one spring whose foot is the road; orifices (2), road (2,): height, rate."""
    area = surface or load_surface()

    def rates(x: Vector, u: Vector, road: Vector) -> Vector:
        force, pressure_rate = spring_rates(x[2], x[0] - road[0], x[1] - road[1], u[0], u[1], car.front, area)
        return np.array([x[1], force / car.sprung_mass - car.gravity, pressure_rate])

    return rates


def quarter_rates(car: Car, surface: AreaSurface | None = None) -> Rates:
    """State (5) sprung, unsprung, their rates, pressure; orifices (2), road (1,) (Eq. 4.55)."""
    area = surface or load_surface()

    def rates(x: Vector, u: Vector, road: Vector) -> Vector:
        force, pressure_rate = spring_rates(x[4], x[0] - x[1], x[2] - x[3], u[0], u[1], car.front, area)
        axle = (car.tyre_stiffness * (road[0] - x[1]) - force) / car.unsprung_mass - car.gravity
        return np.array([x[2], x[3], force / car.sprung_mass - car.gravity, axle, pressure_rate])

    return rates


def half_rates(car: Car, surface: AreaSurface | None = None) -> Rates:
    """State (10) of :mod:`pneumo_ros.plant.equations`; orifices (4), road (2,) (Eqs. 4.63-4.68)."""
    area = surface or load_surface()

    def rates(x: Vector, u: Vector, road: Vector) -> Vector:
        a, b = car.front_arm, car.rear_arm
        hf, hr = x[0] + a * x[1] - x[2], x[0] - b * x[1] - x[3]
        vf, vr = x[4] + a * x[5] - x[6], x[4] - b * x[5] - x[7]
        ff, pf = spring_rates(x[8], hf, vf, u[0], u[2], car.front, area)
        fr, pr = spring_rates(x[9], hr, vr, u[1], u[3], car.rear, area)
        k, m, g = car.tyre_stiffness, car.unsprung_mass, car.gravity
        return np.array([
            x[4], x[5], x[6], x[7],
            (ff + fr) / car.sprung_mass - g,
            (a * ff - b * fr) / car.inertia,
            (k * (road[0] - x[2]) - ff) / m - g,
            (k * (road[1] - x[3]) - fr) / m - g,
            pf, pr,
        ])  # fmt: skip

    return rates


def simulate(rates: Rates, x0: Vector, orifices: Vector, road: Vector, period: float) -> Vector:
    """RK4, one step a period: orifices (N, k) held, road (N + 1, m) linear between samples -> (N + 1, states)."""
    out = np.empty((len(orifices) + 1, len(x0)))
    out[0] = x = np.asarray(x0, dtype=float)
    for i, u in enumerate(orifices):
        middle = 0.5 * (road[i] + road[i + 1])
        k1 = rates(x, u, road[i])
        k2 = rates(x + 0.5 * period * k1, u, middle)
        k3 = rates(x + 0.5 * period * k2, u, middle)
        k4 = rates(x + period * k3, u, road[i + 1])
        x = x + period / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        out[i + 1] = x
    return out
