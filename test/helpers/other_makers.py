# SPDX-License-Identifier: Apache-2.0
"""Rigs simulated by other means than the package: an adaptive integrator with events, laws that no library has."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
PERIOD = 0.004  # s


def sines(seed: int, amplitudes: tuple[float, ...], frequencies: tuple[float, ...]) -> Callable[[float], float]:
    """A sum of sines of random phases."""
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(amplitudes))

    def value(t: float) -> float:
        waves = zip(amplitudes, frequencies, phases, strict=True)
        return float(sum(a * np.sin(2.0 * np.pi * f * t + p) for a, f, p in waves))

    return value


def quarter_car(path: Path, seed: int, seconds: float = 12.0, friction: float = 8.0, extra: float = 0.5) -> None:
    """A quarter car whose strut sticks and slips: Stribeck friction with a true stick phase, found by events."""
    road = sines(seed, (0.008, 0.005, 0.003), (0.8, 1.7, 3.3))
    m, w, k, c, tyre = 30.2, 4.05, 2530.0, 93.0, 13900.0

    def pushed(t: float, y: Array) -> float:
        return float(k * (y[1] - y[0]) + c * (y[3] - y[2]))

    def slipping(way: float) -> Callable[[float, Array], list[float]]:
        def rates(t: float, y: Array) -> list[float]:
            rate = y[2] - y[3]
            rub = -way * friction * (1.0 + extra * np.exp(-abs(rate) / 0.01))
            force = pushed(t, y) + rub
            return [y[2], y[3], force / m, (tyre * (road(t) - y[1]) - force) / w]

        return rates

    def stuck(t: float, y: Array) -> list[float]:
        both = tyre * (road(t) - y[1]) / (m + w)
        return [y[2], y[3], both, both]

    def holds(t: float, y: Array) -> float:
        """What friction must hold, over what it can."""
        need = m * tyre * (road(t) - y[1]) / (m + w) - pushed(t, y)
        return float(abs(need) - friction * (1.0 + extra))

    def rubs(t: float, y: Array) -> float:
        return float(y[2] - y[3])

    for event in (holds, rubs):
        event.terminal = True  # type: ignore[attr-defined]
    times = np.arange(0.0, seconds, PERIOD)
    y, t, mode = np.zeros(4), 0.0, "stick"
    out = np.zeros((len(times), 4))
    while t < times[-1]:
        if mode == "stick":
            run = solve_ivp(stuck, (t, times[-1]), y, events=holds, max_step=0.01, rtol=1e-8, dense_output=True)
        else:
            way = 1.0 if mode == "out" else -1.0
            rubs.direction = -way  # type: ignore[attr-defined]
            run = solve_ivp(slipping(way), (t, times[-1]), y, events=rubs, max_step=0.01, rtol=1e-8, dense_output=True)
        rows = (times >= t) & (times <= run.t[-1])
        if rows.any():
            out[rows] = run.sol(times[rows]).T
        t, y = float(run.t[-1]), run.y[:, -1]
        if run.status != 1:
            break
        if mode == "stick" or holds(t, y) > 0.0:
            need = m * tyre * (road(t) - y[1]) / (m + w) - pushed(t, y)
            mode = "out" if need < 0.0 else "in"
            y = y + np.array([0.0, 0.0, 1e-7, -1e-7]) * (1.0 if mode == "out" else -1.0)
            t += 1e-9
        else:
            mode, y = "stick", np.array([y[0], y[1], *[(m * y[2] + w * y[3]) / (m + w)] * 2])
    noise = np.random.default_rng(seed + 1).normal(0.0, 1e-5, (len(times), 2))
    table = np.column_stack([times, 1e3 * (out[:, :2] + noise), [1e3 * road(t) for t in times]])
    np.savetxt(path, table, "%.7g", ",", header="t,body,wheel,road", comments="")


def gearbox(path: Path, seed: int, seconds: float = 12.0, half_gap: float = 0.1) -> None:
    """A motor and a flywheel whose teeth lose touch: free flight, then a contact that stiffens and loses."""
    volts = sines(seed, (5.0, 4.0, 2.0), (0.5, 1.3, 2.9))
    n, kt, r, jm, jl, k, c, drag = 10.0, 0.0502, 2.01, 2.03e-5, 3.97e-3, 8.2, 0.02, 0.0102

    def rates(t: float, y: Array) -> list[float]:
        twist, rate = y[0] / n - y[1], y[2] / n - y[3]
        over = twist - half_gap if twist > half_gap else min(0.0, twist + half_gap)
        shaft = k * over * (1.0 + 2.0 * abs(over)) + c * rate * (1.0 if over else 0.0)
        drive = kt * (volts(t) - kt * y[2]) / r
        return [y[2], y[3], (drive - shaft / n) / jm, (shaft - drag * y[3]) / jl]

    def touches(t: float, y: Array) -> float:
        return float(abs(y[0] / n - y[1]) - half_gap)

    times = np.arange(0.0, seconds, PERIOD)
    run = solve_ivp(rates, (0.0, times[-1]), np.zeros(4), t_eval=times, events=touches, max_step=0.002, rtol=1e-7)
    noise = np.random.default_rng(seed + 1).normal(0.0, 1.0, (len(times), 2)) * np.array([1e-3, 1e-4])
    seen = run.y[:2].T + noise
    table = np.column_stack([times, seen[:, 0], np.degrees(seen[:, 1]), [volts(t) for t in times]])
    np.savetxt(path, table, "%.8g", ",", header="t,motor,load,voltage", comments="")
