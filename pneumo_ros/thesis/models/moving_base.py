# SPDX-License-Identifier: Apache-2.0
"""A payload on a sealed air spring on a shaker (Sections 5.4 to 5.6, Eq. 5.8): the frequency response experiment.

The valves are shut, so the air's mass is constant and its pressure follows the volume: P V^n = const (Eq. 4.18).
State (2): payload height z [m] and rate; the base moves as amplitude sin(w t).

Kernel arguments
----------------
height : of the spring, m
z, rate, base, base_rate : payload about rest and base, upwards, m and m/s
frequency, amplitude : of the base, Hz and m
periods, steps : how many are simulated, and RK4 steps in each
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import brentq

from pneumo_ros.errors import InputError
from pneumo_ros.plant.air_spring import MEAN_AREA, VOLUME_OFFSET, AreaSurface, effective_area
from pneumo_ros.units import ATMOSPHERE, GRAVITY, INCH


class Bench(NamedTuple):
    """The experiment, SI.

    Attributes
    ----------
    mass : payload, kg
    pressure : static, Pa absolute
    height : static spring height, m
    damping : c of Eq. 5.8, N s/m
    exponent : n
    area_scale : factor on the effective area surface (Figure 5.17: 0.9 and 1.1)
    """

    mass: float
    pressure: float
    height: float
    damping: float
    exponent: float
    area_scale: float = 1.0


def bench_at(
    mass: float,
    gauge: float,
    surface: AreaSurface,
    *,
    damping: float,
    exponent: float = 1.4,
    area_scale: float = 1.0,
) -> Bench:
    """The bench with a payload, kg, on a spring inflated to a gauge pressure, Pa: its height follows from the surface.

    Raises
    ------
    InputError
        if no height between 1 and 2.3 in carries the payload.
    """
    load = mass * GRAVITY

    def missing(height: float) -> float:
        return gauge * area_scale * float(effective_area(height, gauge, surface)) - load

    low, high = 1.0 * INCH, 2.3 * INCH
    if missing(low) < 0.0 or missing(high) > 0.0:
        raise InputError(f"no height carries {mass:.3g} kg at {gauge:.4g} Pa gauge", key="mass", value=mass)
    height = float(brentq(missing, low, high))
    return Bench(mass, gauge + ATMOSPHERE, height, damping, exponent, area_scale)


@njit(cache=True)
def sealed_pressure(height: float, bench: Bench) -> float:
    """Absolute pressure, Pa, of the sealed air at a spring height, m."""
    ratio = (VOLUME_OFFSET + MEAN_AREA * bench.height) / (VOLUME_OFFSET + MEAN_AREA * height)
    return bench.pressure * ratio**bench.exponent


@njit(cache=True)
def bench_acceleration(
    z: float, rate: float, base: float, base_rate: float, bench: Bench, surface: AreaSurface
) -> float:
    """Payload acceleration, m/s2 (Eq. 5.8 with gauge pressure)."""
    height = bench.height + z - base
    gauge = sealed_pressure(height, bench) - ATMOSPHERE
    force = gauge * bench.area_scale * effective_area(height, gauge, surface)
    return (force - bench.damping * (rate - base_rate)) / bench.mass - GRAVITY


@njit(cache=True)
def shake(
    frequency: float, amplitude: float, periods: int, steps: int, bench: Bench, surface: AreaSurface
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Base and payload motion about rest, (periods * steps + 1,) m, RK4 with ``steps`` a period, from rest."""
    w, dt = 2.0 * np.pi * frequency, 1.0 / (frequency * steps)
    count = periods * steps
    base, out = np.empty(count + 1), np.empty(count + 1)
    z, v = 0.0, 0.0
    for i in range(count + 1):
        t = i * dt
        base[i], out[i] = amplitude * np.sin(w * t), z
        b0, r0 = base[i], amplitude * w * np.cos(w * t)
        bm, rm = amplitude * np.sin(w * (t + 0.5 * dt)), amplitude * w * np.cos(w * (t + 0.5 * dt))
        b1, r1 = amplitude * np.sin(w * (t + dt)), amplitude * w * np.cos(w * (t + dt))
        a1 = bench_acceleration(z, v, b0, r0, bench, surface)
        a2 = bench_acceleration(z + 0.5 * dt * v, v + 0.5 * dt * a1, bm, rm, bench, surface)
        a3 = bench_acceleration(z + 0.5 * dt * (v + 0.5 * dt * a1), v + 0.5 * dt * a2, bm, rm, bench, surface)
        a4 = bench_acceleration(z + dt * (v + 0.5 * dt * a2), v + dt * a3, b1, r1, bench, surface)
        z += dt * v + dt * dt * (a1 + a2 + a3) / 6.0
        v += dt * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
    return base, out


def response(frequency: float, amplitude: float, bench: Bench, surface: AreaSurface, settle: float = 3.0) -> complex:
    """Payload over base motion at one frequency, from the simulated records' first harmonic over whole periods.

    ``settle`` seconds (at least 10 periods) pass before 10 periods are used.
    """
    wait = max(10, int(np.ceil(settle * frequency)))
    steps = max(40, int(np.ceil(2000.0 / frequency)))
    base, out = shake(frequency, amplitude, wait + 10, steps, bench, surface)
    turn = np.exp(-2j * np.pi * np.arange(10 * steps) / steps)
    return complex(np.sum(out[wait * steps : -1] * turn) / np.sum(base[wait * steps : -1] * turn))


def natural_frequency(bench: Bench, surface: AreaSurface) -> float:
    """Undamped natural frequency, Hz, of small motion: slope of the force (Eqs. 5.9-5.10)."""
    step = 1e-6
    up = bench_acceleration(step, 0.0, 0.0, 0.0, bench, surface)
    down = bench_acceleration(-step, 0.0, 0.0, 0.0, bench, surface)
    return float(np.sqrt(-(up - down) / (2.0 * step)) / (2.0 * np.pi))
