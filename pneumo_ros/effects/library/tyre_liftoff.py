# SPDX-License-Identifier: Apache-2.0
"""A tyre pushes but does not pull: above the ground its force is gone (the nominal tyre is linear in both signs).

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS, Effect
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.hooks import Tyre
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.laws.contact import missing_pull


@njit(cache=True, error_model="numpy")
def tyre(tyre: Tyre, z: tuple[float, ...], p: tuple[float]) -> float:
    """Takes the lost share of the pull away."""
    return missing_pull(tyre.force, p[0])


EFFECT = Effect(
    id="tyre_liftoff",
    summary="the wheel leaves the ground: no pull from the tyre",
    sites=ENDS,
    places=("{end}_tyre",),
    elsewhere=("body_heave", "body_pitch"),
    parameters=(
        EffectParameter(
            "lost_pull",
            "1",
            0.0,
            1.0,
            0.9,
            size=True,
            ends=(0.0, 1.0),
            meaning="share of the nominal pull that is not there: 1 none is left",
        ),
    ),
    term=PlantTerm(tyre=tyre),
    guide=Guide(
        meaning="The wheel leaves the ground: the linear tyre of the model would pull it back.",
        check=(
            "film the contact on the roughest road, or put paper under the tyre: it can be drawn out in the dips;"
            " 100 % means no pull at all, here {lost_pull}"
        ),
        mistaken_for={"bump_stop": "acts when the spring is short, lift-off when the tyre is long"},
    ),
)
