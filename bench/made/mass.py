# SPDX-License-Identifier: Apache-2.0
"""A mass on a rail, driven by an actuator: eight rigs of one model."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.random import Generator

from made.common import SLOTS, Columns, Made, beyond, run, sampled, several
from pneumo_ros.arrays import Array

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
        return {"t": t, "x": reading(x) + rng.normal(0.0, 5e-4, len(t)), "u": sampled(drive, t)}

    return Made(MASS, MASS_NAMES, log, frozenset(families))


def slow_amplifier(rng: Generator) -> Columns:
    """A lag of 20 ms that cannot be faster than 8 V/s."""
    t = np.arange(0.0, 20.0, 0.01)
    drive = several(rng, (2.0, 1.6, 1.2), (0.2, 0.53, 1.1))

    def rates(time: float, y: Array) -> list[float]:
        pull = 10.0 * y[2] - 3.0 * y[1] - 20.0 * y[0]
        return [y[1], pull / 1.02, float(np.clip((drive(time) - y[2]) / 0.02, -8.0, 8.0))]

    x = run(rates, (0.0, 0.0, drive(0.0)), t, 2e-3)[0]
    return {"t": t, "x": x + rng.normal(0.0, 5e-4, len(t)), "u": sampled(drive, t)}


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
}
