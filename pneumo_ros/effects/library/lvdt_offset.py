# SPDX-License-Identifier: Apache-2.0
"""An LVDT whose zero has moved."""

from __future__ import annotations

from pneumo_ros.effects.contract import Effect
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.effects.sensors import shifted, unshifted
from pneumo_ros.rig.channels import DISPLACEMENTS

EFFECT = Effect(
    id="lvdt_offset",
    summary="an LVDT's zero is off",
    sites=DISPLACEMENTS,
    places=(),
    parameters=(
        EffectParameter("offset", "m", -0.03, 0.03, 1e-3, size=True, meaning="what the sensor reads too much"),
    ),
    outputs=shifted,
    undo=unshifted,
    guide=Guide(
        meaning="An LVDT's zero is off: a body or a core has slipped.",
        check=(
            "bring the rig to design height with a gauge block and read the sensor: off by {offset}; /rig/zero sets it"
        ),
        mistaken_for={
            "lvdt_scale": "grows with the stroke",
            "payload": "sinks the whole end, and both its sensors say so",
        },
    ),
)
