# SPDX-License-Identifier: Apache-2.0
"""What the laws share: the tracking error of one output, the gains, and the boundary layer.

The sliding laws take a surface S of Eqs. 6.24-6.25 and make S^2/2 fall (Eqs. 6.26-6.30): the wanted third derivative is
what puts S' = -K_s sat(S) (Eqs. 6.34-6.39).

Kernel arguments
----------------
surface, layer : sliding variable and half thickness of the boundary layer, in one unit
pole : lambda, 1/s
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit


class Error(NamedTuple):
    """Tracking error of one output, y - y_d (Eq. 6.23), its derivatives and integral, and y_d's third derivative."""

    value: float
    rate: float
    acceleration: float
    integral: float
    reference_jerk: float


class Gains(NamedTuple):
    """Gains of one output.

    Attributes
    ----------
    pole : lambda, 1/s: triple pole -lambda of the error's dynamics (Eq. 6.21) and of the sliding surface
    sliding : K_s, output unit / s^3
    layer : phi, half thickness of the boundary layer, in the unit of S
    """

    pole: float
    sliding: float
    layer: float


@njit(cache=True)
def saturation(surface: float, layer: float) -> float:
    """sat(S) of Eq. 6.31 with the arcsine (errata 10): odd, continuous, +-1 at the layer's edge."""
    ratio = surface / layer
    if ratio >= 1.0:
        return 1.0
    if ratio <= -1.0:
        return -1.0
    return 2.0 / math.pi * math.asin(ratio)


@njit(cache=True)
def linear_jerk(error: Error, pole: float) -> float:
    """y_d''' - 3 lambda e'' - 3 lambda^2 e' - lambda^3 e (Eqs. 6.21 and 6.22)."""
    return error.reference_jerk - pole * (3.0 * error.acceleration + pole * (3.0 * error.rate + pole * error.value))


@njit(cache=True)
def second_order_jerk(error: Error, pole: float) -> float:
    """y_d''' - 2 lambda e'' - lambda^2 e' (Eq. 6.41)."""
    return error.reference_jerk - pole * (2.0 * error.acceleration + pole * error.rate)
