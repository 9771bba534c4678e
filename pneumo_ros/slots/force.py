# SPDX-License-Identifier: Apache-2.0
"""Laws and atoms of a force slot, evaluated together: coordinates, memories, values and scales in, force out. What each
law does is in :mod:`pneumo_ros.laws`.

``c`` are the coordinates (travel, rate, load), ``z`` the memories, ``P`` the values of all laws and atoms (0: absent;
the columns are named here), ``S`` the slot's scales. What opposes a motion is negative at positive rate. Memories move
once a step; within one a force goes on from them by what the travel has moved since, or a stiff hysteresis would be
half a step late and give energy away.

Kernel arguments
----------------
c, z, P, S : coordinates (3,), memories (MEMORIES,), values of all laws and atoms (VALUES,), scales (SCALES,)
x, v, load : the coordinates: travel, its rate, and what presses, in the slot's units
h : a step, s
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pneumo_ros.arrays import Array
from pneumo_ros.laws.contact import in_play, missing_pull, stop
from pneumo_ros.laws.damping import degressive, linear, one_sided, squared
from pneumo_ros.laws.friction import clipped, slid, stribeck, turned
from pneumo_ros.laws.hysteresis import moved_on
from pneumo_ros.laws.memory import relaxed
from pneumo_ros.laws.ringing import pulled

# Laws: columns of P.
COULOMB = 0
STRIBECK, STRIBECK_EXTRA, STRIBECK_RATE = 1, 2, 3
SOFT, SOFT_RATE = 4, 5
PRESLIDING, PRESLIDING_TRAVEL = 6, 7
ONE_SIDED_OUT, ONE_SIDED_IN = 8, 9
LOADED = 10
VISCOUS = 11
DAMPING_OUT, DAMPING_IN = 12, 13
DEGRESSIVE, DEGRESSIVE_RATE = 14, 15
SQUARE_DAMPING = 16
BOUC_WEN, BOUC_WEN_TRAVEL = 17, 18
SLIDERS, SLIDERS_TRAVEL = 19, 20
STOP_BELOW, STOP_BELOW_DEPTH, STOP_BELOW_LOSS = 21, 22, 23
STOP_ABOVE, STOP_ABOVE_DEPTH, STOP_ABOVE_LOSS = 24, 25, 26
SPRING, SPRING_CUBIC, SPRING_SQUARE = 27, 28, 29
BACKLASH, BACKLASH_HALF = 30, 31
MASS, FREQUENCY, DAMPING_RATIO = 32, 33, 34
CONSTANT = 35
PULL = 36
MEMORY, MEMORY_TIME = 37, 38
BOUC_WEN_GROWTH = 39
LAWS = 40

# Atoms: first column of each row of them.
OUT, IN, FEW = LAWS, LAWS + 5, 5  # ramps that saturate at S_RATES, for rates above and below zero
LINES = IN + 5  # linear out, in, square out, in
LOAD_RAMP = LINES + 4
SLID = LOAD_RAMP + 1  # sliders of S_SLACKS
BELOW, ABOVE, STEPS = SLID + 5, SLID + 9, 4  # ramps that begin at S_BELOW, S_ABOVE
TOUCH = ABOVE + 4  # damping below the second of S_BELOW, above the second of S_ABOVE
POWERS = TOUCH + 2  # travel to the powers 1, 2, 3
CENTRE = POWERS + 3  # travel clipped to S_CENTRE
LAGGED = CENTRE + 3  # travel over its memories of S_TIMES
STEADY = LAGGED + 3
ATOMS_AT_WORK = STEADY + 1  # whether any atom is: laws alone are quick
VALUES = STEADY + 2

# Scales: columns of S.
S_RATES, S_SLACKS, S_BELOW, S_ABOVE, S_CENTRE, S_TIMES = 0, 5, 10, 14, 18, 21
S_MIDDLE, S_SWING, S_RATE, S_TURNOVER, S_LOAD = 24, 25, 26, 27, 28
SCALES = 29

# Memories: columns of z.
Z_SLID, Z_PRE, Z_BOUC, Z_THREE, Z_LAGGED, Z_MASS, Z_BEFORE, Z_MEMORY = 0, 5, 6, 7, 10, 13, 15, 16
MEMORIES = 17

THREE = (0.4, 1.0, 2.5)  # slacks of the parallel sliders, in their mean


@njit(cache=True, error_model="numpy")
def start(c: Array, z: Array, S: Array) -> None:
    """Sliders free of force, memories at the travel, an attached mass at rest on its spring."""
    z[:] = 0.0
    for k in range(3):
        z[Z_LAGGED + k] = c[0]
    z[Z_MASS], z[Z_MASS + 1] = c[0], c[1]
    z[Z_BEFORE] = c[0]
    z[Z_MEMORY] = c[0]


@njit(cache=True, error_model="numpy")
def advance(c: Array, z: Array, h: float, P: Array, S: Array) -> None:
    """Memories one step of ``h`` s later; ``c`` at its end."""
    moved = c[0] - z[Z_BEFORE]
    z[Z_BEFORE] = c[0]
    if P[ATOMS_AT_WORK] != 0.0:
        for k in range(5):
            z[Z_SLID + k] = slid(z[Z_SLID + k], moved / S[S_SLACKS + k])
        for k in range(3):
            if P[LAGGED + k] != 0.0:
                z[Z_LAGGED + k] = relaxed(z[Z_LAGGED + k], c[0], h, S[S_TIMES + k])
    if P[PRESLIDING] != 0.0:
        z[Z_PRE] = slid(z[Z_PRE], moved / P[PRESLIDING_TRAVEL])
    if P[BOUC_WEN] != 0.0:
        z[Z_BOUC] = moved_on(z[Z_BOUC], moved / P[BOUC_WEN_TRAVEL], P[BOUC_WEN_GROWTH])
    if P[SLIDERS] != 0.0:
        for k in range(3):
            z[Z_THREE + k] = slid(z[Z_THREE + k], moved / (THREE[k] * P[SLIDERS_TRAVEL]))
    if P[MEMORY] != 0.0:
        z[Z_MEMORY] = relaxed(z[Z_MEMORY], c[0], h, P[MEMORY_TIME])
    if P[MASS] != 0.0:
        z[Z_MASS + 1] += h * pulled(c[0] - z[Z_MASS], c[1] - z[Z_MASS + 1], P[FREQUENCY], P[DAMPING_RATIO], 1.0)
        z[Z_MASS] += h * z[Z_MASS + 1]


@njit(cache=True, error_model="numpy")
def force(c: Array, z: Array, P: Array, S: Array) -> float:
    """What acts, in the slot's unit."""
    x, v, load = c[0], c[1], c[2]
    out = _friction(x, v, load, z, P, S) + _damping(v, P) + _elastic(x, v, load, z, P, S)
    return out + _atoms(x, v, load, z, P, S) if P[ATOMS_AT_WORK] != 0.0 else out


@njit(cache=True, error_model="numpy")
def _friction(x: float, v: float, load: float, z: Array, P: Array, S: Array) -> float:
    if not P[: LOADED + 1].any():
        return 0.0
    way = turned(v, S[S_TURNOVER])
    out = -(P[COULOMB] + P[LOADED] * abs(load)) * way
    if P[STRIBECK] != 0.0:
        out -= P[STRIBECK] * stribeck(v, P[STRIBECK_RATE], P[STRIBECK_EXTRA]) * way
    if P[SOFT] != 0.0:
        out -= P[SOFT] * turned(v, P[SOFT_RATE])
    if P[PRESLIDING] != 0.0:
        out -= P[PRESLIDING] * slid(z[Z_PRE], (x - z[Z_BEFORE]) / P[PRESLIDING_TRAVEL])
    return out - (P[ONE_SIDED_OUT] if v > 0.0 else P[ONE_SIDED_IN]) * way


@njit(cache=True, error_model="numpy")
def _damping(v: float, P: Array) -> float:
    out = -linear(v, P[VISCOUS]) - squared(v, P[SQUARE_DAMPING])
    out -= one_sided(v, P[DAMPING_OUT], P[DAMPING_IN])
    if P[DEGRESSIVE] != 0.0:
        out -= degressive(v, P[DEGRESSIVE], P[DEGRESSIVE_RATE])
    return out


@njit(cache=True, error_model="numpy")
def _elastic(x: float, v: float, load: float, z: Array, P: Array, S: Array) -> float:
    out, moved = P[CONSTANT], x - z[Z_BEFORE]
    if P[BOUC_WEN] != 0.0:
        out -= P[BOUC_WEN] * moved_on(z[Z_BOUC], moved / P[BOUC_WEN_TRAVEL], P[BOUC_WEN_GROWTH])
    if P[SLIDERS] != 0.0:
        for k in range(3):
            out -= P[SLIDERS] / 3.0 * slid(z[Z_THREE + k], moved / (THREE[k] * P[SLIDERS_TRAVEL]))
    below, above = S[S_BELOW] + P[STOP_BELOW_DEPTH], S[S_ABOVE] - P[STOP_ABOVE_DEPTH]
    if P[STOP_BELOW] != 0.0 and x < below:
        out += stop(below - x, P[STOP_BELOW], 0.0, -P[STOP_BELOW_LOSS] * v / S[S_RATE])
    if P[STOP_ABOVE] != 0.0 and x > above:
        out -= stop(x - above, P[STOP_ABOVE], 0.0, P[STOP_ABOVE_LOSS] * v / S[S_RATE])
    d = x - S[S_MIDDLE]
    out -= P[SPRING] * d + P[SPRING_CUBIC] * d * d * d + P[SPRING_SQUARE] * d * d
    if P[BACKLASH] != 0.0:
        out += P[BACKLASH] * in_play(x, P[BACKLASH_HALF])
    if P[MASS] != 0.0:
        out -= P[MASS] * pulled(x - z[Z_MASS], v - z[Z_MASS + 1], P[FREQUENCY], P[DAMPING_RATIO], 1.0)
    out -= P[MEMORY] * (x - z[Z_MEMORY])
    return out + missing_pull(load, P[PULL])


@njit(cache=True, error_model="numpy")
def _atoms(x: float, v: float, load: float, z: Array, P: Array, S: Array) -> float:
    out = P[STEADY]
    w = abs(v)
    if v > 0.0:
        for k in range(FEW):
            out -= P[OUT + k] * min(w / S[S_RATES + k], 1.0)
        out -= P[LINES] * v + P[LINES + 2] * v * v
    else:
        for k in range(FEW):
            out += P[IN + k] * min(w / S[S_RATES + k], 1.0)
        out -= P[LINES + 1] * v - P[LINES + 3] * v * v
    out -= P[LOAD_RAMP] * abs(load) / S[S_LOAD] * clipped(v / S[S_RATES + 1], 1.0)
    for k in range(5):
        out -= P[SLID + k] * slid(z[Z_SLID + k], (x - z[Z_BEFORE]) / S[S_SLACKS + k])
    for k in range(STEPS):
        out += P[BELOW + k] * max(0.0, S[S_BELOW + k] - x) - P[ABOVE + k] * max(0.0, x - S[S_ABOVE + k])
    if x < S[S_BELOW + 1]:
        out -= P[TOUCH] * v
    if x > S[S_ABOVE + 1]:
        out -= P[TOUCH + 1] * v
    d = x - S[S_MIDDLE]
    q = d / S[S_SWING]
    out -= P[POWERS] * d + P[POWERS + 1] * d * q + P[POWERS + 2] * d * q * q
    for k in range(3):
        out += P[CENTRE + k] * in_play(x, S[S_CENTRE + k])
        out -= P[LAGGED + k] * (x - z[Z_LAGGED + k])
    return out


def steadied(P: Array, S: Array, mobility: float, h: float) -> tuple[Array, Array]:
    """Values and scales that a step of ``h`` s can integrate.

    A force that turns over within a narrow band of rate is stiff. Where it would change the rate by more than the band
    in a step, the band is widened to what it does change: sticking then shows as creep slower than one step's change.

    Parameters
    ----------
    mobility : rate of change of the rate for a unit of force; 0 where the slot moves nothing
    """
    P, S = P.copy(), S.copy()
    gain = abs(mobility) * h
    if gain == 0.0:
        return P, S
    dry = sum(abs(P[k]) for k in (COULOMB, ONE_SIDED_OUT, ONE_SIDED_IN)) + abs(P[STRIBECK]) * (1.0 + P[STRIBECK_EXTRA])
    S[S_TURNOVER] = max(S[S_TURNOVER], (dry + abs(P[LOADED]) * S[S_LOAD]) * gain)
    P[SOFT_RATE] = max(P[SOFT_RATE], abs(P[SOFT]) * gain)
    for k in range(FEW):
        S[S_RATES + k] = max(S[S_RATES + k], max(abs(P[OUT + k]), abs(P[IN + k])) * gain)
        S[S_SLACKS + k] = max(S[S_SLACKS + k], abs(P[SLID + k]) * gain * h)
    for size, travel in ((PRESLIDING, PRESLIDING_TRAVEL), (BOUC_WEN, BOUC_WEN_TRAVEL), (SLIDERS, SLIDERS_TRAVEL)):
        P[travel] = max(P[travel], abs(P[size]) * gain * h)
    return P, S


def scales_of(travel: Array, rate: Array, load: Array, period: float) -> Array:
    """Scales (SCALES,) from coordinates (M,) along runs near the data; ``period`` s of the slowest motion."""
    S = np.ones(SCALES)
    low, high = (float(v) for v in np.quantile(travel, [0.002, 0.998]))
    swing, fast = max(0.5 * (high - low), 1e-12), max(float(np.quantile(np.abs(rate), 0.95)), 1e-12)
    S[S_RATES : S_RATES + 5] = np.array([0.02, 0.08, 0.25, 0.6, 1.2]) * fast
    S[S_SLACKS : S_SLACKS + 5] = np.array([0.01, 0.05, 0.2, 0.7, 2.0]) * swing
    S[S_BELOW : S_BELOW + 4] = low + np.array([0.0, 0.15, 0.35, 0.6]) * swing
    S[S_ABOVE : S_ABOVE + 4] = high - np.array([0.0, 0.15, 0.35, 0.6]) * swing
    reach = max(abs(low), abs(high), 1e-12)
    S[S_CENTRE : S_CENTRE + 3] = np.array([0.03, 0.12, 0.4]) * reach
    S[S_TIMES : S_TIMES + 3] = np.array([0.02, 0.1, 0.5]) * period
    S[S_MIDDLE], S[S_SWING], S[S_RATE], S[S_TURNOVER] = 0.5 * (low + high), swing, fast, 0.02 * fast
    S[S_LOAD] = max(float(np.quantile(np.abs(load), 0.95)), 1e-12)
    return S
