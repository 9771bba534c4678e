# SPDX-License-Identifier: Apache-2.0
"""Laws and atoms of a signal on its way: into the rig (an actuator) or into the log (a sensor).

``P`` are the values of all laws and atoms (0: absent), in the signal's unit, seconds or shares; ``S`` its scales. Whole
logs pass at once: first what the value alone decides, then what takes time.
"""

from __future__ import annotations

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.laws.filters import delayed_line, first_order_line, lagged_line, play, slewed
from pneumo_ros.laws.signal import bent, crept, dead, scaled_about

# Laws: columns of P.
GAIN, OFFSET, SQUARE, CUBE = 0, 1, 2, 3
LAG, SECOND_LAG, DELAY = 4, 5, 6
DEAD, CUT, SOFT_CUT, PLAY = 7, 8, 9, 10
SLOWNESS = 11  # s for each unit: the rate it cannot exceed, turned over
LAWS = 12
CRITICAL = 1.0  # damping ratio of a lag's two equal poles

# Atoms.
POWERS = LAWS  # constant, linear, square, cube
CORNERS = POWERS + 4  # what a dead zone of S_DEAD takes away
LIMITS = CORNERS + 3  # what a limit at S_LIMITS takes away
PLAYS = LIMITS + 3  # shares that pass a play of S_PLAYS
LAGS = PLAYS + 3  # shares that pass a lag of S_LAGS
DELAYS = LAGS + 4  # shares that are S_DELAYS late
CREEPS = DELAYS + 3  # what a zero that creeps in S_CREEPS ends at
VALUES = CREEPS + 4

# Scales.
S_DEAD, S_LIMITS, S_PLAYS, S_LAGS, S_DELAYS = 0, 3, 6, 9, 13
S_MIDDLE, S_SWING, S_PEAK = 16, 17, 18
S_CREEPS = 19
SCALES = 23


def _lagged(u: Array, period: float, lag: float) -> Array:
    """First order lag of a linearly interpolated signal that has rested at its first value."""
    return first_order_line(np.ascontiguousarray(u), period, lag)[0]


def _static(u: Array, P: Array, S: Array) -> Array:
    """What the value alone decides."""
    q = (u - S[S_MIDDLE]) / S[S_SWING]
    out = scaled_about(u, P[GAIN], 0.0) + P[OFFSET] + S[S_SWING] * bent(q, (2, 3), (P[SQUARE], P[CUBE]))
    out += S[S_SWING] * bent(q, range(4), P[POWERS:CORNERS].tolist())
    if P[DEAD] != 0.0:
        out -= dead(u, P[DEAD])
    if P[CUT] != 0.0:
        limit = S[S_PEAK] * (1.0 - P[CUT])
        out = np.clip(out, -limit, limit)
    if P[SOFT_CUT] != 0.0:
        out = out / (1.0 + P[SOFT_CUT] * (out / S[S_PEAK]) ** 2)
    for k in range(3):
        if P[CORNERS + k] != 0.0:
            out -= P[CORNERS + k] * dead(u, S[S_DEAD + k])
        if P[LIMITS + k] != 0.0:
            out -= P[LIMITS + k] * (u - np.clip(u, -S[S_LIMITS + k], S[S_LIMITS + k]))
    return np.asarray(out)


def passed(u: Array, period: float, P: Array, S: Array) -> Array:
    """A signal (N,) after its way; not finite where a wild error is."""
    with np.errstate(over="ignore", invalid="ignore"):
        return _passed(u, period, P, S)


def _passed(u: Array, period: float, P: Array, S: Array) -> Array:
    out = _static(u, P, S)
    if P[PLAY] != 0.0:
        out = play(out, P[PLAY])[0]
    if P[SLOWNESS] != 0.0:
        out = slewed(out, period / P[SLOWNESS])
    if P[LAG] != 0.0:
        out = _lagged(out, period, P[LAG])
    if P[SECOND_LAG] != 0.0:
        out = lagged_line(out, period, P[SECOND_LAG], CRITICAL)[0]
    if P[DELAY] != 0.0:
        out = delayed_line(out, period, P[DELAY])
    shared = np.zeros_like(out)
    for first, count, scale, way in (
        (PLAYS, 3, S_PLAYS, lambda s: play(out, s)[0]),
        (LAGS, 4, S_LAGS, lambda s: _lagged(out, period, s)),
        (DELAYS, 3, S_DELAYS, lambda s: delayed_line(out, period, s)),
    ):
        for k in range(count):
            if P[first + k] != 0.0:
                shared += P[first + k] * (way(float(S[scale + k])) - out)
    return np.asarray(out + shared + _crept(len(u), period, P, S))


def _crept(rows: int, period: float, P: Array, S: Array) -> Array:
    """How far the zero has moved since the log began, from where it stood then."""
    time = np.arange(rows, dtype=float) * period
    moved = np.zeros(rows)
    for k in range(4):
        if P[CREEPS + k] != 0.0:
            moved += P[CREEPS + k] * crept(time, float(S[S_CREEPS + k]))
    return moved


def undone(y: Array, P: Array, S: Array, rounds: int = 8) -> Array:
    """What a sensor with these values alone was shown to read ``y``, by fixed point; ways that take time are left."""
    still = P.copy()
    still[[LAG, SECOND_LAG, DELAY, PLAY, CUT, SLOWNESS]] = 0.0
    still[PLAYS:VALUES] = 0.0
    true = y.copy()
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(rounds):
            true = true - (_static(true, still, S) - y)
    return np.where(np.isfinite(true), true, y)


def scales_of(u: Array, period: float) -> Array:
    """Scales (SCALES,) from a signal's samples; ``period`` s of its slowest motion."""
    S = np.ones(SCALES)
    peak = max(float(np.quantile(np.abs(u), 0.998)), 1e-12)
    low, high = (float(v) for v in np.quantile(u, [0.002, 0.998]))
    swing = max(0.5 * (high - low), 1e-12)
    S[S_DEAD : S_DEAD + 3] = np.array([0.03, 0.12, 0.35]) * peak
    S[S_LIMITS : S_LIMITS + 3] = np.array([0.5, 0.75, 0.9]) * peak
    S[S_PLAYS : S_PLAYS + 3] = np.array([0.03, 0.12, 0.35]) * swing
    S[S_LAGS : S_LAGS + 4] = np.array([0.005, 0.02, 0.08, 0.3]) * period
    S[S_DELAYS : S_DELAYS + 3] = np.array([0.01, 0.04, 0.15]) * period
    S[S_CREEPS : S_CREEPS + 4] = np.array([1.0, 4.0, 15.0, 60.0]) * period
    S[S_MIDDLE], S[S_SWING], S[S_PEAK] = 0.5 * (low + high), swing, peak
    return S
