"""Hysteresis of the bellows' rubber and cord: a Bouc-Wen element in parallel with the spring.

Source: Wen, "Method for random vibration of hysteretic systems", J. Eng. Mech. 102(2), 1976, with exponent one and
equal loading and unloading constants. It differs from dry friction by its length: millimetres of travel, not a
bristle's tenth.
"""

from __future__ import annotations

import math

from numba import njit

from pneumo_ros.gap.compose import PlantTerm
from pneumo_ros.gap.effects.base import ENDS, Effect
from pneumo_ros.gap.kernel_parts import Air, Strut, Tyre
from pneumo_ros.gap.model import EffectParameter

State = tuple[float]
Values = tuple[float, float]


@njit(cache=True, error_model="numpy")
def advance(z: State, strut: Strut, air: Air, tyre: Tyre, dt: float, p: Values) -> State:
    """Force over its limit, one step later: dz/dt = (v - |v| z)/length, exact at held speed."""
    fade = math.exp(-abs(strut.rate) / p[1] * dt)
    target = 1.0 if strut.rate > 0.0 else -1.0
    return (target + (z[0] - target) * fade,)


@njit(cache=True, error_model="numpy")
def force(strut: Strut, z: State, p: Values) -> float:
    """Opposes the travel since the last reversal."""
    return -p[0] * z[0]


EFFECT = Effect(
    id="bellows_hysteresis",
    summary="the bellows' rubber loses energy by travel, not by speed",
    sites=ENDS,
    places=("{end}_force",),
    parameters=(
        EffectParameter("hysteresis_force", "N", 0.0, 150.0, 8.0, size=True, starts=(2.0, 30.0)),
        EffectParameter("yield_travel", "m", 1e-3, 3e-2, 4e-3, starts=(1.5e-3,)),
    ),
    term=PlantTerm(states=1, advance=advance, force=force),
)
