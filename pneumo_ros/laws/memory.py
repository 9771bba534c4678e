# SPDX-License-Identifier: Apache-2.0
"""What follows something else by a first order, exact while that is held: droop, fading rubber, walls, bristles.

Kernel arguments
----------------
z, target : where it is and what it follows, in one unit
step, time : of the integration and of the memory, s; fade : what is left of the distance after a step
"""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True, error_model="numpy", inline="always")
def followed(z: float, target: float, fade: float) -> float:
    """One step later."""
    return target + (z - target) * fade


@njit(cache=True, error_model="numpy", inline="always")
def relaxed(z: float, target: float, step: float, time: float) -> float:
    """One step later, by the memory's length."""
    return followed(z, target, math.exp(-step / time))
