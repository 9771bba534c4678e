# SPDX-License-Identifier: Apache-2.0
"""The half car on linear springs and dampers (Eqs. 3.1-3.4), passive or with skyhook semi-active dampers (2.5.3).

State (8): heave, pitch, unsprung front and rear [m, rad, m, m], then their rates, all measured from static equilibrium:
the weight then drops out. Pitch is positive nose up. The printed Eqs. 3.3-3.4 mix both signs of pitch; these do not.

Kernel arguments
----------------
body_rate, axle_rate : upwards, m/s
damping, damping_max, skyhook : of a damper, the most it can give, and skyhook damping, N s/m
x, x0, k, h : state (8,): heave, pitch, axles, m and rad, then their rates; its rate; a step, s
road, road_front, road_rear : heights of the ground, m
period, steps : s, and RK4 steps in it
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.rig.channels import sprung_points

State = tuple[float, float, float, float, float, float, float, float]


class Conventional(NamedTuple):
    """Parameters, SI.

    Attributes
    ----------
    damping_* : of the passive car, and the least of the semi-active one when ``skyhook`` > 0, N s/m
    skyhook : damping of a damper between body and sky that the controllable ones imitate, N s/m; 0 is passive
    damping_max : most a controllable damper can give, N s/m
    """

    sprung_mass: float
    pitch_inertia: float
    front_arm: float
    rear_arm: float
    unsprung_mass_front: float
    unsprung_mass_rear: float
    stiffness_front: float
    stiffness_rear: float
    damping_front: float
    damping_rear: float
    tyre_stiffness_front: float
    tyre_stiffness_rear: float
    skyhook: float = 0.0
    damping_max: float = 0.0


@njit(cache=True)
def damper_force(body_rate: float, axle_rate: float, damping: float, skyhook: float, damping_max: float) -> float:
    """Force of one damper on the body, N: passive, or as near to -skyhook * body_rate as a damper can give.

    A damper can only oppose its own motion: where the skyhook force would drive it, it gives its least (Section 2.5.3).
    """
    relative = body_rate - axle_rate
    if skyhook <= 0.0 or body_rate * relative <= 0.0:
        return -damping * relative
    return -min(max(skyhook * body_rate / relative, damping), damping_max) * relative


@njit(cache=True)
def conventional_rates(x: State, road_front: float, road_rear: float, car: Conventional) -> State:
    """Right-hand side of Eqs. 3.1-3.4."""
    z, pitch, zf, zr, vz, rate, vf, vr = x
    front, rear = sprung_points(z, pitch, car.front_arm, car.rear_arm)
    front_rate, rear_rate = sprung_points(vz, rate, car.front_arm, car.rear_arm)
    ff = -car.stiffness_front * (front - zf) + damper_force(
        front_rate, vf, car.damping_front, car.skyhook, car.damping_max
    )
    fr = -car.stiffness_rear * (rear - zr) + damper_force(rear_rate, vr, car.damping_rear, car.skyhook, car.damping_max)
    return (
        vz,
        rate,
        vf,
        vr,
        (ff + fr) / car.sprung_mass,
        (car.front_arm * ff - car.rear_arm * fr) / car.pitch_inertia,
        (car.tyre_stiffness_front * (road_front - zf) - ff) / car.unsprung_mass_front,
        (car.tyre_stiffness_rear * (road_rear - zr) - fr) / car.unsprung_mass_rear,
    )


@njit(cache=True)
def simulate_conventional(
    x0: NDArray[np.float64], road: NDArray[np.float64], period: float, steps: int, car: Conventional
) -> NDArray[np.float64]:
    """Fixed-step RK4 over road (N + 1, 2), m, linear between samples: states (N + 1, 8)."""
    count = road.shape[0] - 1
    out, h = np.empty((count + 1, 8)), period / steps
    out[0] = x0
    x = (x0[0], x0[1], x0[2], x0[3], x0[4], x0[5], x0[6], x0[7])
    for i in range(count):
        slope_front = (road[i + 1, 0] - road[i, 0]) / steps
        slope_rear = (road[i + 1, 1] - road[i, 1]) / steps
        for j in range(steps):
            f, r = road[i, 0] + j * slope_front, road[i, 1] + j * slope_rear
            k1 = conventional_rates(x, f, r, car)
            k2 = conventional_rates(_moved(x, k1, 0.5 * h), f + 0.5 * slope_front, r + 0.5 * slope_rear, car)
            k3 = conventional_rates(_moved(x, k2, 0.5 * h), f + 0.5 * slope_front, r + 0.5 * slope_rear, car)
            k4 = conventional_rates(_moved(x, k3, h), f + slope_front, r + slope_rear, car)
            x = _moved(_moved(_moved(_moved(x, k1, h / 6.0), k2, h / 3.0), k3, h / 3.0), k4, h / 6.0)
        for m in range(8):
            out[i + 1, m] = x[m]
    return out


@njit(cache=True)
def _moved(x: State, k: State, h: float) -> State:
    return (
        x[0] + h * k[0],
        x[1] + h * k[1],
        x[2] + h * k[2],
        x[3] + h * k[3],
        x[4] + h * k[4],
        x[5] + h * k[5],
        x[6] + h * k[6],
        x[7] + h * k[7],
    )
