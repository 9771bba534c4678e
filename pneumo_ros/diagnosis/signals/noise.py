# SPDX-License-Identifier: Apache-2.0
"""White sensor noise, estimated from the data alone."""

from __future__ import annotations

from collections.abc import Iterable
from math import comb
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.arrays import Array

ORDERS: Final = (2, 3, 4, 5, 6)  # orders of the differences that noise is estimated from [numerics]
MIN_SAMPLES: Final = 20  # samples at least [numerics]
# rows in which a drive's gain counts as constant: 0.2 s at 500 Hz, in which the body moves little, and enough rows
# for a handful of gains. A chattering command writes a random walk into the pressure, which no difference takes away:
# of a walk's step s, s / 2 stays [physics]
WINDOW: Final = 100
LONGEST_DELAY: Final = 25  # rows within which a command's onset is looked for [taste]
# Rows after the delay: a delay that is no whole number of samples spreads an onset over two [definition]
ONSET: Final = (0, 1)
ONSET_ORDER: Final = 4  # order of the difference in which an onset is looked for [numerics]
# Share of the estimate that a drive must bring it down to: the least of many estimates lies low by itself [taste]
WORTH: Final = 0.9
RANK: Final = 1e-8  # of the largest singular value, below which a cause is another one's multiple [numerics]


def white_noise(
    values: NDArray[np.float64], weight: NDArray[np.float64], drive: NDArray[np.float64] | None = None
) -> float:
    """Standard deviation of the white noise in a channel; NaN with too few samples.

    Parameters
    ----------
    values, weight : (N,) uniform samples; differences touching a filled sample are left out
    drive : (N, k) held inputs that enter the channel's rate, row i from sample i to i + 1; None where there are none

    Differencing m times takes a smooth signal away and multiplies white noise by sqrt(C(2m, m)). What a drive steps
    from sample to sample is regressed out, its delay found first. Each order gives an upper bound (what is left of the
    signal adds to it), so the smallest is taken; each is a median, which shocks do not move. The floor is what rounding
    to a step q leaves, q / sqrt(12).
    """
    columns = _moving(drive)
    found = _least(_from_differences(values, weight, order) for order in ORDERS)
    if columns is not None and np.isfinite(found):
        delay = _delay(values, weight, columns)
        beside = _least(_beside_drive(values, weight, columns, delay, order) for order in ORDERS)
        found = beside if beside < WORTH * found else found
    return max(found, quantum(values[weight > 0]) / np.sqrt(12.0)) if np.isfinite(found) else found


def _least(estimates: Iterable[float]) -> float:
    return min((estimate for estimate in estimates if np.isfinite(estimate)), default=float("nan"))


def quantum(values: NDArray[np.float64]) -> float:
    """Smallest step between distinct values where the data are visibly quantised, else 0."""
    distinct = np.unique(values)
    if len(distinct) < 2 or len(distinct) > len(values) / 4:
        return 0.0
    return float(np.diff(distinct).min())


def _whole(weight: Array, order: int) -> NDArray[np.bool_]:
    """Differences that touch no filled sample."""
    return np.asarray(np.convolve(weight, np.ones(order + 1), mode="valid") > order + 0.5)


def _spread(rest: Array, order: int) -> float:
    return float(np.median(np.abs(rest)) / 0.6745 / np.sqrt(comb(2 * order, order)))


def _from_differences(values: Array, weight: Array, order: int) -> float:
    whole = _whole(weight, order)
    if np.count_nonzero(whole) < MIN_SAMPLES:
        return float("nan")
    return _spread(np.diff(values, n=order)[whole], order)


def _moving(drive: Array | None) -> Array | None:
    """Columns that change, each to a standard deviation of 1."""
    if drive is None:
        return None
    std = drive.std(axis=0)
    moving = std > 1e-6 * np.abs(drive).max(axis=0)
    return drive[:, moving] / std[moving] if moving.any() else None


def _delay(values: Array, weight: Array, drive: Array) -> int:
    """Rows from a command to its onset in the channel: where the drive explains most of the differences.

    Not where both agree best: a loop's command follows what it did a few rows before, and agrees there as well. One
    row off, half of what the command carries into the channel counts as noise.
    """
    longest = min(LONGEST_DELAY, len(values) // 4)
    left = [_beside_drive(values, weight, drive, late, ONSET_ORDER) for late in range(longest)]
    found = [(estimate, late) for late, estimate in enumerate(left) if np.isfinite(estimate)]
    return min(found)[1] if found else 0


def _beside_drive(values: Array, weight: Array, drive: Array, delay: int, order: int) -> float:
    """As :func:`_from_differences`, of what the drive does not explain in each window."""
    rest, whole = np.diff(values, n=order), _whole(weight, order)
    steps = np.diff(drive, n=order - 1, axis=0)[: len(rest)]
    late = [delay + onset for onset in ONSET]
    first = max(late)
    causes = np.column_stack([steps[first - k : len(steps) - k] for k in late])
    rest, whole = rest[first:], whole[first:]
    windows, rows = len(rest) // WINDOW, len(rest) // WINDOW * WINDOW
    if not windows:
        return float("nan")
    shape = (windows, WINDOW)
    pooled = _unexplained(rest[:rows].reshape(shape), causes[:rows].reshape(*shape, -1), whole[:rows].reshape(shape))
    return _spread(pooled, order) if len(pooled) >= MIN_SAMPLES else float("nan")


def _unexplained(rest: Array, causes: Array, whole: NDArray[np.bool_]) -> Array:
    """Residuals of a least-squares fit of the causes in each window, scaled up for the degrees of freedom it used.

    Parameters
    ----------
    rest, causes, whole : (W, n), (W, n, k), (W, n); rows that are not ``whole`` are left out, and windows with too few
    """
    rows = np.count_nonzero(whole, axis=1)
    enough = rows >= max(MIN_SAMPLES, 4 * causes.shape[2])
    rest, causes, whole, rows = rest[enough], causes[enough], whole[enough], rows[enough]
    if not len(rest):
        return np.empty(0)
    # One decomposition for all: a row of nothing takes no part in a fit.
    left, size, _ = np.linalg.svd(np.where(whole[:, :, None], causes, 0.0), full_matrices=False)
    acting = size > RANK * size[:, :1]
    explained = np.einsum("wnk,wk->wn", left, acting * np.einsum("wnk,wn->wk", left, np.where(whole, rest, 0.0)))
    scale = np.sqrt(rows / (rows - np.count_nonzero(acting, axis=1)))
    return np.asarray(((rest - explained) * scale[:, None])[whole])
