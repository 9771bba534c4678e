# SPDX-License-Identifier: Apache-2.0
"""What the rig's sensors read and what a simulation knows beyond them.

Kernel arguments
----------------
x, u, road : state (10,), openings (4,), m2, and ground (2,), m
packed, heights, pressures, cubics : the half car as numbers, see :mod:`pneumo_ros.plant.half_car`
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.plant.air_spring import AreaSurface, effective_area
from pneumo_ros.plant.equations import derivative
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.plant.integrator import unpack_body, unpack_gas
from pneumo_ros.rig import Rig
from pneumo_ros.rig.channels import (
    HEAVE,
    PITCH,
    PRESSURE_FRONT,
    PRESSURE_REAR,
    UNSPRUNG_FRONT,
    UNSPRUNG_REAR,
    sprung_points,
)

NOISE_BLOCK = 4096  # rows drawn at once; the sequence does not depend on it


def read_channels(state: NDArray[np.float64], front_arm: float, rear_arm: float) -> tuple[float, ...]:
    """Noise-free readings of :data:`~pneumo_ros.rig.channels.CHANNELS` from a plant state (10,), m and Pa absolute."""
    x = state.tolist()  # of so few values Python's own arithmetic is four times as fast as an array's
    front, rear = sprung_points(x[HEAVE], x[PITCH], front_arm, rear_arm)
    return front, rear, x[UNSPRUNG_FRONT], x[UNSPRUNG_REAR], x[PRESSURE_FRONT], x[PRESSURE_REAR]


class NoiseSource:
    """White sensor noise, one row of six channels a sample; the same seed gives the same rows."""

    def __init__(self, rig: Rig, seed: int) -> None:
        displacement, pressure = rig.displacement_noise.value, rig.pressure_noise.value
        self._std = np.array([displacement] * 4 + [pressure] * 2)
        self._rng = np.random.default_rng(seed)
        self._rows: list[list[float]] = []

    def next(self) -> list[float]:
        """The next row, m and Pa."""
        if not self._rows:
            block = self._rng.standard_normal((NOISE_BLOCK, 6)) * self._std
            self._rows = block.tolist()[::-1]
        return self._rows.pop()


@njit(cache=True, error_model="numpy")
def _truth(
    x: NDArray[np.float64],
    u: NDArray[np.float64],
    road: NDArray[np.float64],
    packed: NDArray[np.float64],
    heights: NDArray[np.float64],
    pressures: NDArray[np.float64],
    cubics: NDArray[np.float64],
) -> NDArray[np.float64]:
    surface = AreaSurface(heights, pressures, cubics)
    body, front, rear = unpack_body(packed), unpack_gas(packed, 14), unpack_gas(packed, 28)
    state = (x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9])
    rates = derivative(state, u[0], u[1], u[2], u[3], road[0], road[1], body, front, rear, surface)
    out = np.empty(16)
    out[:10] = x
    out[10], out[11] = rates[4], rates[5]
    top_f, top_r = sprung_points(x[0], x[1], body.front_arm, body.rear_arm)
    out[12] = body.area_scale_front * effective_area(top_f - x[2], x[8] - front.ambient_pressure, surface)
    out[13] = body.area_scale_rear * effective_area(top_r - x[3], x[9] - rear.ambient_pressure, surface)
    out[14] = body.tyre_stiffness_front * (road[0] - x[2])
    out[15] = body.tyre_stiffness_rear * (road[1] - x[3])
    return out


def truth(
    car: HalfCar, state: NDArray[np.float64], command: NDArray[np.float64], road: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(16,) of :data:`~pneumo_ros.rig.channels.TRUTH_FIELDS`: state, accelerations, effective areas, tyre forces (up).

    Parameters
    ----------
    state : (10,)
    command : (4,) m2
    road : (2,) m
    """
    surface = car.surface
    return _truth(state, command, road, car.packed, surface.heights, surface.pressures, surface.cubics)
