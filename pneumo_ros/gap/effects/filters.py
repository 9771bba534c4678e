"""Exact discrete forms of lags and delays for held and for linearly interpolated signals."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import expm

Array = NDArray[np.float64]
NEGLIGIBLE = 1e-5  # s: a lag this short moves nothing at the rates of a rig


@njit(cache=True)
def _run(u: Array, A: Array, B0: Array, B1: Array, C: Array, D: float) -> Array:
    """y_i = C x_i + D u_i, x_(i+1) = A x_i + B0 u_i + B1 u_(i+1), from rest at u_0."""
    y = np.empty(u.shape[0])
    a, b = u[0], 0.0
    for i in range(u.shape[0]):
        y[i] = C[0] * a + C[1] * b + D * u[i]
        following = u[i + 1] if i + 1 < u.shape[0] else u[i]
        a, b = (
            A[0, 0] * a + A[0, 1] * b + B0[0] * u[i] + B1[0] * following,
            A[1, 0] * a + A[1, 1] * b + B0[1] * u[i] + B1[1] * following,
        )
    return y


def _continuous(lag: float, damping: float) -> tuple[Array, Array]:
    w = 1.0 / lag
    return np.array([[0.0, 1.0], [-w * w, -2.0 * damping * w]]), np.array([[0.0], [w * w]])


def lagged_hold(u: Array, period: float, lag: float, damping: float) -> Array:
    """Mean over each period of a held signal seen through a second order lag 1/((lag s)^2 + 2 damping lag s + 1)."""
    if lag < NEGLIGIBLE:
        return u
    A, B = _continuous(lag, damping)
    block = np.zeros((5, 5))
    block[:2, :2], block[:2, 2:3], block[3, 0] = A, B, 1.0
    step = expm(block * period)
    zero = np.zeros(2)
    return _run(
        np.ascontiguousarray(u),
        step[:2, :2].copy(),
        step[:2, 2].copy(),
        zero,
        step[3, :2] / period,
        step[3, 2] / period,
    )


def lagged_line(u: Array, period: float, lag: float, damping: float) -> Array:
    """Samples of a linearly interpolated signal seen through a second order lag."""
    if lag < NEGLIGIBLE:
        return u
    A, B = _continuous(lag, damping)
    block = np.zeros((4, 4))
    block[:2, :2], block[:2, 2:3], block[2, 3] = A, B, 1.0 / period
    step = expm(block * period)
    # The ramp from u_i to u_(i+1): the held part's gain less, and the ramp's gain times, their difference.
    return _run(
        np.ascontiguousarray(u),
        step[:2, :2].copy(),
        step[:2, 2] - step[:2, 3],
        step[:2, 3].copy(),
        np.array([1.0, 0.0]),
        0.0,
    )


def first_order_line(u: Array, period: float, lag: float) -> Array:
    """Samples of a linearly interpolated signal seen through a first order lag 1/(lag s + 1)."""
    if lag < NEGLIGIBLE:
        return u
    e = float(np.exp(-period / lag))
    ramp = 1.0 - lag / period * (1.0 - e)
    A = np.array([[e, 0.0], [0.0, 0.0]])
    return _run(
        np.ascontiguousarray(u), A, np.array([1.0 - e - ramp, 0.0]), np.array([ramp, 0.0]), np.array([1.0, 0.0]), 0.0
    )


def delayed_hold(u: Array, period: float, delay: float) -> Array:
    """Mean over each period of a held signal that arrives ``delay`` s late (any fraction of a sample)."""
    whole = int(np.floor(delay / period))
    part = delay / period - whole
    padded = np.concatenate([np.full(whole + 1, u[0]), u])
    return (1.0 - part) * padded[1 : 1 + len(u)] + part * padded[: len(u)]
