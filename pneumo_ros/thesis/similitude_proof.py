# SPDX-License-Identifier: Apache-2.0
"""Similitude tried out: full scale, rig and Pi-numbers simulated side by side, with all laws kept or one broken."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig
from pneumo_ros.thesis.half import conventional_car
from pneumo_ros.thesis.models import dimensionless, similar_systems
from pneumo_ros.thesis.models.conventional import Conventional, simulate_conventional
from pneumo_ros.thesis.models.similar_systems import Car, Rates, Vector, full_scale, rig_car, simulate
from pneumo_ros.thesis.models.similitude import Scales
from pneumo_ros.units import INCH, SQUARE_INCH

HEIGHT, AREA, ORIFICE = 1.8 * INCH, 1.6 * SQUARE_INCH, 0.025 * SQUARE_INCH  # h, A_eff and A of Section 4.3
FREQUENCY = 22.0  # rad/s, w: 3.5 Hz of Table 4.2
PERIOD, COUNT = 1e-3, 1500  # s and periods of the rig's run
CONVENTIONAL_STATES = ("length", "angle", "length", "length", "velocity", "frequency", "velocity", "velocity")
SYSTEMS = ("conventional half car", "air spring", "quarter car", "half car")

# What each law scales, and how it is broken: by ten per cent at full scale, or by leaving it as nature has it.
Break = Callable[[Car, Car], Car]
BROKEN: dict[str, Break] = {
    "mass": lambda full, rig: full._replace(sprung_mass=1.1 * full.sprung_mass),
    "pressure": lambda full, rig: full._replace(
        front=full.front._replace(supply=1.1 * full.front.supply),
        rear=full.rear._replace(supply=1.1 * full.rear.supply),
    ),
    "temperature": lambda full, rig: full._replace(
        front=full.front._replace(gas_speed=1.1 * full.front.gas_speed),
        rear=full.rear._replace(gas_speed=1.1 * full.rear.gas_speed),
    ),
    "damping": lambda full, rig: full._replace(
        front=full.front._replace(damping=1.1 * full.front.damping),
        rear=full.rear._replace(damping=1.1 * full.rear.damping),
    ),
    "gravity not scaled": lambda full, rig: full._replace(gravity=rig.gravity),
    "atmosphere not scaled": lambda full, rig: full._replace(
        front=full.front._replace(ambient=rig.front.ambient), rear=full.rear._replace(ambient=rig.rear.ambient)
    ),
}


@dataclass(frozen=True)
class Setup:
    """One pneumatic system at rig scale.

    Attributes
    ----------
    car : with the mass this system carries
    rates, dimensionless : right-hand sides for a car of any scale, and for Pi-numbers with A_eff in table units
    start, orifices, road : state, openings (N, k), m2, and road (N + 1, m)
    states, roads : the quantity of each state and road column
    """

    car: Car
    rates: Callable[[Car], Rates]
    dimensionless: Callable[[dimensionless.CarPi, float], Rates]
    start: Vector
    orifices: Vector
    road: Vector
    states: tuple[str, ...]
    roads: tuple[str, ...]


def setup(system: str) -> Setup:
    """A pneumatic system of :data:`SYSTEMS` over a bumpy road, with the inlets opening to three times trim halfway."""
    _, at_rest = nominal_half_car(load_rig())
    car, state = rig_car(*at_rest.pressures), at_rest.state
    t = np.arange(COUNT + 1) * PERIOD
    bump = 4e-3 * np.sin(2 * np.pi * 3.0 * t) ** 2
    valves = np.tile(at_rest.command, (COUNT, 1))
    valves[COUNT // 2 :, :2] *= 3.0
    if system == "half car":
        kinds: tuple[str, ...] = (*CONVENTIONAL_STATES, "pressure", "pressure")
        road = np.column_stack([bump, np.roll(bump, 114)])
        return Setup(
            car, similar_systems.half_rates, dimensionless.half_rates, state, valves, road, kinds, ("length",) * 2
        )
    share = car.rear_arm / (car.front_arm + car.rear_arm)
    car, valves = car._replace(sprung_mass=share * car.sprung_mass), valves[:, [0, 2]]
    if system == "quarter car":
        start = np.array([state[2] + HEIGHT, state[2], 0.0, 0.0, state[8]])
        kinds = ("length", "length", "velocity", "velocity", "pressure")
        return Setup(
            car,
            similar_systems.quarter_rates,
            dimensionless.quarter_rates,
            start,
            valves,
            bump[:, None],
            kinds,
            ("length",),
        )
    start, road = np.array([HEIGHT, 0.0, state[8]]), np.column_stack([bump, np.gradient(bump, PERIOD)])
    return Setup(
        car,
        similar_systems.air_spring_rates,
        dimensionless.air_spring_rates,
        start,
        valves,
        road,
        ("length", "velocity", "pressure"),
        ("length", "velocity"),
    )


def difference(system: str, scales: Scales, broken: str | None = None) -> tuple[float, float]:
    """Largest differences from the rig, in standard deviations of each state: of the full-scale run brought down, and
    of the dimensionless run of the full-scale car's Pi-numbers. ``broken`` names a law of :data:`BROKEN`."""
    if system == "conventional half car":
        return _conventional_difference(scales, broken)
    s = setup(system)
    full = full_scale(s.car, scales)
    if broken is not None:
        full = BROKEN[broken](full, s.car)
    units = np.array([scales.factor(kind) for kind in s.states])
    road_units = np.array([scales.factor(kind) for kind in s.roads])
    ours = simulate(s.rates(s.car), s.start, s.orifices, s.road, PERIOD)
    large = simulate(
        s.rates(full), s.start * units, s.orifices * scales.orifice_area, s.road * road_units, PERIOD * scales.time
    )
    pi_units = _pi_units(s.states, s.car)
    numbers = dimensionless.car_pi(
        full,
        HEIGHT * scales.length,
        AREA * scales.factor("area"),
        ORIFICE * scales.orifice_area,
        FREQUENCY / scales.time,
    )
    small = simulate(
        s.dimensionless(numbers, AREA),
        s.start / pi_units,
        s.orifices / ORIFICE,
        s.road / _pi_units(s.roads, s.car),
        PERIOD * FREQUENCY,
    )
    spread = ours.std(axis=0)
    return float(np.max(np.abs(large / units - ours) / spread)), float(np.max(np.abs(small * pi_units - ours) / spread))


def _pi_units(kinds: tuple[str, ...], car: Car) -> Vector:
    """What makes each state dimensionless: h, h w, w, P1."""
    unit = {
        "length": HEIGHT,
        "angle": 1.0,
        "velocity": HEIGHT * FREQUENCY,
        "frequency": FREQUENCY,
        "pressure": car.front.supply,
    }
    return np.array([unit[kind] for kind in kinds])


def scaled_conventional(car: Conventional, scales: Scales) -> Conventional:
    """A conventional half car brought to full scale by the laws."""
    quantities = ("mass", "inertia", "length", "length", "mass", "mass", "stiffness", "stiffness", "damping", "damping",
                  "stiffness", "stiffness", "damping", "damping")  # fmt: skip
    return Conventional(*(value * scales.factor(kind) for value, kind in zip(car, quantities, strict=True)))


def _conventional_difference(scales: Scales, broken: str | None) -> tuple[float, float]:
    car = conventional_car(skyhook=False)
    full = scaled_conventional(car, scales)
    if broken == "damping":
        full = full._replace(damping_front=1.1 * full.damping_front, damping_rear=1.1 * full.damping_rear)
    elif broken == "mass":
        full = full._replace(sprung_mass=1.1 * full.sprung_mass)
    t = np.arange(COUNT + 1) * PERIOD
    bump = 4e-3 * np.sin(2 * np.pi * 3.0 * t) ** 2
    road = np.column_stack([bump, np.roll(bump, 114)])
    kinds = CONVENTIONAL_STATES
    units = np.array([scales.factor(kind) for kind in kinds])
    ours = simulate_conventional(np.zeros(8), road, PERIOD, 1, car)
    large = simulate_conventional(np.zeros(8), road * scales.length, PERIOD * scales.time, 1, full)
    numbers = dimensionless.conventional_pi(full, HEIGHT * scales.length, FREQUENCY / scales.time)
    small = simulate(
        dimensionless.conventional_rates(numbers), np.zeros(8), np.zeros((COUNT, 1)), road / HEIGHT, PERIOD * FREQUENCY
    )
    unit = {"length": HEIGHT, "angle": 1.0, "velocity": HEIGHT * FREQUENCY, "frequency": FREQUENCY}
    back = np.array([unit[kind] for kind in kinds])
    spread = ours.std(axis=0)
    return float(np.max(np.abs(large / units - ours) / spread)), float(np.max(np.abs(small * back - ours) / spread))


def laws_of(system: str) -> tuple[str, ...]:
    """Names of the laws that can be broken for a system."""
    return ("mass", "damping") if system == "conventional half car" else tuple(BROKEN)
