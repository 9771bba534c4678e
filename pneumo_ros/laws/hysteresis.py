# SPDX-License-Identifier: Apache-2.0
"""Rate-independent hysteresis of Bouc and Wen: force over its size after a way of reversals.

z' with respect to the move, in yield travels, is 1 - a |z|^n while loading and 1 + b |z|^n while unloading (Wen 1976,
J. Eng. Mech. Div. 102, 249-263). For n = 1 a monotonic move has a closed form, :func:`moved_on`; a corner of another
sharpness goes in substeps, :func:`stepped`.

Kernel arguments
----------------
z : the memory; move : what the travel moves, of one substep; moved : altogether
sharpness : n; loading, unloading : a and b
growth : how the force goes on where n is 1: a = 1 - growth, b = 1 + growth; above -1; from 1 on it grows without end
steps : number of substeps
"""

from __future__ import annotations

import math

from numba import njit

from pneumo_ros.laws.friction import clipped


@njit(cache=True, error_model="numpy", inline="always")
def slope(z: float, move: float, sharpness: float, loading: float, unloading: float) -> float:
    """dz over the move's length, in its direction."""
    used = abs(z) ** sharpness
    return 1.0 - loading * used if z * move > 0.0 else 1.0 + unloading * used


@njit(cache=True, error_model="numpy", inline="always")
def stepped(z: float, move: float, sharpness: float, unloading: float, steps: int) -> float:
    """Memory after some moves of one size, by Euler's method; the force levels off at its size, never beyond."""
    for _ in range(steps):
        z = clipped(z + move * slope(z, move, sharpness, 1.0, unloading), 1.0)
    return z


@njit(cache=True, error_model="numpy")
def moved_on(z: float, moved: float, growth: float) -> float:
    """Memory after a monotonic move, exact; the corner is round (n = 1)."""
    side, left = (1.0, moved) if moved > 0.0 else (-1.0, -moved)
    if z * side < 0.0:  # on its way back to nothing
        fall = 1.0 + growth
        until = math.log(1.0 + fall * abs(z)) / fall
        if left <= until:
            return side / fall + (z - side / fall) * math.exp(-fall * left)
        z, left = 0.0, left - until
    rise = 1.0 - growth
    if abs(rise) < 1e-9:
        return z + side * left
    return side / rise + (z - side / rise) * math.exp(-rise * left)
