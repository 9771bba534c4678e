# SPDX-License-Identifier: Apache-2.0
"""Dry friction of the strut's bushing: LuGre with the steady curve Fc + (Fs - Fc) exp(-(v/vs)^2).

The law is :mod:`pneumo_ros.laws.friction`: its bristle is advanced by its exact solution at held speed, so that the
stiffest one needs no shorter step.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS, Effect
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.hooks import Air, Strut, Tyre
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.laws.friction import bristle, bristle_force, stribeck

STRIBECK_SPEED = 0.012  # m/s; moves the output far less than force and bristle length do
BRISTLE_DAMPING = 15.0  # N s/m, fades with speed; keeps the stuck strut from ringing

State = tuple[float]
Values = tuple[float, float, float]


@njit(cache=True, error_model="numpy")
def advance(z: State, strut: Strut, air: Air, tyre: Tyre, dt: float, p: Values) -> State:
    """Bristle force over Fc, one step later: dz/dt = v/s - |v| z/(s g) with s the bristle length."""
    if p[0] <= 0.0:
        return (0.0,)
    return (bristle(z[0], strut.rate, p[1], stribeck(strut.rate, STRIBECK_SPEED, p[2]), dt),)


@njit(cache=True, error_model="numpy")
def force(strut: Strut, z: State, p: Values) -> float:
    """Opposes the strut's motion; the bristle's damping only while it still bends."""
    if p[0] <= 0.0:
        return 0.0
    return -bristle_force(z[0], strut.rate, p[0], BRISTLE_DAMPING)


EFFECT = Effect(
    id="coulomb_friction",
    summary="dry friction between body and axle (bushing, guide), with presliding and a Stribeck peak",
    sites=ENDS,
    places=("{end}_force",),
    elsewhere=("body_heave", "body_pitch"),
    parameters=(
        EffectParameter(
            "friction_force",
            "N",
            0.0,
            80.0,
            6.0,
            size=True,
            starts=(1.5, 20.0),
            meaning="friction while the strut slides",
        ),
        EffectParameter(
            "bristle_length", "m", 2e-5, 8e-4, 2e-4, meaning="travel over which a stuck strut still gives way"
        ),
        EffectParameter(
            "stribeck_excess", "1", 0.0, 1.0, 0.25, meaning="break-away force beyond the sliding one, as a share of it"
        ),
    ),
    term=PlantTerm(states=1, advance=advance, force=force),
    guide=Guide(
        meaning=(
            "A bushing or guide drags: the strut sticks until the force beyond balance exceeds the friction, then"
            " slides. Small roads hardly move it."
        ),
        check=(
            "vent and disconnect the bellows, push the body slowly up and down over one axle with a spring "
            "balance: the force differs by twice {friction_force} between up and down, whatever the speed; "
            "released, it stays where it is"
        ),
        mistaken_for={
            "viscous_damping": "grows with speed; friction is the same at half the speed",
            "bellows_hysteresis": "goes away with the bellows disconnected; friction stays",
        },
    ),
)
