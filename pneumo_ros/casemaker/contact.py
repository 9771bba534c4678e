# SPDX-License-Identifier: Apache-2.0
"""Forces between body, axle and ground that the nominal rig does not have: friction, bellows, stop, tyre.

Kernel arguments
----------------
height, speed : of the strut, m and m/s, extension positive
bristle, memory : deflection of the friction's bristle and of the hysteresis, m
deflection, rate, static : of the tyre (road minus axle), m and m/s, and its deflection at rest, m
x, dx, at : state and its rate (SIZE,), written in place, and where the tyre's memory stands in them
rows : (ROWS, COLUMNS) second laws of this end, see :mod:`pneumo_ros.casemaker.laws.slots`
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.casemaker.laws.ground import lift, tyre_loss
from pneumo_ros.casemaker.laws.slots import FORM, LIFTOFF, TYRE_LOSS
from pneumo_ros.casemaker.parameters import End


@njit(cache=True)
def lugre_level(height: float, end: End) -> float:
    """Share of the friction level that acts at a height: 1, unless the guide binds only beyond ``bind_height``."""
    if end.bind_length <= 0.0:
        return 1.0
    return min(max((height - end.bind_height) / end.bind_length, 0.0), 1.0)


@njit(cache=True, error_model="numpy")
def lugre(bristle: float, speed: float, end: End) -> tuple[float, float]:
    """Friction force, N (against positive ``speed``), and the bristle's rate, m/s.

    Canudas de Wit, Olsson, Astrom, Lischinsky: A new model for control of systems with friction, IEEE TAC 40 (1995).
    The bristle's damping fades with speed, as they advise, so that the model stays dissipative.
    """
    fade = math.exp(-((speed / end.stribeck) ** 2))
    steady = end.coulomb + (end.static - end.coulomb) * fade
    rate = speed - end.bristle_stiffness * abs(speed) / steady * bristle
    return end.bristle_stiffness * bristle + end.bristle_damping * fade * rate, rate


@njit(cache=True, error_model="numpy")
def bouc_wen_rate(memory: float, speed: float, end: End) -> float:
    """Rate of the hysteretic displacement, m/s: elastic below ``bouc_yield``, slipping above it (Wen 1976)."""
    use = abs(memory / end.bouc_yield) ** end.bouc_power
    towards = 1.0 if memory * speed > 0.0 else 0.0
    return speed * (1.0 - towards * use)


@njit(cache=True)
def hunt_crossley(height: float, speed: float, end: End) -> float:
    """Force of a rubber stop below ``contact_height``, N, pushing the ends apart and never pulling them together.

    Hunt, Crossley: Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975).
    """
    depth = end.contact_height - height
    if end.contact_stiffness <= 0.0 or depth <= 0.0:
        return 0.0
    return max(0.0, end.contact_stiffness * depth**1.5 * (1.0 - end.contact_damping * speed))


@njit(cache=True)
def elastic_tyre(deflection: float, static: float, rows: NDArray[np.float64], end: End) -> float:
    """Force without losses, N upwards on the axle; a second law of lift-off agrees with the linear tyre at rest.

    Parameters
    ----------
    deflection : road minus axle height, m
    static : deflection at rest, m: the hardening is cubic about it, so that it leaves the trim alone
    """
    if rows[LIFTOFF, 0] > 0.0:
        return end.tyre_stiffness * static * lift(rows[LIFTOFF], deflection / static)
    about = deflection - static
    force = end.tyre_stiffness * (deflection + end.tyre_hardening * about**3)
    if rows[FORM, 0] > 0.0:
        force += rows[FORM, 6] * end.tyre_stiffness * about * about / static
    return force


@njit(cache=True)
def lossy_tyre(
    x: NDArray[np.float64], dx: NDArray[np.float64], at: int, deflection: float, rate: float, static: float,
    rows: NDArray[np.float64], end: End,
) -> float:  # fmt: skip
    """Tyre force with second laws, N upwards on the axle; fills the rate of its memory."""
    force = elastic_tyre(deflection, static, rows, end) + end.tyre_damping * rate
    if rows[TYRE_LOSS, 0] > 0.0:
        force += tyre_loss(rows[TYRE_LOSS], x, dx, at, rate, deflection / static)
    if rows[LIFTOFF, 0] > 0.0:
        return 0.0 if deflection <= 0.0 and rows[LIFTOFF, 0] == 1.0 else max(0.0, force)
    if end.unilateral <= 0.0:
        return force
    return 0.0 if deflection <= 0.0 else max(0.0, force)


@njit(cache=True)
def viscous(speed: float, end: End) -> float:
    """Damping force of the bushing against ``speed``, N."""
    return (end.damping + end.extra_damping + end.quadratic_damping * abs(speed)) * speed
