# SPDX-License-Identifier: Apache-2.0
"""Hysteresis of the bellows' rubber and cord: a Bouc-Wen element in parallel with the spring.

The law is :mod:`pneumo_ros.laws.hysteresis`, its corner of any sharpness n; unloading 0 lets go elastically, 1
steepest. It differs from dry friction by its length: millimetres of travel, not a bristle's tenth.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS, Effect
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.hooks import Air, Strut, Tyre
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.laws.hysteresis import stepped

SUBSTEPS = 4  # a strut moves up to half its yield travel in a step

State = tuple[float]
Values = tuple[float, float, float, float]


@njit(cache=True, error_model="numpy")
def advance(z: State, strut: Strut, air: Air, tyre: Tyre, dt: float, p: Values) -> State:
    """Force over its limit, one step later, at held speed; never beyond the limit."""
    return (stepped(z[0], strut.rate * dt / (SUBSTEPS * p[1]), p[2], p[3], SUBSTEPS),)


@njit(cache=True, error_model="numpy")
def force(strut: Strut, z: State, p: Values) -> float:
    """Opposes the travel since the last reversal."""
    return -p[0] * z[0]


EFFECT = Effect(
    id="bellows_hysteresis",
    summary="the bellows' rubber loses energy by travel, not by speed",
    sites=ENDS,
    places=("{end}_force",),
    elsewhere=("body_heave", "body_pitch"),
    parameters=(
        EffectParameter(
            "hysteresis_force",
            "N",
            0.0,
            150.0,
            8.0,
            size=True,
            starts=(2.0, 30.0),
            meaning="largest force of the rubber's hysteresis",
        ),
        EffectParameter(
            "yield_travel", "m", 5e-4, 3e-2, 4e-3, starts=(1.5e-3,), meaning="travel over which that force builds up"
        ),
        EffectParameter("sharpness", "1", 0.7, 4.0, 1.5, meaning="corner of the loop: 1 round, 4 nearly a right angle"),
        EffectParameter(
            "unloading", "1", -0.3, 1.3, 0.5, meaning="how it lets go after a reversal: 0 elastically, 1 steepest"
        ),
    ),
    term=PlantTerm(states=1, advance=advance, force=force),
    guide=Guide(
        meaning=(
            "The rubber of the bellows loses energy by travel, not by speed: the force lags behind the height, at"
            " any speed."
        ),
        check=(
            "close both valves, move the body slowly over 10 mm and back with a spring balance: between there and "
            "back the force differs by up to twice {hysteresis_force}; slower motion does not shrink this loop, "
            "and with the bellows off it is gone"
        ),
        mistaken_for={
            "coulomb_friction": "stays with the bellows off, and its loop has square corners",
            "heat_transfer": "its loop shrinks when the motion becomes very slow",
        },
    ),
)
