# SPDX-License-Identifier: Apache-2.0
"""A load on the body that the configuration does not know, at the centre of mass."""

from __future__ import annotations

from pneumo_ros.effects.contract import RIG, Effect, Ends, Plant, Values
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import EffectParameter


def plant(plant: Plant, ends: Ends, values: Values) -> Plant:
    """Adds to the sprung mass."""
    return plant._replace(body=plant.body._replace(sprung_mass=plant.body.sprung_mass + values[0]))


EFFECT = Effect(
    id="payload",
    summary="unknown load on the body",
    sites=RIG,
    places=("body_heave", "body_pitch"),
    parameters=(
        EffectParameter("payload", "kg", -15.0, 40.0, 2.0, size=True, starts=(-2.0,), meaning="mass of the load"),
    ),
    plant=plant,
    guide=Guide(
        meaning="More (or less) lies on the body than the rig file says.",
        check="weigh front and rear axle on two scales: their sum is off by {payload}",
        mistaken_for={
            "effective_area_error": "leaves the scales right and the gauge pressures wrong",
            "cg_shift": "keeps the sum",
        },
    ),
)
