# SPDX-License-Identifier: Apache-2.0
"""Second laws of what acts between body and axle: friction, hysteresis, damping, mode, stop, area.

Forces push body and axle apart when positive; ``p`` is a row of :mod:`pneumo_ros.casemaker.laws.slots`.

Kernel arguments
----------------
p : (COLUMNS,) the law's row: its number, then its parameters in the order that the law states
x, dx, at, sliders : state, its rate, which is written, and the places of the law's own in them
z : the friction's memory, in units of its level (of a slider: m)
height, speed : of the strut, m and m/s, extension positive
top, axle : heights of body and axle at this end, m
spring : force of the spring, N
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Row = NDArray[np.float64]  # (COLUMNS,)
State = NDArray[np.float64]
SLIDERS = 5


@njit(cache=True, error_model="numpy")
def slider_rate(z: float, speed: float, give: float) -> float:
    """Jenkins element: elastic up to ``give``, then it slips (Jenkins 1962). ``z`` in m."""
    return 0.0 if abs(z) >= give and z * speed > 0.0 else speed


@njit(cache=True, error_model="numpy")
def friction(p: Row, z: float, speed: float, spring: float) -> tuple[float, float]:
    """Force and rate of the memory (in units of the level).

    1 load: the guide is pressed by what the spring's force exceeds its alignment: level F (1 + k (S/S0 - 1)), never
      below a tenth (Amontons's law with a varying normal force); parameters F N, k, S0 N, give m.
    2 asymmetric: a lip seal rubs more on the way out than on the way in (Eschmann 1990); F N, ratio, give m.
    3 dahl: dz/dx = |1 - z sgn v|^i sgn(1 - z sgn v) with i other than 1 (Dahl, Aerospace Report TOR-158, 1968); F N, i,
      give m.
    4 elastoplastic: Prandtl's spring and slider, a corner instead of a bend; F N, give m.
    5 sticky: no presliding, F tanh(v/a) (1 + s exp(-(v/b)^2)) + c v (Makkar et al. 2005); N, m/s, 1, m/s, N s/m.
    """
    number = int(p[0])
    if number == 1:
        level = p[1] * max(0.1, 1.0 + p[2] * (spring / p[3] - 1.0))
        return -level * z, (speed - abs(speed) * z) / p[4]
    if number == 2:
        ratio = 1.0 if speed > 0.0 else p[2]
        return -p[1] * z, (speed - abs(speed) * z / ratio) / p[3]
    if number == 3:
        left = 1.0 - z if speed > 0.0 else 1.0 + z
        bend = abs(left) ** p[2]
        return -p[1] * z, speed / p[3] * (bend if left > 0.0 else -bend)
    if number == 4:
        return -p[1] * min(max(z, -1.0), 1.0), slider_rate(z, speed, 1.0) / p[2]
    peak = 1.0 + p[3] * math.exp(-((speed / p[4]) ** 2))
    return -p[1] * math.tanh(speed / p[2]) * peak - p[5] * speed, 0.0


@njit(cache=True, error_model="numpy")
def hysteresis(p: Row, x: State, dx: State, at: int, sliders: int, speed: float, depth: float) -> float:
    """Force of the bellows' memory; fills its rates. ``depth`` is how far the spring is below its design height, m.

    1 iwan: parallel sliders whose slip forces follow a power law (Segalman, J. Appl. Mech. 72, 2005); total N, largest
      give m, exponent in (-1, 0).
    2 asymmetric: Bouc-Wen whose limit differs between the directions (Wang, Wen, J. Eng. Mech. 126, 2000); N, give m,
      limit of the negative side, sharpness.
    3 folds: Bouc-Wen between the folds, pressed together as the bellows compress: N, give m, length m.
    """
    number = int(p[0])
    if number == 1:
        total, force = 0.0, 0.0
        for i in range(SLIDERS):
            share = (i + 0.5) / SLIDERS
            weight = share ** (1.0 + p[3])
            give = p[2] * share
            z = x[sliders + i]
            dx[sliders + i] = slider_rate(z, speed, give)
            force += weight * min(max(z / give, -1.0), 1.0)
            total += weight
        return -p[1] * force / total
    z = x[at]
    limit = p[3] if number == 2 and z < 0.0 else 1.0
    use = abs(z / limit) ** (p[4] if number == 2 else 1.0)
    dx[at] = speed / p[2] * (1.0 - (use if z * speed > 0.0 else 0.0))
    grip = max(0.05, 1.0 + depth / p[3]) if number == 3 else 1.0
    return -p[1] * grip * z


@njit(cache=True, error_model="numpy")
def damping(p: Row, speed: float) -> float:
    """1 degressive: c v0 |v/v0|^e sgn v, e < 1, linear below a hundredth of v0; N s/m, e, v0 m/s.
    2 one-sided: stiffer in rebound (the strut extends) than in bump; N s/m, share in bump.
    3 blow-off: linear until the valve opens, then a small slope (Dixon, The Shock Absorber Handbook, 2007); N s/m,
      speed m/s, share of the slope left.
    """
    number = int(p[0])
    if number == 1:
        ratio = (speed / p[3]) ** 2 + 1e-4
        return -p[1] * speed * ratio ** (0.5 * (p[2] - 1.0))
    if number == 2:
        return -p[1] * speed * (1.0 if speed > 0.0 else p[2])
    held = min(max(speed, -p[2]), p[2])
    return -p[1] * (held + p[3] * (speed - held))


@njit(cache=True, error_model="numpy")
def mode(
    p: Row, x: State, dx: State, at: int, height: float, speed: float, top: float, axle: float
) -> tuple[float, float]:
    """Forces on body and on axle of a moving part of the bellows, N upwards; fills its rates.

    mass kg, frequency rad/s, damping ratio, and for the others than the grounded one a length:
    1 hardening: a mass inside the strut on a spring k e (1 + (e/l)^2) (Duffing 1918); l m.
    2 grounded: the fold hangs between both plates and swings against the ground, so that its inertia is no strut force.
    3 loose: the mass inside the strut has play; m.
    """
    number, w = int(p[0]), p[2]
    q, rate = x[at], x[at + 1]
    dx[at] = rate
    if number == 2:
        bend = 0.5 * (top + axle) - q
        dx[at + 1] = w * w * bend - 2.0 * p[3] * w * rate
        pull = -0.5 * p[1] * w * w * bend
        return pull, pull
    bend = height - q
    stretched = bend * (1.0 + (bend / p[4]) ** 2) if number == 1 else bend - min(max(bend, -p[4]), p[4])
    dx[at + 1] = w * w * stretched + 2.0 * p[3] * w * (speed - rate)
    force = -p[1] * dx[at + 1]
    return force, -force


@njit(cache=True, error_model="numpy")
def stop(p: Row, height: float, speed: float) -> float:
    """Push of a stop met at p[1] m: never a pull.

    1 lossy: k d (1 + h d) (1 - c v), the one that the library has; N/m, 1/m, s/m.
    2 one-sided: k d with damping only on the way in (an orifice with a check valve); N/m, s/m.
    3 exponential: F (exp(d/l) - 1), foamed rubber that packs; N, m.
    4 two slopes: k d, and K more beyond a second depth; N/m, N/m, m.
    """
    depth = p[1] - height
    if depth <= 0.0:
        return 0.0
    number = int(p[0])
    if number == 1:
        return p[2] * depth * (1.0 + p[3] * depth) * max(0.0, 1.0 - p[4] * speed)
    if number == 2:
        return p[2] * depth * (1.0 + p[3] * max(0.0, -speed))
    if number == 3:
        return p[2] * (math.exp(min(depth / p[3], 12.0)) - 1.0)
    return p[2] * depth + p[3] * max(0.0, depth - p[4])


@njit(cache=True)
def area(p: Row, stroke: float, excess: float) -> float:
    """Relative error of the effective area; ``stroke`` m above the design height, ``excess`` Pa over the static one.

    1 swelling: the bellows widen with pressure; 1/Pa, and its square 1/Pa2.
    2 curved: e (1 + b s^2 + c s^3) with s the stroke over 10 mm: a bead that rolls off; e, b, c.
    3 wavy: e sin(2 pi stroke/l + phase), the convolution's lobes; e, l m, phase.
    """
    number = int(p[0])
    if number == 1:
        return p[1] * excess + p[2] * excess * excess
    if number == 2:
        s = min(max(stroke / 0.01, -1.6), 1.6)
        return p[1] * (1.0 + p[2] * s * s + p[3] * s * s * s)
    return p[1] * math.sin(2.0 * math.pi * stroke / p[2] + p[3])
