# SPDX-License-Identifier: Apache-2.0
"""The lengths that a diagnosis measures time by: blocks, averages, settling, correlation.

A half car's log at 500 Hz, a tank sampled every 4 s and a circuit at 610 Hz have nothing in common but that each has a
slowest and a fastest motion: :func:`pace_of_signals` reads it off the data.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array

FEWEST_BLOCKS: Final = 9  # blocks of a whole record at least: three folds of three [numerics]
MOST_BLOCKS: Final = 48  # blocks of a whole record at most: shorter ones tell no more [taste]
PERIODS: Final = 1.5  # of the slowest motion in a block, where the record is long enough [taste]
FASTEST: Final = 0.99  # share of a channel's power below its bandwidth [taste]
SAMPLES: Final = 20.0  # fit samples in the period of the fastest motion [numerics]
FEWEST_FREE: Final = 30.0  # samples that a record is worth, however smooth: what is left of it need not be [taste]
FEWEST_SAMPLES: Final = 240  # fit samples of a record that averaging leaves [numerics]
SHORTEST_SETTLE: Final = 8  # rows from which the initial state is refined, at least [numerics]
SETTLED: Final = 0.25  # periods of the slowest motion from which the initial state is refined [taste]
LONGEST_SETTLE: Final = 0.1  # share of the record from which the initial state is refined, at most [taste]


@dataclass(frozen=True)
class Pace:
    """Lengths of a record.

    Attributes
    ----------
    block : s, length of a time block; every third one is kept from the fit
    averaged : rows in one fit sample
    correlation : fit samples that count as one
    settle : s at the start of a held-out log from which its initial state is refined
    wander : s, length of the blocks that intervals draw from the held-out log
    period : s, of the slowest motion
    """

    block: float = 1.25
    averaged: int = 5
    correlation: float = 10.0
    settle: float = 0.2
    wander: float = 1.0
    period: float = 0.5


HALF_CAR: Final = Pace()  # lengths of the half car: body at about 2 Hz, wheel hop at 9 Hz, logs at 500 Hz [physics]


def pace_of_signals(measured: Array, period: float, noise: Array | None = None) -> Pace:
    """The pace of (N, C) uniform samples, ``period`` s apart, of noise (C,).

    Blocks hold the slowest motion, averages keep the fastest, and a free run's error is worth as many samples as the
    signal has degrees of freedom (twice its bandwidth times its length), but not less than :data:`FEWEST_FREE`.
    """
    rows = len(measured)
    slow, fast = motions(measured, period, noise)
    whole = rows * period
    block = float(np.clip(PERIODS / slow, whole / MOST_BLOCKS, whole / FEWEST_BLOCKS))
    averaged = int(np.clip(min(1.0 / (SAMPLES * fast * period), rows / FEWEST_SAMPLES), 1, 50))
    correlation = max(1.0, min(1.0 / (2.0 * fast * averaged * period), rows / averaged / FEWEST_FREE))
    settle = float(np.clip(SETTLED / slow, SHORTEST_SETTLE * period, max(LONGEST_SETTLE * whole, period)))
    return Pace(block, averaged, correlation, settle, min(block, whole / 5.0), 1.0 / slow)


def motions(measured: Array, period: float, noise: Array | None = None) -> tuple[float, float]:
    """Frequencies (Hz) of the slowest strong motion and below which nearly all power lies; medians over channels."""
    rows = len(measured)
    lowest = 1.0 / (rows * period)
    if rows < 16:
        return lowest, 0.5 / period
    sigma = np.zeros(measured.shape[1]) if noise is None else noise
    found = [_band(column, period, s) for column, s in zip(measured.T, sigma, strict=True) if np.std(column) > 0.0]
    if not found:
        return lowest, 4.0 * lowest
    slow, fast = np.median(np.array(found), axis=0)
    return float(max(slow, lowest)), float(np.clip(fast, 2.0 * lowest, 0.5 / period))


def _band(column: Array, period: float, sigma: float) -> tuple[float, float]:
    window = np.hanning(len(column))
    power = np.abs(np.fft.rfft((column - column.mean()) * window)) ** 2
    power = np.maximum(power - 4.0 * sigma**2 * float(window @ window), 1e-12 * power.max())
    frequency = np.fft.rfftfreq(len(column), period)
    share = np.cumsum(power) / power.sum()
    slow = frequency[int(np.searchsorted(share, 0.5))]
    return float(slow), float(frequency[min(int(np.searchsorted(share, FASTEST)), len(frequency) - 1)])
