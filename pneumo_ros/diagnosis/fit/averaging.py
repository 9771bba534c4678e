# SPDX-License-Identifier: Apache-2.0
"""Between the rows of a log and the samples of a fit: means of groups of rows, and rows between coarse ones.

Compiled: a fit asks for both after every simulation, and numpy takes a groupwise mean of few rows in many small loops.

Kernel arguments
----------------
samples, rows : (N, C), any unit
count : rows a mean, or rows wanted in all
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pneumo_ros.arrays import Array


def grouped(samples: Array, count: int) -> Array:
    """Rows in groups of ``count``, (n, count, C); a remainder is dropped."""
    whole = len(samples) // count
    return samples[: whole * count].reshape(whole, count, -1)


@njit(cache=True, nogil=True)
def average(samples: Array, count: int) -> Array:
    """Means (N // count, C) of ``count`` rows; a remainder is dropped."""
    out = np.zeros((samples.shape[0] // count, samples.shape[1]))
    for i in range(out.shape[0]):
        for k in range(count):
            for c in range(out.shape[1]):
                out[i, c] += samples[i * count + k, c]
        for c in range(out.shape[1]):
            out[i, c] *= 1.0 / count
    return out


@njit(cache=True, nogil=True)
def between(rows: Array, count: int) -> Array:
    """(count, C) where every other row is given: the ones between by linear interpolation, after the last its value."""
    out = np.empty((count, rows.shape[1]))
    last = rows.shape[0] - 1
    for i in range(count):
        first = min(i // 2, last)
        second = min(first + i % 2, last)
        for c in range(rows.shape[1]):
            out[i, c] = rows[first, c] if first == second else 0.5 * (rows[first, c] + rows[second, c])
    return out
