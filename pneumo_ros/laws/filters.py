# SPDX-License-Identifier: Apache-2.0
"""Exact discrete forms of lags and delays for held and for linearly interpolated signals, and play.

Each takes a block of samples and what the block before it left (None before the first), and gives the filtered block
with what it leaves itself: a whole record at once, or one sample at a time, are the same numbers.

Kernel arguments
----------------
a, b : the filter's two states
u, following, last : input: the block (N,) or one sample, the next one, the one before the block
fresh : nothing was filtered yet: the filter rests at the first sample
A, B0, B1, C, D : of :class:`_Form`
half, held, most : half the width of a play, where its follower was, how far one goes in a sample; in the input's
    unit
up, down : share of the way that a follower goes in one sample
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import expm

from pneumo_ros.arrays import Array

NEGLIGIBLE = 1e-5  # s: a lag this short moves nothing at the rates of a rig


class Lag(NamedTuple):
    """What a lag leaves of a block: its two states at the last sample, and that sample."""

    a: float
    b: float
    last: float


class _Form(NamedTuple):
    """y_i = C x_i + D u_i, x_(i+1) = A x_i + B0 u_i + B1 u_(i+1)."""

    A: Array
    B0: Array
    B1: Array
    C: Array
    D: float


@njit(cache=True)
def _next(a: float, b: float, u: float, following: float, A: Array, B0: Array, B1: Array) -> tuple[float, float]:
    return (
        A[0, 0] * a + A[0, 1] * b + B0[0] * u + B1[0] * following,
        A[1, 0] * a + A[1, 1] * b + B0[1] * u + B1[1] * following,
    )


@njit(cache=True, nogil=True)
def _run(
    u: Array, fresh: bool, a: float, b: float, last: float, A: Array, B0: Array, B1: Array, C: Array, D: float
) -> tuple[Array, float, float]:
    """Filtered block and the states at its last sample; a fresh filter rests at the first sample."""
    y = np.empty(u.shape[0])
    for i in range(u.shape[0]):
        if i == 0 and fresh:
            a, b = u[0], 0.0
        else:
            a, b = _next(a, b, last if i == 0 else u[i - 1], u[i], A, B0, B1)
        y[i] = C[0] * a + C[1] * b + D * u[i]
    return y, a, b


def _filtered(u: Array, form: _Form, memory: Lag | None) -> tuple[Array, Lag]:
    u = np.ascontiguousarray(u)
    before = memory or Lag(0.0, 0.0, 0.0)
    y, a, b = _run(u, memory is None, *before, *form)
    return y, Lag(a, b, float(u[-1]))


def _continuous(lag: float, damping: float) -> tuple[Array, Array]:
    w = 1.0 / lag
    return np.array([[0.0, 1.0], [-w * w, -2.0 * damping * w]]), np.array([[0.0], [w * w]])


@lru_cache(maxsize=64)
def _second_order_hold(period: float, lag: float, damping: float) -> _Form:
    A, B = _continuous(lag, damping)
    block = np.zeros((5, 5))
    block[:2, :2], block[:2, 2:3], block[3, 0] = A, B, 1.0
    step = expm(block * period)
    return _Form(step[:2, :2].copy(), step[:2, 2].copy(), np.zeros(2), step[3, :2] / period, float(step[3, 2] / period))


@lru_cache(maxsize=64)
def _second_order_line(period: float, lag: float, damping: float) -> _Form:
    A, B = _continuous(lag, damping)
    block = np.zeros((4, 4))
    block[:2, :2], block[:2, 2:3], block[2, 3] = A, B, 1.0 / period
    step = expm(block * period)
    # The ramp from u_i to u_(i+1): the held part's gain less, and the ramp's gain times, their difference.
    return _Form(step[:2, :2].copy(), step[:2, 2] - step[:2, 3], step[:2, 3].copy(), np.array([1.0, 0.0]), 0.0)


@lru_cache(maxsize=64)
def _first_order_line(period: float, lag: float) -> _Form:
    e = float(np.exp(-period / lag))
    ramp = 1.0 - lag / period * (1.0 - e)
    A = np.array([[e, 0.0], [0.0, 0.0]])
    return _Form(A, np.array([1.0 - e - ramp, 0.0]), np.array([ramp, 0.0]), np.array([1.0, 0.0]), 0.0)


def lagged_hold(
    u: Array, period: float, lag: float, damping: float, memory: Lag | None = None
) -> tuple[Array, Lag | None]:
    """Mean over each period of a held signal seen through a second order lag 1/((lag s)^2 + 2 damping lag s + 1)."""
    return (u, None) if lag < NEGLIGIBLE else _filtered(u, _second_order_hold(period, lag, damping), memory)


def lagged_line(
    u: Array, period: float, lag: float, damping: float, memory: Lag | None = None
) -> tuple[Array, Lag | None]:
    """Samples of a linearly interpolated signal seen through a second order lag."""
    return (u, None) if lag < NEGLIGIBLE else _filtered(u, _second_order_line(period, lag, damping), memory)


def first_order_line(u: Array, period: float, lag: float, memory: Lag | None = None) -> tuple[Array, Lag | None]:
    """Samples of a linearly interpolated signal seen through a first order lag 1/(lag s + 1)."""
    return (u, None) if lag < NEGLIGIBLE else _filtered(u, _first_order_line(period, lag), memory)


def delayed_hold(u: Array, period: float, delay: float, memory: Array | None = None) -> tuple[Array, Array]:
    """Mean over each period of a held signal that arrives ``delay`` s late (any fraction of a sample)."""
    whole = int(np.floor(delay / period))
    part = delay / period - whole
    padded = np.concatenate([np.full(whole + 1, u[0]) if memory is None else memory, u])
    return (1.0 - part) * padded[1 : 1 + len(u)] + part * padded[: len(u)], padded[len(u) :]


@njit(cache=True, nogil=True)
def played(u: Array, half: float, held: float) -> Array:
    """Backlash: the follower (N,) moves only when pushed."""
    y = np.empty_like(u)
    for i in range(u.shape[0]):
        held = min(max(held, u[i] - half), u[i] + half)
        y[i] = held
    return y


def play(u: Array, half: float, memory: float | None = None) -> tuple[Array, float]:
    """Backlash of a block; at rest at its first sample before."""
    y = played(np.ascontiguousarray(u), half, float(u[0]) if memory is None else memory)
    return y, float(y[-1])


@njit(cache=True, nogil=True)
def stuck(u: Array, band: float, held: float) -> Array:
    """What stays until its input (N,) is ``band`` away, then jumps to it (Choudhury, Thornhill, Shah 2005, Control
    Engineering Practice 13, 641-658: slip jump as large as the stick band).
    """
    y = np.empty_like(u)
    for i in range(u.shape[0]):
        if abs(u[i] - held) >= band:
            held = u[i]
        y[i] = held
    return y


def stick(u: Array, band: float, memory: float | None = None) -> tuple[Array, float]:
    """:func:`stuck` of a block; at rest at its first sample before."""
    y = stuck(np.ascontiguousarray(u), band, float(u[0]) if memory is None else memory)
    return y, float(y[-1])


@njit(cache=True, nogil=True)
def followed(u: Array, up: float, down: float, most: float, held: float) -> Array:
    """What follows its input (N,) by a share of the way, one up and one down, and by at most so much a sample."""
    y = np.empty_like(u)
    for i in range(u.shape[0]):
        step = u[i] - held
        step *= up if step > 0.0 else down
        held += min(max(step, -most), most)
        y[i] = held
    return y


@njit(cache=True, nogil=True)
def taken(u: Array, begun: int, period: float, every: float, first: float, held: float) -> tuple[Array, float]:
    """Mean over each row, ``period`` s, of a held signal (N,) that is taken at ``first`` and every ``every`` s from
    there, and kept in between; ``begun`` rows came before.
    """
    y = np.empty_like(u)
    for i in range(u.shape[0]):
        start = (begun + i) * period
        at = first + every * np.ceil((start - first) / every - 1e-9)
        if at < start + period:
            share = (at - start) / period
            y[i] = held * share + u[i] * (1.0 - share)
            held = u[i]
        else:
            y[i] = held
    return y, held


def sampled_hold(
    u: Array, period: float, every: float, phase: float, memory: tuple[int, float] | None = None
) -> tuple[Array, tuple[int, float]]:
    """Mean over each period of a held signal that a part takes at intervals of its own and keeps until the next.

    Parameters
    ----------
    every : s, no less than ``period``
    phase : share of ``every`` that passes from the first row of all until the signal is first taken
    """
    begun, held = (0, float(u[0])) if memory is None else memory
    y, held = taken(np.ascontiguousarray(u), begun, period, max(every, period), phase * every, held)
    return y, (begun + len(u), held)


@njit(cache=True, nogil=True)
def held_means(u: Array, period: float, instants: Array, ends: NDArray[np.int64]) -> Array:
    """What :func:`sampled_hold` makes of a signal, as means over stretches of rows, for many intervals at once: it goes
    from instant to instant and not from row to row.

    Parameters
    ----------
    u : (N,) the signal, which rests at its first value before
    period : s, of its rows
    instants : (K, 2) intervals, s, no less than ``period``, and phases, as :func:`sampled_hold` takes them
    ends : (P + 1,) rows at which the stretches begin, the first at 0, and where the last one ends
    """
    count = ends.shape[0] - 1
    out = np.zeros((instants.shape[0], count))
    for k in range(instants.shape[0]):
        every, stretch, taken_before = instants[k, 0], 0, 0
        at, now, held = instants[k, 1] * every, 0.0, u[0]
        while stretch < count:
            end = ends[stretch + 1] * period
            until = min(at, end)
            out[k, stretch] += held * (until - now)
            now = until
            if at <= end:
                held = u[min(int(at / period + 1e-6), u.shape[0] - 1)]
                taken_before += 1
                at = (instants[k, 1] + taken_before) * every
            if now >= end:
                stretch += 1
        for stretch in range(count):
            out[k, stretch] /= (ends[stretch + 1] - ends[stretch]) * period
    return out


def slewed(u: Array, most: float) -> Array:
    """What follows its input (N,) by at most so much a sample, from where that begins."""
    return np.asarray(followed(np.ascontiguousarray(u), 1.0, 1.0, most, float(u[0])))


def delayed_line(u: Array, period: float, delay: float) -> Array:
    """Samples of a linearly interpolated signal that arrives ``delay`` s late, resting at its first value before."""
    rows = np.arange(len(u))
    return np.asarray(np.interp(rows - delay / period, rows, u))
