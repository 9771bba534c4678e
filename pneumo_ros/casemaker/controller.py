# SPDX-License-Identifier: Apache-2.0
"""Controllers that run inside the simulated rig: slow levelling, and an active one with a boundary layer.

Both see the sensors' values, noise and faults included, once a period.

Kernel arguments
----------------
memory : (2,) filtered height, m, and integral of the error, m s
height, target : of the spring, as measured and wanted, m
rest : inlet opening at rest, m2
period : s
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Controller(NamedTuple):
    """Gains of one controller for both ends.

    Attributes
    ----------
    proportional, integral : inlet opening per height error and its integral, m2/m and m2/(m s)
    derivative : opening per height rate, m2/(m/s)
    switching, layer : share of the opening at rest that a saturated sliding surface adds, and its half width, m/s
    slope : of the surface error_rate + slope * error, 1/s
    filter_time : of the height and its rate, s
    limit : largest opening, m2
    """

    proportional: float = 3e-6
    integral: float = 2e-6
    derivative: float = 0.0
    switching: float = 0.0
    layer: float = 0.05
    slope: float = 5.0
    filter_time: float = 0.5
    limit: float = 1.6129e-05


LEVELLING = Controller()
ACTIVE = Controller(proportional=3e-6, integral=2e-6, switching=0.2, layer=0.06, slope=4.0, filter_time=0.02)


@njit(cache=True)
def control(
    memory: NDArray[np.float64], height: float, target: float, rest: float, period: float, gains: Controller
) -> float:
    """Inlet opening for the next period, m2; ``memory`` (2,): filtered height m and integral m s, updated in place."""
    share = 1.0 - math.exp(-period / gains.filter_time)
    change = share * (height - memory[0])
    memory[0] += change
    error = target - memory[0]
    memory[1] += period * error
    rate = -change / period
    surface = (rate + gains.slope * error) / gains.layer
    switching = gains.switching * rest * min(max(surface, -1.0), 1.0)
    opening = rest + gains.proportional * error + gains.integral * memory[1] + gains.derivative * rate + switching
    return min(max(opening, 0.0), gains.limit)
