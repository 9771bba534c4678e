# SPDX-License-Identifier: Apache-2.0
"""A small rig of one's own for tests: a cart on a spring, its two files and its log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

PERIOD = 0.01  # s
CART = """
from pneumo_ros.own_rig import Force, Input, Sensor

SLOTS = [
    Force("rail", travel=lambda x, u, p: x.position, rate=lambda x, u, p: x.speed),
    Input("force"),
    Sensor("position"),
]


def rhs(x, u, p, f):
    return x.speed, (u.force - p.stiffness * x.position - p.damping * x.speed + f.rail) / p.mass


def outputs(x, u, p, f):
    return (x.position,)
"""
CART_YAML = """
rig: cart
time: {field: t, unit: s}
channels:
  position: {field: x, unit: mm}
inputs:
  force: {unit: N}
states: {position: position, speed: rate of position}
parameters: {mass: 2 +- 0.05 kg, stiffness: 80 +- 4 N/m, damping: 1 +- 0.2 N s/m}
"""


def written(folder: Path, physics: str = CART, names: str = CART_YAML) -> Path:
    """rig.py and rig.yaml in a folder; the path of rig.py."""
    (folder / "rig.yaml").write_text(names, encoding="utf-8")
    (folder / "rig.py").write_text(physics, encoding="utf-8")
    return folder / "rig.py"


def cart_log(path: Path, friction: float, seconds: float = 16.0, seed: int = 1, creep: float = 0.0) -> Path:
    """A log of the cart with dry friction that turns over within 2 mm/s, and a sensor whose zero creeps by so many m in
    five seconds.
    """
    t = np.arange(0.0, seconds, PERIOD)

    def pull(time: float) -> float:
        return float(4.0 * np.sin(2.0 * time) + 3.0 * np.sin(5.3 * time + 1.0) + 2.0 * np.sin(9.1 * time))

    def rates(time: float, y: np.ndarray) -> list[float]:
        rub = friction * np.tanh(y[1] / 2e-3)
        return [y[1], (pull(time) - 82.0 * y[0] - 1.1 * y[1] - rub) / 2.02]

    x = solve_ivp(rates, (0.0, t[-1]), (0.0, 0.0), t_eval=t, max_step=2e-3).y[0]
    x += np.random.default_rng(seed).normal(0.0, 2e-5, len(t))
    x -= creep * np.expm1(-t / 5.0)
    table = np.column_stack([t, 1e3 * x, [pull(one) for one in t]])
    np.savetxt(path, table, "%.6f", ",", header="t,x,force", comments="")
    return path


def cylinder_log(path: Path, friction: float, damping: float, speeds: tuple[float, ...]) -> Path:
    """A cylinder of 25 mm under 3 bar whose rod goes to and fro over 60 mm, in turn at each of some speeds (m/s), read
    as the rig file of ``examples/cylinder`` has it; ``friction`` N and ``damping`` N s/m hold the rod back, so that the
    load cell pushes by as much more.
    """
    period, rng = 0.01, np.random.default_rng(5)
    legs = [leg for speed in (speeds * 12)[:12]
            for leg in (np.arange(0.0, 0.06, speed * period), np.arange(0.06, 0.0, -speed * period))]  # fmt: skip
    position = np.concatenate(legs)
    speed = np.gradient(position, period)
    t = 7.0 + period * np.arange(len(position))
    pressure = 3e5 + 8e3 * np.sin(0.9 * t)
    force = 4.909e-4 * pressure + friction * np.tanh(speed / 1e-3) + damping * speed + rng.normal(0.0, 0.3, len(t))
    nothing = np.zeros(len(t))
    table = np.column_stack([1e3 * t, nothing, nothing, nothing, 1e3 * position, 1e-5 * pressure, force])
    np.savetxt(path, table, "%.5f", ",")
    return path


def chamber_log(path: Path, seed: int, rate: float) -> Path:
    """A chamber that loses ``rate`` of its pressure above ambient a second, 120 s at 10 Hz, 0.0015 bar of noise."""
    t = np.arange(0.0, 120.0, 0.1)
    gauge = 7.0 * np.exp(-rate * t) + np.random.default_rng(seed).normal(0.0, 0.0015, len(t))
    np.savetxt(path, np.column_stack([1e3 * t, 0.5 * gauge, gauge]), "%.4f", ";")
    return path
