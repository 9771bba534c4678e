# SPDX-License-Identifier: Apache-2.0
"""The centre of mass lies ahead of (positive) or behind where the configuration has it."""

from __future__ import annotations

from pneumo_ros.effects.contract import RIG, Effect, Ends, Plant, Values
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import EffectParameter


def plant(plant: Plant, ends: Ends, values: Values) -> Plant:
    """Shortens the front arm by what the rear arm gains; the axles stay."""
    body = plant.body
    return plant._replace(body=body._replace(front_arm=body.front_arm - values[0], rear_arm=body.rear_arm + values[0]))


EFFECT = Effect(
    id="cg_shift",
    summary="the centre of mass is not where the configuration says",
    sites=RIG,
    places=("body_pitch", "body_heave"),
    parameters=(
        EffectParameter(
            "cg_shift_forward",
            "m",
            -0.12,
            0.12,
            0.008,
            size=True,
            starts=(-0.008,),
            meaning="how far the centre of mass lies ahead",
        ),
    ),
    plant=plant,
    guide=Guide(
        meaning="The centre of mass is not where the rig file says.",
        check=(
            "weigh front and rear axle: their ratio puts the centre of mass further forward than the rig file has "
            "it, by {cg_shift_forward}"
        ),
        mistaken_for={"payload": "changes the sum of both scales"},
    ),
)
