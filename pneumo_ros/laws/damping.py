# SPDX-License-Identifier: Apache-2.0
"""Resistance that grows with the rate.

Kernel arguments
----------------
rate : of the place; knee : rate of the same unit above which damping grows ever less
damping, out, back : force for a unit of rate; for positive and for other rates
growth : of the damping with the rate, for a unit of it
"""

from __future__ import annotations

from numba import njit


@njit(cache=True, error_model="numpy", inline="always")
def linear(rate: float, damping: float) -> float:
    """In proportion."""
    return damping * rate


@njit(cache=True, error_model="numpy", inline="always")
def growing(rate: float, damping: float, growth: float) -> float:
    """With a constant that grows, or falls, with the rate: c (1 + b |v|) v."""
    return linear(rate, damping * (1.0 + growth * abs(rate)))


@njit(cache=True, error_model="numpy", inline="always")
def squared(rate: float, damping: float) -> float:
    """With the square of the rate: what is left of :func:`growing` without its constant."""
    return damping * rate * abs(rate)


@njit(cache=True, error_model="numpy", inline="always")
def one_sided(rate: float, out: float, back: float) -> float:
    """Another constant each way."""
    return linear(rate, out if rate > 0.0 else back)


@njit(cache=True, error_model="numpy", inline="always")
def degressive(rate: float, damping: float, knee: float) -> float:
    """Ever less for a unit of rate."""
    return damping * rate / (1.0 + abs(rate) / knee)
