# SPDX-License-Identifier: Apache-2.0
"""A pressure sensor whose zero has moved."""

from __future__ import annotations

from pneumo_ros.effects.contract import PRESSURES_OR_BOTH, Effect
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.effects.sensors import shifted, unshifted

EFFECT = Effect(
    id="pressure_offset",
    summary="a pressure sensor's zero is off",
    sites=PRESSURES_OR_BOTH,
    places=(),
    elsewhere=("{end}_air",),
    parameters=(EffectParameter("offset", "Pa", -6e4, 6e4, 2e3, size=True, meaning="what the sensor reads too much"),),
    outputs=shifted,
    undo=unshifted,
    guide=Guide(
        meaning="A pressure sensor's zero is off.",
        check="vent the spring: the sensor differs from the barometer by {offset}",
        mistaken_for={
            "pressure_scale": "vented, the sensor is right",
            "payload": "the scales under the axles agree with the rig file",
        },
    ),
)
