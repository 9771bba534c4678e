# SPDX-License-Identifier: Apache-2.0
"""Dry friction: over its sliding force, or over whatever size the caller gives it.

Kernel arguments
----------------
rate : of the place, of any unit; at : rate of the same unit at which something turns over or fades
excess : break-away force beyond the sliding one, as a share of it
z, move : stretch of what gives before it slips, over its slack (a bristle: its force over the sliding one), and by how
    much the place moves
length : travel over which a bristle bends; steady : where its force over the sliding one ends
value, limit : any unit
force, damping : sliding force, and force of a bristle for a unit of rate, in units that belong together
dt : step, s
"""

from __future__ import annotations

import math

from numba import njit

from pneumo_ros.laws.memory import followed


@njit(cache=True, error_model="numpy", inline="always")
def clipped(value: float, limit: float) -> float:
    """A value inside plus and minus a limit."""
    return min(max(value, -limit), limit)


@njit(cache=True, error_model="numpy", inline="always")
def slid(z: float, move: float) -> float:
    """A slider: elastic up to its slack, then slipping at constant force (Iwan 1966, J. Appl. Mech. 33)."""
    return clipped(z + move, 1.0)


@njit(cache=True, error_model="numpy", inline="always")
def turned(rate: float, at: float) -> float:
    """Direction of the rate, turned over softly."""
    return math.tanh(rate / at)


@njit(cache=True, error_model="numpy", inline="always")
def stribeck(rate: float, at: float, excess: float) -> float:
    """Steady friction: larger from rest, Fc + (Fs - Fc) exp(-(v/vs)^2) over Fc."""
    ratio = rate / at
    return 1.0 + excess * math.exp(-ratio * ratio)


@njit(cache=True, error_model="numpy", inline="always")
def bristle(z: float, rate: float, length: float, steady: float, dt: float) -> float:
    """Bristle of LuGre one step later, exact at held rate: dz/dt = v/s - |v| z/(s g), s the length, g the steady force
    (Canudas de Wit, Olsson, Astrom, Lischinsky 1995, IEEE TAC 40(3)).
    """
    fade = math.exp(-abs(rate) / (length * steady) * dt)
    return followed(z, steady if rate > 0.0 else -steady, fade)


@njit(cache=True, error_model="numpy", inline="always")
def bristle_force(z: float, rate: float, force: float, damping: float) -> float:
    """Resistance of a bent bristle, and of its damping while it still bends."""
    return force * z + min(damping, 4.0 * force) * max(0.0, 1.0 - abs(z)) * rate
