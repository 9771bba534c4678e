# SPDX-License-Identifier: Apache-2.0
"""Machines that move, after published benchmarks (sledge, oscillator, joint, drives) and others."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from made.common import SLOTS, Columns, Made, run, sampled, several
from pneumo_ros.arrays import Array

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
    return {"t": t, "y": y + rng.normal(0.0, 3e-4, len(t)), "u": sampled(drive, t)}


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
    return {"t": t, "y": y + rng.normal(0.0, 8e-6, len(t)), "force": sampled(drive, t)}


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
    return {"t": t, "w": np.abs(y) + rng.normal(0.0, 0.005, len(t)), "u": sampled(drive, t)}


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
    return {"t": t, "angle": angle + rng.normal(0.0, 0.05, len(t)), "torque": sampled(drive, t)}


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
    return {"t": t, "a": a, "b": b, "force": sampled(drive, t)}


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
    return {"t": t, "v": v + rng.normal(0.0, 0.004, len(t)), "thrust": sampled(drive, t)}


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
    return {"t": t, "current": shown, "speed": turns, "voltage": sampled(drive, t)}


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
        return {"t": t, "body": body, "wheel": wheel, "road": 1e3 * sampled(road, t)}

    return Made(QUARTER, QUARTER_NAMES, log, frozenset({family}))


RIGS = {
    "sledge": Made(SLEDGE, SLEDGE_NAMES, sledge, frozenset({"coulomb_friction"})),
    "silverbox": Made(SILVERBOX, SILVERBOX_NAMES, silverbox, frozenset({"spring_error"})),
    "bouc-wen": Made(JOINT, JOINT_NAMES, bouc_wen, frozenset({"hysteresis"})),
    "drives": Made(DRIVES, DRIVES_NAMES, drives, frozenset({"unknown"})),
    "pendulum": Made(PENDULUM, PENDULUM_NAMES, pendulum, frozenset({"coulomb_friction"})),
    "bush": Made(BUSH, BUSH_NAMES, bush, frozenset({"relaxation"})),
    "boat": Made(BOAT, BOAT_NAMES, boat, frozenset({"viscous_damping"})),
    "motor": Made(MOTOR, MOTOR_NAMES, motor, frozenset({"coulomb_friction", "scale"})),
    "uneven damper": quarter("viscous_damping", lambda v: (1600.0 if v > 0.0 else 700.0) * v),
    "degressive damper": quarter("viscous_damping", lambda v: 1000.0 * v + 500.0 * float(np.tanh(v / 0.15))),
    "bush that rubs": quarter("coulomb_friction", lambda v: 1000.0 * v + 90.0 * float(np.tanh(v / 2e-3))),
}
