"""White sensor noise, estimated from the data alone."""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray

ORDERS = (2, 3, 4, 5, 6)
MIN_SAMPLES = 20


def white_noise(values: NDArray[np.float64], weight: NDArray[np.float64]) -> float:
    """Standard deviation of the white noise in a channel; NaN with too few samples.

    Parameters
    ----------
    values, weight : (N,) uniform samples; differences touching a filled sample are left out

    Differencing m times takes a smooth signal away and multiplies white noise by sqrt(C(2m, m)). Each order gives an
    upper bound (what is left of the signal adds to it), so the smallest is taken; the median is deaf to shocks.
    Half a quantisation step is the floor, uniform over a step: q / sqrt(12).
    """
    estimates = [_from_differences(values, weight, order) for order in ORDERS]
    finite = [estimate for estimate in estimates if np.isfinite(estimate)]
    if not finite:
        return float("nan")
    return max(min(finite), quantum(values[weight > 0]) / np.sqrt(12.0))


def quantum(values: NDArray[np.float64]) -> float:
    """Smallest step between distinct values where the data are visibly quantised, else 0."""
    distinct = np.unique(values)
    if len(distinct) < 2 or len(distinct) > len(values) / 4:
        return 0.0
    return float(np.diff(distinct).min())


def _from_differences(values: NDArray[np.float64], weight: NDArray[np.float64], order: int) -> float:
    whole = np.convolve(weight, np.ones(order + 1), mode="valid") > order + 0.5
    if np.count_nonzero(whole) < MIN_SAMPLES:
        return float("nan")
    rest = np.diff(values, n=order)[whole]
    return float(np.median(np.abs(rest)) / 0.6745 / np.sqrt(comb(2 * order, order)))
