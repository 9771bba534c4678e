# SPDX-License-Identifier: Apache-2.0
"""The bushing damps more (or less) than the nominal constant and its tolerance allow (Eq. 5.8).

The law is :func:`pneumo_ros.laws.damping.growing`.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS, Effect
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.hooks import Strut
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.laws.damping import growing


@njit(cache=True, error_model="numpy")
def force(strut: Strut, z: tuple[float, ...], p: tuple[float, float]) -> float:
    """Against the strut's rate."""
    return -growing(strut.rate, p[0], p[1])


EFFECT = Effect(
    id="viscous_damping",
    summary="viscous damping of the strut beyond its tolerance",
    sites=ENDS,
    places=("{end}_force",),
    elsewhere=("body_heave", "body_pitch"),
    parameters=(
        EffectParameter(
            "added_damping",
            "N s/m",
            -60.0,
            500.0,
            25.0,
            size=True,
            starts=(-20.0,),
            meaning="damping beyond the nominal one",
        ),
        EffectParameter("growth_with_speed", "s/m", -2.0, 20.0, 0.5, meaning="how it grows, or falls, with the speed"),
    ),
    term=PlantTerm(force=force),
    guide=Guide(
        meaning=(
            "The strut's damper, bushing or the air in a hose resists by speed, more or less than the rig file says."
        ),
        check=(
            "close the valves at design height, push the body down by 5 mm over one axle, let go and log its "
            "LVDT: of two swings a and b that follow each other T apart, 2 m ln(a/b) / T is bushing_damping of "
            "the rig file plus {added_damping}; m is the mass that the strut carries"
        ),
        mistaken_for={
            "coulomb_friction": "does not fade with slow motion",
            "tyre_damping": "acts between axle and road: hold the axle, and it is gone",
        },
    ),
)
