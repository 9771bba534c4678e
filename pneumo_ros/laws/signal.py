# SPDX-License-Identifier: Apache-2.0
"""Errors of a signal that its value alone decides, and a zero that creeps; what takes time is in
:mod:`pneumo_ros.laws.filters`. Arrays of any shape, in the signal's unit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumo_ros.arrays import Array


def scaled(u: Array, error: float) -> Array:
    """A sensitivity that is off by a share, about zero: as a product, which a division undoes to the last digit."""
    return np.asarray(u * (1.0 + error))


def unscaled(y: Array, error: float) -> Array:
    """What :func:`scaled` was given."""
    return np.asarray(y / (1.0 + error))


def scaled_about(u: Array, error: float, pivot: float) -> Array:
    """A sensitivity that is off by a share, about a value that is read right."""
    return np.asarray(u + error * (u - pivot))


def unscaled_about(y: Array, error: float, pivot: float) -> Array:
    """What :func:`scaled_about` was given."""
    return np.asarray((y + error * pivot) / (1.0 + error))


def bent(q: Array, powers: Sequence[int], values: Sequence[float]) -> Array:
    """A sensitivity that is not constant: sum of values times powers of the signal about its middle, over its swing."""
    out = np.zeros_like(q)
    for value, power in zip(values, powers, strict=False):
        if value != 0.0:
            out += value * q**power
    return out


def dead(u: Array, half: float) -> Array:
    """What a dead zone about zero takes away; of a signal that is never negative, an overlap."""
    return np.asarray(np.clip(u, -half, half))


def crept(time: Array, tau: float) -> Array:
    """How far towards its end a zero has crept since ``time`` (s) was 0."""
    return np.asarray(1.0 - np.exp(-time / tau))
