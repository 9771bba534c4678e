# SPDX-License-Identifier: Apache-2.0
"""A mass on a spring and a damper, one step at a time: what everything that rings has in common.

Kernel arguments
----------------
x, v : where the mass is, m, and how fast, m/s, both at the state's instant
to, rate : what it hangs on, m, half a step later than x, and its speed, m/s, held over the step
frequency, damping_ratio : natural frequency, rad/s, and share of critical damping, 1
free : share of the damping that acts against the ground and not against what it hangs on, 1
stretch, stretching : of what hangs against the mass, m and m/s (what hangs on it ahead of the mass: positive)
between : share of the damping that acts between the two
dt : step, s
"""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True, error_model="numpy", inline="always")
def swung(
    x: float, v: float, to: float, rate: float, frequency: float, damping_ratio: float, free: float, dt: float
) -> tuple[float, float]:
    """Exact damped oscillation one step later, about a suspension that moves at held speed.

    Where the suspension was at the state's instant is half a step back, for the staggered scheme's second order.
    """
    decay, ringing = damping_ratio * frequency, frequency * math.sqrt(1.0 - damping_ratio * damping_ratio)
    behind = -2.0 * damping_ratio * free * rate / frequency  # of what it hangs on, at constant speed
    e0, v0 = x - (to - 0.5 * dt * rate) - behind, v - rate
    c, s, fade = math.cos(ringing * dt), math.sin(ringing * dt), math.exp(-decay * dt)
    e1 = fade * (e0 * c + (v0 + decay * e0) / ringing * s)
    v1 = fade * (v0 * c - (decay * v0 + frequency * frequency * e0) / ringing * s)
    return e1 + behind + to + 0.5 * dt * rate, v1 + rate


@njit(cache=True, error_model="numpy", inline="always")
def pulled(stretch: float, stretching: float, frequency: float, damping_ratio: float, between: float) -> float:
    """Acceleration of the mass by spring and damper, m/s2: w^2 s + 2 zeta w b s'; what it hangs on is pulled back by
    the mass times this.
    """
    return frequency * frequency * stretch + 2.0 * damping_ratio * frequency * between * stretching
