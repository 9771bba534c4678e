# SPDX-License-Identifier: Apache-2.0
"""Second laws of valve, tyre, exciter and sensors, and what no family explains: pulses, winds, swinging loads.

Kernel arguments
----------------
p : (COLUMNS,) the law's row: its number, then its parameters in the order that the law states
x, dx, at : state, its rate, which is written, and the place of the law's own in them
target, value : what is followed and what follows, in one unit
spool : position of the inlet's spool, m2
time, period : s
rate, load, ratio : see the law
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Row = NDArray[np.float64]  # (COLUMNS,)
State = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def follow(p: Row, target: float, value: float) -> float:
    """Rate of a follower (spool, exciter, gauge) towards its target.

    1 asymmetric: one time constant upwards, another downwards; s, s.
    2 rate-limited: quick until its speed saturates; s, units/s.
    3 throttled: a small orifice, K sgn(d) sqrt|d|, smooth within p[2]; units^0.5/s, units.
    """
    number, off = int(p[0]), target - value
    if number == 1:
        return off / (p[1] if off > 0.0 else p[2])
    if number == 2:
        return min(max(off / p[1], -p[2]), p[2])
    return p[1] * off / math.sqrt(math.sqrt(off * off + p[2] * p[2]))


@njit(cache=True, error_model="numpy")
def port(p: Row, spool: float) -> float:
    """Opening of a valve near its seat, m2.

    1 soft: a lapped edge that leaks before it opens, w ln(1 + exp((s - a)/w)); a m2, w m2.
    2 two slopes: below the notch's end the opening is a share of the stroke; m2, share.
    """
    if spool <= 0.0:
        return 0.0
    if int(p[0]) == 1:
        u = (spool - p[1]) / p[2]
        shut = p[2] * math.log1p(math.exp(-p[1] / p[2]))
        return (p[2] * math.log1p(math.exp(u)) if u < 30.0 else spool - p[1]) - shut
    return p[2] * min(spool, p[1]) + max(0.0, spool - p[1])


@njit(cache=True, error_model="numpy")
def late(p: Row, time: float, period: float) -> float:
    """Delay of a command at an instant, s.

    1 held: the driver takes a command every p[1] s and keeps it.
    2 scattered: each packet of p[2] s travels p[1] (1 + s) with s between -p[3] and p[3], drawn by its number.
    """
    if int(p[0]) == 1:
        return time - p[1] * math.floor(time / p[1] + 1e-9)
    packet = math.floor(time / p[2])
    s = math.sin(12.9898 * packet + p[4]) * 43758.5453
    return p[1] * (1.0 + p[3] * (2.0 * (s - math.floor(s)) - 1.0))


@njit(cache=True, error_model="numpy")
def tyre_loss(p: Row, x: State, dx: State, at: int, rate: float, load: float) -> float:
    """Force of the tyre's rubber, N upwards on the axle; ``rate`` of the deflection, ``load`` over the one at rest.

    1 hysteretic: elastic, then slipping (Prandtl), whatever the speed; N, m.
    2 load: the damping grows with the tyre's load to a power; N s/m, power.
    3 degressive: c v0 |v/v0|^e sgn v; N s/m, e, v0 m/s.
    """
    number = int(p[0])
    if number == 1:
        z = x[at]
        dx[at] = (rate - abs(rate) * z) / p[2]
        return p[1] * z
    if number == 2:
        return p[1] * min(max(load, 0.0), 4.0) ** p[2] * rate
    return p[1] * rate * ((rate / p[3]) ** 2 + 1e-4) ** (0.5 * (p[2] - 1.0))


@njit(cache=True, error_model="numpy")
def lift(p: Row, ratio: float) -> float:
    """Tyre force over the one at rest; ``ratio`` of the deflection to the one at rest. Never a pull.

    1 progressive: |ratio|^e with e above 1, as a toroid in contact; e.
    2 soft: the carcass bulges before it lets go, (r + sqrt(r^2 + d^2))/(1 + sqrt(1 + d^2)); d.
    """
    if int(p[0]) == 1:
        return max(0.0, ratio) ** p[1]
    return (ratio + math.sqrt(ratio * ratio + p[1] * p[1])) / (1.0 + math.sqrt(1.0 + p[1] * p[1]))


@njit(cache=True, error_model="numpy")
def sensor_error(p: Row, value: float, time: float) -> float:
    """What a sensor adds, in its own unit; ``p[2]`` is the value about which it was adjusted.

    1 cubic: e (s/l)^3 within two l; e, centre, l.
    2 two slopes: another gain on one side of the centre; gain, centre.
    3 drift: in proportion to time; units/s.
    4 warming: e (1 - exp(-t/T)); e, -, T.
    5 saturating: nothing above the limit; -, -, limit.
    """
    number = int(p[0])
    if number == 1:
        return p[1] * min(max((value - p[2]) / p[3], -2.0), 2.0) ** 3
    if number == 2:
        return p[1] * max(0.0, value - p[2]) if p[3] > 0.0 else p[1] * min(0.0, value - p[2])
    if number == 3:
        return p[1] * time
    if number == 4:
        return p[1] * (1.0 - math.exp(-time / p[3]))
    return min(0.0, p[3] - value)


@njit(cache=True, error_model="numpy")
def external(p: Row, time: float) -> float:
    """Force on the body above an axle that no state explains, N; nothing in the first half second.

    1 pushes: half sines of p[2] s every p[3] s, of changing sign; N.
    2 rotor: an unbalanced rotor on the body, N at p[2] rad/s; its force grows with the square as it speeds up by p[3].
    3 wind: three sines that share no period; N, rad/s of the first.
    """
    t = time - 0.5
    if t <= 0.0:
        return 0.0
    number = int(p[0])
    if number == 1:
        lap = math.floor(t / p[3])
        within = t - lap * p[3]
        if within > p[2]:
            return 0.0
        return p[1] * math.cos(2.4 * lap * lap + p[4]) * math.sin(math.pi * within / p[2])
    if number == 2:
        speed = 1.0 + p[3] * t
        return p[1] * speed * speed * math.sin(p[2] * t * (1.0 + 0.5 * p[3] * t))
    w = p[2]
    return p[1] / 1.7 * (math.sin(w * t) + math.sin(1.6180 * w * t + p[4]) + 0.7 * math.sin(2.7183 * w * t))
