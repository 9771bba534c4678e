# SPDX-License-Identifier: Apache-2.0
"""Rigs made by scipy's integrators with effects by laws of their own: does the diagnosis name what is missing?

    python bench/made_rigs.py [--seeds 1 2 3] [--only sledge silverbox]

Each rig is a model of one's own (rig.py, rig.yaml as a user writes them) and two logs, one held out, made by another
program: a sledge on a guide, an oscillator at 68 Hz whose spring hardens (after Wigren and Schoukens's Silverbox), a
joint with Bouc-Wen hysteresis (after Noel and Schoukens), two tanks that overflow (after Schoukens et al.), a speed
whose sensor has lost its sign, a heated plate, a motor, a quarter car, valves, stops, sensors and actuators. One line a
log, then the counts; ``part`` names some of what is there.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.random import Generator
from scipy.integrate import solve_ivp

from pneumo_ros.arrays import Array
from pneumo_ros.errors import PneumoError
from pneumo_ros.own_rig.from_files import prepared

Columns = dict[str, Array]
SLOTS = "import math\n\nfrom pneumo_ros.own_rig import Contact, Flow, Force, Input, Sensor\n\n"


@dataclass(frozen=True)
class Made:
    """A rig.

    Attributes
    ----------
    physics, names : rig.py and rig.yaml
    log : random numbers -> columns of a log, ``t`` first
    families : what is missing in the model; empty: nothing; ``unknown``: what no family is
    """

    physics: str
    names: str
    log: Callable[[Generator], Columns]
    families: frozenset[str]


def several(rng: Generator, sizes: Sequence[float], hertz: Sequence[float]) -> Callable[[float], float]:
    """Sines of random phases."""
    phases = rng.uniform(0.0, 2.0 * np.pi, len(hertz))
    return lambda t: float(np.sum(np.array(sizes) * np.sin(2.0 * np.pi * np.array(hertz) * t + phases)))


def levels(rng: Generator, length: float, count: int, low: float, high: float) -> Callable[[float], float]:
    """Random levels joined by straight lines."""
    at, values = np.linspace(0.0, length, count), rng.uniform(low, high, count)
    return lambda t: float(np.interp(t, at, values))


def run(rates: Callable[[float, Array], list[float]], start: Sequence[float], t: Array, step: float) -> Array:
    """(states, N)."""
    return np.asarray(solve_ivp(rates, (t[0], t[-1]), start, t_eval=t, max_step=step, rtol=1e-7, atol=1e-9).y)


def beyond(value: float, zone: float) -> float:
    """What of a value is outside a dead zone."""
    return float(np.sign(value) * max(abs(value) - zone, 0.0))


# -- a mass on a rail, driven by an actuator: nine rigs of one model --------------------------------------------------

MASS = (
    SLOTS
    + """
SLOTS = [Force("rail", travel=lambda x, u, p: x.x, rate=lambda x, u, p: x.v), Input("u"), Sensor("x")]


def rhs(x, u, p, f):
    return x.v, (p.gain * u.u - p.damping * x.v - p.stiffness * x.x + f.rail) / p.mass


def outputs(x, u, p, f):
    return (x.x,)
"""
)
MASS_NAMES = """
rig: mass on a rail
time: {field: t, unit: s}
channels: {x: {unit: m}}
inputs: {u: {unit: V}}
states: {x: x, v: rate of x}
parameters: {mass: 1 +- 0.03 kg, damping: 3 +- 0.3 N s/m, stiffness: 20 +- 1 N/m, gain: 10 +- 0.3 N/V}
"""


def mass(
    families: Sequence[str],
    force: Callable[[float, float], float] = lambda x, v: 0.0,
    actuator: Callable[[float], float] = lambda u: u,
    late: float = 0.0,
    reading: Callable[[Array], Array] = lambda x: x,
) -> Made:
    """The mass with a force (x, v), an actuator, a delay of it in s, and a sensor."""

    def log(rng: Generator) -> Columns:
        t = np.arange(0.0, 20.0, 0.01)
        drive = several(rng, (2.0, 1.5, 1.0), (0.2, 0.53, 1.1))

        def rates(time: float, y: Array) -> list[float]:
            pull = 10.0 * actuator(drive(time - late)) - 3.0 * y[1] - 20.0 * y[0] - force(y[0], y[1])
            return [y[1], pull / 1.02]

        x = run(rates, (0.0, 0.0), t, 2e-3)[0]
        return {"t": t, "x": reading(x) + rng.normal(0.0, 5e-4, len(t)), "u": np.array([drive(one) for one in t])}

    return Made(MASS, MASS_NAMES, log, frozenset(families))


def slow_amplifier(rng: Generator) -> Columns:
    """A lag of 20 ms that cannot be faster than 8 V/s."""
    t = np.arange(0.0, 20.0, 0.01)
    drive = several(rng, (2.0, 1.6, 1.2), (0.2, 0.53, 1.1))

    def rates(time: float, y: Array) -> list[float]:
        pull = 10.0 * y[2] - 3.0 * y[1] - 20.0 * y[0]
        return [y[1], pull / 1.02, float(np.clip((drive(time) - y[2]) / 0.02, -8.0, 8.0))]

    x = run(rates, (0.0, 0.0, drive(0.0)), t, 2e-3)[0]
    return {"t": t, "x": x + rng.normal(0.0, 5e-4, len(t)), "u": np.array([drive(one) for one in t])}


# -- the others ------------------------------------------------------------------------------------------------------

SLEDGE = (
    SLOTS
    + """
SLOTS = [Force("guide", travel=lambda x, u, p: x.q, rate=lambda x, u, p: x.v), Input("force"), Sensor("q")]


def rhs(x, u, p, f):
    return x.v, (u.force - p.damping * x.v + f.guide) / p.mass


def outputs(x, u, p, f):
    return (x.q,)
"""
)
SLEDGE_NAMES = """
rig: sledge
time: {field: t, unit: s}
channels: {q: {unit: m}}
inputs: {force: {unit: N}}
states: {q: q, v: rate of q}
parameters: {mass: 95 +- 3 kg, damping: 200 +- 20 N s/m}
"""


def sledge(rng: Generator) -> Columns:
    """Held on its course by a loop; friction, and a constant force beside it. No spring: a free run drifts."""
    t = np.arange(0.0, 20.0, 0.005)
    course = several(rng, (0.06, 0.03), (0.25, 0.6))

    def force(time: float, y: Array) -> float:
        return float(np.clip(3200.0 * (course(time) - y[0]) - 1944.0 * y[1], -150.0, 150.0))

    def rates(time: float, y: Array) -> list[float]:
        return [y[1], (force(time, y) - 20.0 * np.tanh(y[1] / 5e-4) - 3.2 - 203.0 * y[1]) / 96.0]

    y = run(rates, (0.0, 0.0), t, 1e-3)
    told = np.array([force(time, state) for time, state in zip(t, y.T, strict=True)])
    return {"t": t, "q": y[0] + rng.normal(0.0, 2e-6, len(t)), "force": told}


SILVERBOX = (
    SLOTS
    + """
SLOTS = [
    Force("spring", travel=lambda x, u, p: x.y, rate=lambda x, u, p: x.v, unit="V/s2", travel_unit="V"),
    Input("u"),
    Sensor("y"),
]


def rhs(x, u, p, f):
    return x.v, p.w * p.w * (p.gain * u.u - x.y) - 2.0 * p.zeta * p.w * x.v + f.spring


def outputs(x, u, p, f):
    return (x.y,)
"""
)
SILVERBOX_NAMES = """
rig: hardening oscillator
time: {field: t, unit: s}
channels: {y: {unit: V}}
inputs: {u: {unit: V}}
states: {y: y, v: rate of y}
parameters: {w: 425 +- 5 rad/s, zeta: 0.05 +- 0.01, gain: 1 +- 0.02}
"""


def silverbox(rng: Generator) -> Columns:
    """More than 500 periods, after which a free run by the nominal model is out of step."""
    t = np.arange(0.0, 8.0, 1.0 / 610.0)
    drive = several(rng, np.full(12, 0.012), rng.uniform(5.0, 120.0, 12))
    w = 2.0 * np.pi * 68.0

    def rates(time: float, y: Array) -> list[float]:
        return [y[1], w * w * (drive(time) - y[0] - 30.0 * y[0] ** 3) - 0.1 * w * y[1]]

    y = run(rates, (0.0, 0.0), t, 2e-4)[0]
    return {"t": t, "y": y + rng.normal(0.0, 3e-4, len(t)), "u": np.array([drive(one) for one in t])}


JOINT = (
    SLOTS
    + """
SLOTS = [Force("joint", travel=lambda x, u, p: x.y, rate=lambda x, u, p: x.v), Input("force"), Sensor("y")]


def rhs(x, u, p, f):
    return x.v, (u.force - p.stiffness * x.y - p.damping * x.v + f.joint) / p.mass


def outputs(x, u, p, f):
    return (x.y,)
"""
)
JOINT_NAMES = """
rig: hysteretic joint
time: {field: t, unit: s}
channels: {y: {unit: m}}
inputs: {force: {unit: N}}
states: {y: y, v: rate of y}
parameters: {mass: 2 +- 0.05 kg, damping: 10 +- 2 N s/m, stiffness: 5e4 +- 3e3 N/m}
"""


def bouc_wen(rng: Generator) -> Columns:
    """alpha 5e4 N/m, beta 1000, gamma 0.8, delta -1.1: hysteresis whose force grows on."""
    t = np.arange(0.0, 8.0, 1.0 / 750.0)
    drive = several(rng, np.full(10, 30.0), rng.uniform(5.0, 80.0, 10))

    def rates(time: float, y: Array) -> list[float]:
        v, z = y[1], y[2]
        turned = 5e4 * v - 1e3 * (0.8 * abs(v) * z - 1.1 * v * abs(z))
        return [v, (drive(time) - 5e4 * y[0] - 10.0 * v - z) / 2.0, turned]

    y = run(rates, (0.0, 0.0, 0.0), t, 3e-4)[0]
    return {"t": t, "y": y + rng.normal(0.0, 8e-6, len(t)), "force": np.array([drive(one) for one in t])}


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
    return {"t": t, "upper": upper, "lower": lower, "pump": np.array([pump(one) for one in t])}


DRIVES = (
    SLOTS
    + """
SLOTS = [
    Force("belt", travel=lambda x, u, p: x.w, rate=lambda x, u, p: x.a, unit="V/s2", travel_unit="V"),
    Input("u"),
    Sensor("w"),
]


def rhs(x, u, p, f):
    return x.a, -p.k * x.w - p.c * x.a + p.k * p.gain * u.u + f.belt


def outputs(x, u, p, f):
    return (x.w,)
"""
)
DRIVES_NAMES = """
rig: belt drive
time: {field: t, unit: s}
channels: {w: {unit: V}}
inputs: {u: {unit: V}}
states: {w: w, a: rate of w}
parameters: {k: 40 +- 2, c: 2.5 +- 0.3, gain: 1.3 +- 0.05}
"""


def drives(rng: Generator) -> Columns:
    """The sensor has no sign: no family is that."""
    t = np.arange(0.0, 20.0, 0.02)
    drive = several(rng, (1.0, 0.8, 0.5), (0.21, 0.5, 0.93))
    y = run(lambda time, y: [y[1], -40.0 * y[0] - 2.5 * y[1] + 52.0 * drive(time)], (0.0, 0.0), t, 5e-3)[0]
    return {"t": t, "w": np.abs(y) + rng.normal(0.0, 0.005, len(t)), "u": np.array([drive(one) for one in t])}


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
    return {"t": t, "p": bars, "x": millimetres, "flow": 6e4 * np.array([pump(one) for one in t])}


PENDULUM = (
    SLOTS
    + """
SLOTS = [
    Force("joint", travel=lambda x, u, p: x.angle, rate=lambda x, u, p: x.rate, unit="N m", travel_unit="rad"),
    Input("torque"),
    Sensor("angle"),
]


def rhs(x, u, p, f):
    weight = p.mass * 9.81 * p.length * math.sin(x.angle)
    return x.rate, (u.torque - p.damping * x.rate - weight + f.joint) / (p.mass * p.length * p.length)


def outputs(x, u, p, f):
    return (x.angle,)
"""
)
PENDULUM_NAMES = """
rig: pendulum
time: {field: t, unit: s}
channels: {angle: {unit: deg}}
inputs: {torque: {unit: N m}}
states: {angle: angle, rate: rate of angle}
parameters: {damping: 0.1 +- 0.02 N m s/rad, mass: 0.5 +- 0.01 kg, length: 0.6 +- 0.005 m}
"""


def pendulum(rng: Generator) -> Columns:
    """Friction that is larger from rest."""
    t = np.arange(0.0, 25.0, 0.01)
    drive = several(rng, (1.2, 0.7), (0.3, 0.8))

    def rates(time: float, y: Array) -> list[float]:
        rub = 0.22 * np.tanh(y[1] / 1e-2) * (1.0 + 0.6 * np.exp(-((y[1] / 0.1) ** 2)))
        return [y[1], (drive(time) - 0.1 * y[1] - 2.943 * np.sin(y[0]) - rub) / 0.18]

    angle = np.degrees(run(rates, (0.0, 0.0), t, 4e-3)[0])
    return {"t": t, "angle": angle + rng.normal(0.0, 0.05, len(t)), "torque": np.array([drive(one) for one in t])}


BUSH = (
    SLOTS
    + """
SLOTS = [
    Force("bush", travel=lambda x, u, p: x.a - x.b, rate=lambda x, u, p: x.va - x.vb),
    Force("ground", travel=lambda x, u, p: x.b, rate=lambda x, u, p: x.vb),
    Input("force"),
    Sensor("a"),
    Sensor("b"),
]


def rhs(x, u, p, f):
    between = p.k * (x.a - x.b) + p.c * (x.va - x.vb) - f.bush
    first = (u.force - between - 400.0 * x.a - 4.0 * x.va) / p.first
    return x.va, x.vb, first, (between - 6.0 * x.vb - 800.0 * x.b + f.ground) / p.second


def outputs(x, u, p, f):
    return x.a, x.b
"""
)
BUSH_NAMES = """
rig: two masses and a bush
time: {field: t, unit: s}
channels: {a: {unit: m}, b: {unit: m}}
inputs: {force: {unit: N}}
states: {a: a, b: b, va: rate of a, vb: rate of b}
parameters: {k: 2050 +- 80 N/m, c: 15 +- 2 N s/m, first: 1 +- 0.02 kg, second: 2 +- 0.04 kg}
"""


def bush(rng: Generator) -> Columns:
    """A second spring behind a dashpot: its force fades in 0.12 s. The gap is 3 % of the signals."""
    t = np.arange(0.0, 20.0, 0.005)
    drive = several(rng, (20.0, 12.0, 8.0), (0.7, 1.9, 4.1))

    def rates(time: float, y: Array) -> list[float]:
        d = y[0] - y[1]
        between = 2000.0 * d + 15.0 * (y[2] - y[3]) + 900.0 * (d - y[4])
        first = drive(time) - between - 400.0 * y[0] - 4.0 * y[2]
        return [y[2], y[3], first, (between - 6.0 * y[3] - 800.0 * y[1]) / 2.0, (d - y[4]) / 0.12]

    a, b = run(rates, np.zeros(5), t, 2e-3)[:2] + rng.normal(0.0, 1e-5, (2, len(t)))
    return {"t": t, "a": a, "b": b, "force": np.array([drive(one) for one in t])}


BOAT = (
    SLOTS
    + """
SLOTS = [Force("hull", rate=lambda x, u, p: x.v), Input("thrust"), Sensor("v")]


def rhs(x, u, p, f):
    return ((u.thrust - p.drag * x.v + f.hull) / p.mass,)


def outputs(x, u, p, f):
    return (x.v,)
"""
)
BOAT_NAMES = """
rig: boat
time: {field: t, unit: s}
channels: {v: {unit: m/s}}
inputs: {thrust: {unit: N}}
states: {v: v}
parameters: {drag: 4 +- 1 N s/m, mass: 12 +- 0.4 kg}
"""


def boat(rng: Generator) -> Columns:
    """Drag with the square of the speed."""
    t = np.arange(0.0, 60.0, 0.05)
    drive = several(rng, (8.0, 6.0, 4.0), (0.03, 0.09, 0.2))
    v = run(lambda time, y: [(drive(time) - 2.0 * y[0] - 6.0 * y[0] * abs(y[0])) / 12.0], (0.0,), t, 0.05)[0]
    return {"t": t, "v": v + rng.normal(0.0, 0.004, len(t)), "thrust": np.array([drive(one) for one in t])}


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
    return {"t": t, "plate": plate, "power": np.array([power(one) for one in t]), "room": room}


MOTOR = (
    SLOTS
    + """
SLOTS = [
    Force("bearing", travel=lambda x, u, p: x.angle, rate=lambda x, u, p: x.speed, unit="N m", travel_unit="rad"),
    Input("voltage"),
    Sensor("current"),
    Sensor("speed"),
]


def rhs(x, u, p, f):
    current = (u.voltage - p.resistance * x.current - p.constant * x.speed) / p.inductance
    return current, (p.constant * x.current - p.damping * x.speed + f.bearing) / p.inertia, x.speed


def outputs(x, u, p, f):
    return x.current, x.speed
"""
)
MOTOR_NAMES = """
rig: motor
time: {field: t, unit: s}
channels: {current: {unit: A}, speed: {unit: rpm}}
inputs: {voltage: {unit: V}}
states: {current: current, speed: speed, angle: 0}
parameters: {resistance: 1.2 +- 0.08 ohm, constant: 0.05 +- 0.001 N m/A, inductance: 2e-3 +- 2e-4 H,
  inertia: 1e-4 +- 5e-6 kg m2, damping: 2e-5 +- 5e-6 N m s/rad}
"""


def motor(rng: Generator) -> Columns:
    """Friction that is larger from rest; the current's sensor reads 6 % too much."""
    t = np.arange(0.0, 12.0, 0.002)
    drive = several(rng, (6.0, 4.0, 2.5), (0.4, 1.3, 3.1))

    def rates(time: float, y: Array) -> list[float]:
        rub = (0.012 + 0.008 * np.exp(-((y[1] / 4.0) ** 2))) * np.tanh(y[1] / 0.3)
        return [(drive(time) - 1.2 * y[0] - 0.05 * y[1]) / 2e-3, (0.05 * y[0] - 2e-5 * y[1] - rub) / 1e-4]

    current, speed = run(rates, (0.0, 0.0), t, 5e-4)
    shown, turns = 1.06 * current + rng.normal(0.0, 0.01, len(t)), 30.0 / np.pi * speed + rng.normal(0.0, 1.0, len(t))
    return {"t": t, "current": shown, "speed": turns, "voltage": np.array([drive(one) for one in t])}


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
    told = np.array([levels(rng, 3000.0, 70, 0.1, 0.9)(one) for one in t])
    stem = told.copy()
    for k in range(1, len(t)):
        stem[k] = min(max(stem[k - 1], told[k] - 0.06), told[k] + 0.06)

    def rates(time: float, y: Array) -> list[float]:
        return [(2e-4 * float(np.interp(time, t, stem)) - 1e-4 * np.sqrt(max(y[0], 0.0))) / 0.02]

    return {"t": t, "level": run(rates, (1.0,), t, 2.0)[0] + rng.normal(0.0, 3e-3, len(t)), "valve": told}


QUARTER = (
    SLOTS
    + """
SLOTS = [
    Force("strut", travel=lambda x, u, p: x.body - x.wheel, rate=lambda x, u, p: x.vb - x.vw),
    Contact("tyre", travel=lambda x, u, p: x.wheel - u.road, rate=lambda x, u, p: x.vw,
            load=lambda x, u, p: 9.81 * (p.sprung + p.unsprung) - p.kt * (x.wheel - u.road)),
    Input("road"),
    Sensor("body"),
    Sensor("wheel"),
]


def rhs(x, u, p, f):
    strut = -p.k * (x.body - x.wheel) - p.c * (x.vb - x.vw) + f.strut
    return x.vb, x.vw, strut / p.sprung, (-strut - p.kt * (x.wheel - u.road) + f.tyre) / p.unsprung


def outputs(x, u, p, f):
    return x.body, x.wheel
"""
)
QUARTER_NAMES = """
rig: quarter car
time: {field: t, unit: s}
channels: {body: {unit: mm}, wheel: {unit: mm}}
inputs: {road: {unit: mm}}
states: {body: body, wheel: wheel, vb: rate of body, vw: rate of wheel}
parameters: {k: 16000 +- 600 N/m, c: 1000 +- 60 N s/m, kt: 160000 +- 6000 N/m, sprung: 250 +- 5 kg,
  unsprung: 35 +- 1 kg}
"""


def quarter(family: str, damper: Callable[[float], float]) -> Made:
    """A passenger car's quarter with a damper by force (rate) of its own."""

    def log(rng: Generator) -> Columns:
        t = np.arange(0.0, 16.0, 0.004)
        road = several(rng, (0.02, 0.012, 0.006, 0.003), (0.7, 1.6, 4.0, 9.5))

        def rates(time: float, y: Array) -> list[float]:
            strut = -16000.0 * (y[0] - y[1]) - damper(y[2] - y[3])
            return [y[2], y[3], strut / 250.0, (-strut - 160000.0 * (y[1] - road(time))) / 35.0]

        body, wheel = 1e3 * run(rates, np.zeros(4), t, 1e-3)[:2] + rng.normal(0.0, 0.05, (2, len(t)))
        return {"t": t, "body": body, "wheel": wheel, "road": 1e3 * np.array([road(one) for one in t])}

    return Made(QUARTER, QUARTER_NAMES, log, frozenset({family}))


RIGS = {
    "nothing": mass(()),
    "dead zone": mass(("dead_zone",), actuator=lambda u: beyond(u, 0.9)),
    "friction, late": mass(("coulomb_friction", "delay"), lambda x, v: 4.0 * np.tanh(v / 5e-3), late=0.06),
    "stop": mass(("stop",), lambda x, v: 4000.0 * (x - 1.1) + 60.0 * v if x > 1.1 else 0.0),
    "clipped sensor": mass(("saturation",), reading=lambda x: np.clip(x, -1.0, 1.0)),
    "soft amplifier": mass(("saturation",), actuator=lambda u: float(2.2 * np.tanh(u / 2.2))),
    "friction, dead zone": mass(
        ("coulomb_friction", "dead_zone"), lambda x, v: 3.5 * np.tanh(v / 5e-3), lambda u: beyond(u, 0.4)
    ),
    "slow amplifier": Made(MASS, MASS_NAMES, slow_amplifier, frozenset({"lag"})),
    "sledge": Made(SLEDGE, SLEDGE_NAMES, sledge, frozenset({"coulomb_friction"})),
    "silverbox": Made(SILVERBOX, SILVERBOX_NAMES, silverbox, frozenset({"spring_error"})),
    "bouc-wen": Made(JOINT, JOINT_NAMES, bouc_wen, frozenset({"hysteresis"})),
    "tanks": Made(TANKS, TANKS_NAMES, tanks, frozenset({"relief"})),
    "drives": Made(DRIVES, DRIVES_NAMES, drives, frozenset({"unknown"})),
    "hydraulic": Made(HYDRAULIC, HYDRAULIC_NAMES, hydraulic, frozenset({"leak"})),
    "pendulum": Made(PENDULUM, PENDULUM_NAMES, pendulum, frozenset({"coulomb_friction"})),
    "bush": Made(BUSH, BUSH_NAMES, bush, frozenset({"relaxation"})),
    "boat": Made(BOAT, BOAT_NAMES, boat, frozenset({"viscous_damping"})),
    "heater": Made(HEATER, HEATER_NAMES, heater, frozenset({"leak"})),
    "motor": Made(MOTOR, MOTOR_NAMES, motor, frozenset({"coulomb_friction", "scale"})),
    "level": Made(LEVEL, LEVEL_NAMES, level, frozenset({"backlash"})),
    "uneven damper": quarter("viscous_damping", lambda v: (1600.0 if v > 0.0 else 700.0) * v),
    "degressive damper": quarter("viscous_damping", lambda v: 1000.0 * v + 500.0 * float(np.tanh(v / 0.15))),
    "bush that rubs": quarter("coulomb_friction", lambda v: 1000.0 * v + 90.0 * float(np.tanh(v / 2e-3))),
}


def main() -> int:
    """Make and diagnose; the counts say how many were named as they were made."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--only", nargs="+", choices=sorted(RIGS), default=list(RIGS))
    asked = parser.parse_args()
    found = [diagnosed(name, seed) for name in asked.only for seed in asked.seeds]
    print(f"named as made {found.count('right')} of {len(found)}, in part {found.count('part')}")
    return 0


def diagnosed(name: str, seed: int) -> str:
    """``right``, ``part`` or ``wrong``; one line is printed."""
    rig, started = RIGS[name], time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "rig.py"
        model.write_text(rig.physics, encoding="utf-8")
        model.with_suffix(".yaml").write_text(rig.names, encoding="utf-8")
        logs = [written(rig, np.random.default_rng(1000 * seed + k), Path(folder) / f"{k}.csv") for k in range(2)]
        try:
            one = prepared(model, logs[:1], logs[1]).diagnose()
        except PneumoError as error:
            print(f"{name:20} {seed:2} {error}", flush=True)
            return "wrong"
    told, there = set(one.verdict.split("+")), set(rig.families or {"none"})
    verdict = "right" if told == there else "part" if told & there else "wrong"
    print(f"{name:20} {seed:2} {verdict:5} {one.verdict:40} {one.probability:.2f}  gap {one.gap.refit:.4f} -> "
          f"{one.gap.best:.4f}  {time.perf_counter() - started:3.0f} s", flush=True)  # fmt: skip
    return verdict


def written(rig: Made, rng: Generator, path: Path) -> Path:
    """A log as CSV."""
    columns = rig.log(rng)
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, "%.9g", ",", header=",".join(columns), comments="")
    return path


if __name__ == "__main__":
    sys.exit(main())
