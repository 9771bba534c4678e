"""The bushing damps more (or less) than the nominal constant and its tolerance allow (Eq. 5.8)."""

from __future__ import annotations

from pneumo_ros.gap.effects.base import ENDS, Effect, Ends, Plant, Values
from pneumo_ros.gap.model import EffectParameter


def plant(plant: Plant, ends: Ends, values: Values) -> Plant:
    """Adds to the viscous constant."""
    body = plant.body
    return plant._replace(
        body=body._replace(
            damping_front=body.damping_front + values[0] * ends.front,
            damping_rear=body.damping_rear + values[0] * ends.rear,
        )
    )


EFFECT = Effect(
    id="viscous_damping",
    summary="viscous damping of the strut beyond its tolerance",
    sites=ENDS,
    places=("{end}_force",),
    parameters=(EffectParameter("added_damping", "N s/m", -60.0, 500.0, 25.0, size=True, starts=(-20.0,)),),
    plant=plant,
)
