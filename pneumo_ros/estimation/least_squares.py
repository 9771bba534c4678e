# SPDX-License-Identifier: Apache-2.0
"""Estimating parameters a of Y = W a + Psi from prediction errors (Eqs. 6.44-6.51; errata 9: rates).

One recursion serves all of Section 6.6.1; they differ in the forgetting factor lambda_f, 1/s:

* ``least_squares``: lambda_f = 0 (Eq. 6.49),
* ``exponential``: lambda_f = lambda_0,
* ``bounded``: lambda_f = lambda_0 (1 - |P|/k_0) (Eq. 6.51), so that P stays below k_0 when nothing excites it,
* ``gradient``: no memory, d(a)/dt = -p W^T e (Eq. 6.47).

How to choose. Where W is invertible at every instant, as here, P settles at lambda_f (W^T W)^-1 and the estimate
follows the parameter with the time constant 1/lambda_f: lambda_0 is the bandwidth, traded against the noise of Y. k_0
only matters without excitation; ten times the settled |P| is enough. Scale a so that its entries are near 1 and Y so
that its rows have one unit; P is then in (unit of Y)^-2 s^-1.

Discrete form. With Y, W held over a period T, R = P^-1 obeys a linear equation whose exact solution is
R+ = e^(-lambda T) R + g W^T W, g = (1 - e^(-lambda T))/lambda, and R+ a+ = e^(-lambda T) R a + g W^T (Y - Psi).
Written in P it cannot blow up at any gain or rate: the error shrinks by the factor e^(-lambda T) R+^-1 R <= 1. An
explicit Euler step of Eqs. 6.50 and 6.53 loses positive P at lambda_0 T of order 1. The gradient step is implicit for
the same reason.

Kernel arguments
----------------
method : index into :data:`METHODS`
P, M : (1, 1) or (2, 2) symmetric and positive; P is the gain
forgetting, bound : lambda_0, 1/s, and k_0, the largest norm of P (Eq. 6.51)
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

METHODS = ("gradient", "least_squares", "exponential", "bounded")
GRADIENT, LEAST_SQUARES, EXPONENTIAL, BOUNDED = range(4)


def initial_gain(size: int, gain: float) -> NDArray[np.float64]:
    """P(0) = gain times the identity, (size, size)."""
    return gain * np.eye(size)


@njit(cache=True)
def norm(P: NDArray[np.float64]) -> float:
    """Largest eigenvalue of a symmetric positive 1 x 1 or 2 x 2 matrix: |P| of Eq. 6.51."""
    if P.shape[0] == 1:
        return P[0, 0]
    mean, half = 0.5 * (P[0, 0] + P[1, 1]), 0.5 * (P[0, 0] - P[1, 1])
    return mean + math.sqrt(half * half + P[0, 1] * P[1, 0])


@njit(cache=True)
def forgetting_factor(method: int, P: NDArray[np.float64], forgetting: float, bound: float) -> float:
    """lambda_f of a method, 1/s."""
    if method == BOUNDED:
        return forgetting * max(0.0, 1.0 - norm(P) / bound)
    return forgetting if method == EXPONENTIAL else 0.0


@njit(cache=True)
def _inverse(M: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of a symmetric positive 1 x 1 or 2 x 2 matrix, symmetric to the last bit."""
    out = np.empty_like(M)
    if M.shape[0] == 1:
        out[0, 0] = 1.0 / M[0, 0]
        return out
    det = M[0, 0] * M[1, 1] - M[0, 1] * M[0, 1]
    out[0, 0], out[1, 1] = M[1, 1] / det, M[0, 0] / det
    out[0, 1] = out[1, 0] = -M[0, 1] / det
    return out


@njit(cache=True, error_model="numpy")
def update(
    method: int,
    a: NDArray[np.float64],
    P: NDArray[np.float64],
    W: NDArray[np.float64],
    residual: NDArray[np.float64],
    forgetting: float,
    bound: float,
    period: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """One step: new parameters (K,) and gain (K, K).

    Parameters
    ----------
    method : index into :data:`METHODS`
    a, P : parameters (K,) and gain (K, K), K = 1 or 2; for the gradient P is p and stays
    W : (M, K) regressor
    residual : (M,) Y - Psi - W a, minus the prediction error e1 of Eq. 6.46
    forgetting : lambda_0, 1/s
    bound : k_0
    period : s
    """
    size = a.shape[0]
    if method == GRADIENT:
        weight, grown = period, P
    else:
        factor = forgetting_factor(method, P, forgetting, bound)
        weight = -math.expm1(-factor * period) / factor if factor > 1e-12 else period
        grown = P / math.exp(-factor * period)
    information = _inverse(grown)
    for i in range(size):
        for j in range(size):
            for m in range(W.shape[0]):
                information[i, j] += weight * W[m, i] * W[m, j]
    gain = _inverse(information)
    new = a.copy()
    for i in range(size):
        for j in range(size):
            for m in range(W.shape[0]):
                new[i] += weight * gain[i, j] * W[m, j] * residual[m]
    return new, (P if method == GRADIENT else gain)
