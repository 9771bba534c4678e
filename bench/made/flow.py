# SPDX-License-Identifier: Apache-2.0
"""What flows: tanks, a hydraulic cylinder, the heat of a plate."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from made.common import SLOTS, Columns, Made, levels, run, sampled, several
from pneumo_ros.arrays import Array

TANKS = (
    SLOTS
    + """
SLOTS = [
    Flow("rim", up=lambda x, u, p: x.upper, gas=False, unit="1/s", pressure_unit="1"),
    Flow("drain", up=lambda x, u, p: x.lower, flow=lambda x, u, p: p.k3 * math.sqrt(max(x.lower, 0.0)), gas=False,
         unit="1/s", pressure_unit="1"),
    Input("pump"),
    Sensor("lower"),
]


def rhs(x, u, p, f):
    upper, lower = math.sqrt(max(x.upper, 0.0)), math.sqrt(max(x.lower, 0.0))
    return p.k4 * u.pump - p.k1 * upper - f.rim, p.k2 * upper - p.k3 * lower - f.drain


def outputs(x, u, p, f):
    return x.upper, x.lower
"""
)
TANKS_NAMES = """
rig: two tanks
time: {field: t, unit: s}
channels: {upper: {unit: "1"}, lower: {unit: "1"}}
inputs: {pump: {unit: V}}
states: {upper: upper, lower: lower}
parameters: {k1: 0.053 +- 0.002, k2: 0.051 +- 0.002, k3: 0.061 +- 0.002, k4: 0.046 +- 0.0015}
"""


def tanks(rng: Generator) -> Columns:
    """A row every 4 s; what the upper tank spills, three tenths of it falls into the lower one."""
    t = np.arange(0.0, 4096.0, 4.0)
    pump = levels(rng, 4096.0, 64, 2.0, 5.2)

    def rates(time: float, y: Array) -> list[float]:
        upper, lower = np.sqrt(np.maximum(y, 0.0))
        spilt = max(0.0, y[0] - 8.0) * 0.05
        return [-0.055 * upper + 0.045 * pump(time) - spilt, 0.05 * upper - 0.06 * lower + 0.3 * spilt]

    upper, lower = run(rates, (3.0, 3.0), t, 2.0) + rng.normal(0.0, 0.01, (2, len(t)))
    return {"t": t, "upper": upper, "lower": lower, "pump": sampled(pump, t)}


HYDRAULIC = (
    SLOTS
    + """
SLOTS = [
    Flow("seal", up=lambda x, u, p: x.p, gas=False, unit="m3/s"),
    Force("rod", travel=lambda x, u, p: x.x, rate=lambda x, u, p: x.v),
    Input("flow"),
    Sensor("p"),
    Sensor("x"),
]


def rhs(x, u, p, f):
    pressure = p.bulk / p.volume * (u.flow - p.area * x.v - f.seal)
    return pressure, x.v, (p.area * x.p - p.damping * x.v - p.stiffness * x.x + f.rod) / p.mass


def outputs(x, u, p, f):
    return x.p, x.x
"""
)
HYDRAULIC_NAMES = """
rig: hydraulic cylinder
time: {field: t, unit: s}
channels: {p: {unit: bar}, x: {unit: mm}}
inputs: {flow: {unit: l/min}}
states: {p: p, x: x, v: rate of x}
parameters: {area: 1e-3 +- 1e-5 m2, volume: 2e-4 +- 1e-5 m3, bulk: 7e8 +- 5e7 Pa, mass: 30 +- 1 kg,
  damping: 800 +- 60 N s/m, stiffness: 2e5 +- 6e3 N/m}
"""


def hydraulic(rng: Generator) -> Columns:
    """A seal that leaks both laminar and through a hole."""
    t = np.arange(0.0, 10.0, 0.004)
    pump = several(rng, (2e-5, 1.5e-5, 1e-5), (0.5, 1.3, 2.7))

    def rates(time: float, y: Array) -> list[float]:
        leak = 3e-12 * y[0] + 1.2e-9 * np.sign(y[0]) * np.sqrt(abs(y[0]))
        return [3.5e12 * (pump(time) - 1e-3 * y[2] - leak), y[2], (1e-3 * y[0] - 800.0 * y[2] - 2e5 * y[1]) / 30.0]

    y = run(rates, (0.0, 0.0, 0.0), t, 5e-4)
    bars, millimetres = 1e-5 * (y[0] + rng.normal(0.0, 2e3, len(t))), 1e3 * (y[1] + rng.normal(0.0, 5e-6, len(t)))
    return {"t": t, "p": bars, "x": millimetres, "flow": 6e4 * sampled(pump, t)}


HEATER = (
    SLOTS
    + """
SLOTS = [
    Flow("case", up=lambda x, u, p: x.plate, down=lambda x, u, p: u.room, gas=False, unit="W", pressure_unit="K"),
    Input("power"),
    Sensor("plate"),
]


def rhs(x, u, p, f):
    return ((u.power - p.loss * (x.plate - u.room) - f.case) / p.capacity,)


def outputs(x, u, p, f):
    return (x.plate,)
"""
)
HEATER_NAMES = """
rig: heated plate
time: {field: t, unit: s}
channels: {plate: {unit: degC}}
inputs: {power: {unit: W}, room: {unit: degC}}
states: {plate: plate}
parameters: {capacity: 400 +- 20 J/K, loss: 0.6 +- 0.05 W/K}
"""


def heater(rng: Generator) -> Columns:
    """Radiation beside convection: a way out for heat, of another law."""
    t = np.arange(0.0, 7200.0, 5.0)
    power = levels(rng, 7200.0, 24, 10.0, 140.0)
    room = 21.0 + np.cumsum(rng.normal(0.0, 0.02, len(t)))

    def rates(time: float, y: Array) -> list[float]:
        around = float(np.interp(time, t, room))
        radiated = 5.67e-8 * 0.9 * 0.09 * ((y[0] + 273.15) ** 4 - (around + 273.15) ** 4)
        return [(power(time) - 0.6 * (y[0] - around) - radiated) / 400.0]

    plate = run(rates, (room[0],), t, 5.0)[0] + rng.normal(0.0, 0.1, len(t))
    return {"t": t, "plate": plate, "power": sampled(power, t), "room": room}


LEVEL = (
    SLOTS
    + """
SLOTS = [
    Flow("outlet", up=lambda x, u, p: x.level, flow=lambda x, u, p: p.drain * math.sqrt(max(x.level, 0.0)), gas=False,
         unit="m3/s", pressure_unit="m"),
    Input("valve"),
    Sensor("level"),
]


def rhs(x, u, p, f):
    return ((p.feed * u.valve - p.drain * math.sqrt(max(x.level, 0.0)) - f.outlet) / p.area,)


def outputs(x, u, p, f):
    return (x.level,)
"""
)
LEVEL_NAMES = """
rig: tank behind a valve
time: {field: t, unit: s}
channels: {level: {unit: m}}
inputs: {valve: {unit: "1"}}
states: {level: level}
parameters: {feed: 2e-4 +- 4e-6 m3/s, drain: 1e-4 +- 3e-6, area: 0.02 +- 4e-4 m2}
"""


def level(rng: Generator) -> Columns:
    """The valve's stem has play; what is logged is what it was told."""
    t = np.arange(0.0, 3000.0, 2.0)
    told = sampled(levels(rng, 3000.0, 70, 0.1, 0.9), t)
    stem = told.copy()
    for k in range(1, len(t)):
        stem[k] = min(max(stem[k - 1], told[k] - 0.06), told[k] + 0.06)

    def rates(time: float, y: Array) -> list[float]:
        return [(2e-4 * float(np.interp(time, t, stem)) - 1e-4 * np.sqrt(max(y[0], 0.0))) / 0.02]

    return {"t": t, "level": run(rates, (1.0,), t, 2.0)[0] + rng.normal(0.0, 3e-3, len(t)), "valve": told}


RIGS = {
    "tanks": Made(TANKS, TANKS_NAMES, tanks, frozenset({"relief"})),
    "hydraulic": Made(HYDRAULIC, HYDRAULIC_NAMES, hydraulic, frozenset({"leak"})),
    "heater": Made(HEATER, HEATER_NAMES, heater, frozenset({"leak"})),
    "level": Made(LEVEL, LEVEL_NAMES, level, frozenset({"backlash"})),
}
