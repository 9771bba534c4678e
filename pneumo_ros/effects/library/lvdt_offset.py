"""An LVDT whose zero has moved."""

from __future__ import annotations

from pneumo_ros.effects.contract import Effect
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.effects.sensors import shifted, unshifted
from pneumo_ros.rig.channels import DISPLACEMENTS

EFFECT = Effect(
    id="lvdt_offset",
    summary="an LVDT's zero is off",
    sites=DISPLACEMENTS,
    places=(),
    parameters=(EffectParameter("offset", "m", -0.03, 0.03, 1e-3, size=True),),
    outputs=shifted,
    undo=unshifted,
)
