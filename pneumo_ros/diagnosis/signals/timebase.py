# SPDX-License-Identifier: Apache-2.0
"""One uniform time base from topics with their own rates, starts, jitter and gaps."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.signals.types import TopicData, TopicTiming
from pneumo_ros.errors import InputError

BACK_JUMP: Final = 0.1  # s: stamps further back than this are a clock set back, not samples out of order [taste]
INPUT_GAP: Final = 0.25  # s: longer without command or road, the model cannot be driven across [taste]


class Monotone(NamedTuple):
    """Samples of a topic in order of time, with what had to be done for it."""

    data: TopicData
    reordered: int
    repeated: int


def split_at_jumps(data: TopicData) -> list[TopicData]:
    """The pieces between places where the clock was set back by more than ``BACK_JUMP``."""
    cuts = np.flatnonzero(np.diff(data.stamp) < -BACK_JUMP) + 1
    edges = [0, *cuts.tolist(), len(data.stamp)]
    return [_rows(data, np.arange(i, j)) for i, j in pairwise(edges)]


def in_order(data: TopicData) -> Monotone:
    """Sort samples that arrived a little out of order and drop repeated stamps (the first one stays)."""
    order = np.argsort(data.stamp, kind="stable")
    stamps = data.stamp[order]
    fresh = np.concatenate([[True], np.diff(stamps) > 0.0]) if len(stamps) else np.zeros(0, dtype=bool)
    reordered = int(np.count_nonzero(np.diff(data.stamp) < 0.0))
    return Monotone(_rows(data, order[fresh]), reordered, int(np.count_nonzero(~fresh)))


def _rows(data: TopicData, rows: NDArray[np.intp]) -> TopicData:
    received = None if data.received is None else data.received[rows]
    return TopicData(data.stamp[rows], {name: values[rows] for name, values in data.channels.items()}, received)


def timing(topic: str, data: TopicData, origin: float) -> TopicTiming:
    """Rate, jitter and gaps of a topic whose stamps are in order; ``origin`` s is the log's row 0."""
    steps = np.diff(data.stamp)
    period = float(np.median(steps)) if len(steps) else float("nan")
    missing = np.round(steps[steps > 1.5 * period] / period - 1.0).sum() if len(steps) else 0
    latency = float("nan") if data.received is None else float(np.median(data.received - data.stamp))
    jitter = 1.4826 * float(np.median(np.abs(steps - period))) if len(steps) else float("nan")
    return TopicTiming(
        topic,
        len(data.stamp),
        1.0 / period if period > 0 else float("nan"),
        float(data.stamp[0] - origin),
        float(data.stamp[-1] - origin),
        jitter,
        int(missing),
        float(steps.max()) if len(steps) else 0.0,
        latency,
    )


def uniform_grid(start: float, end: float, period: float) -> Array:
    """Times from ``start`` to not beyond ``end``, s; a rounding error short of the last one does not lose it."""
    count = int(np.floor((end - start) / period + 1e-3)) + 1
    return np.asarray(start + period * np.arange(count), dtype=float)


def sampled(stamp: Array, values: Array, grid: Array, period: float) -> tuple[Array, Array]:
    """A measured channel on the grid: values (N,) and weights (N,), 1 where a real sample is within half a period.

    Between samples an Akima spline is used: local, so that a gap or a shock does not ring into its neighbours, and of
    third order, because linear interpolation would already lose 2 % at wheel hop with 100 Hz.
    """
    real = np.isfinite(values)
    stamp, values = stamp[real], values[real]
    if len(stamp) < 3:
        return np.zeros(len(grid)), np.zeros(len(grid))
    nearest = nearest_index(stamp, grid)
    off = np.abs(stamp[nearest] - grid)
    weight = (off <= 0.5 * period * (1.0 + 1e-6)).astype(float)
    if np.all(off[weight > 0] < 1e-3 * period):
        filled = np.interp(grid, stamp, values)
        filled[weight > 0] = values[nearest[weight > 0]]
        return filled, weight
    inside = np.clip(grid, stamp[0], stamp[-1])
    return Akima1DInterpolator(stamp - grid[0], values)(inside - grid[0]), weight


def nearest_index(stamp: Array, grid: Array) -> NDArray[np.intp]:
    """Index of the sample nearest to each grid time."""
    right = np.clip(np.searchsorted(stamp, grid), 1, len(stamp) - 1)
    left = right - 1
    return np.where(grid - stamp[left] <= stamp[right] - grid, left, right)


def held(stamp: Array, values: Array, grid: Array, period: float) -> Array:
    """A held command on the grid: its mean over each grid interval, so that the air let in is what was commanded."""
    real = np.isfinite(values)
    stamp, values = stamp[real] - grid[0], values[real]
    edges = np.append(grid, grid[-1] + period) - grid[0]
    if len(stamp) == len(grid) and np.all(np.abs(stamp - edges[:-1]) < 1e-3 * period):
        return values.copy()
    # Integral of the staircase at its corners, continued at both ends by the first and last value.
    ends = np.concatenate([[min(edges[0], stamp[0]) - period], stamp, [max(edges[-1], stamp[-1]) + period]])
    levels = np.concatenate([[values[0]], values])
    total = np.concatenate([[0.0], np.cumsum(levels * np.diff(ends))])
    return np.diff(np.interp(edges, ends, total)) / period


def drivable_span(stamps: list[Array], origin: str, holes: Sequence[tuple[float, float]] = ()) -> tuple[float, float]:
    """Longest span outside ``holes`` in which every one of these topics has no gap longer than ``INPUT_GAP``, s.

    Raises
    ------
    InputError
        if the topics do not overlap in time.
    """
    start, end = max(s[0] for s in stamps), min(s[-1] for s in stamps)
    if end <= start:
        raise InputError("the topics do not overlap in time", where=origin, remedy="check the clocks of their writers")
    all_gaps = [*holes, *(gap for s in stamps for gap in _gaps(s))]
    gaps = sorted(gap for gap in all_gaps if gap[1] > start and gap[0] < end)
    spans, left = [], start
    for begin, finish in gaps:
        spans.append((left, begin))
        left = max(left, finish)
    spans.append((left, end))
    return max(spans, key=lambda span: span[1] - span[0])


def _gaps(stamp: Array) -> list[tuple[float, float]]:
    wide = np.flatnonzero(np.diff(stamp) > INPUT_GAP)
    return [(float(stamp[i]), float(stamp[i + 1])) for i in wide]
