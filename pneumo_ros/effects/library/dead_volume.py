# SPDX-License-Identifier: Apache-2.0
"""Hose and fittings add a volume that does not change with the height."""

from __future__ import annotations

from pneumo_ros.effects.contract import ENDS, Effect, Ends, Plant, Values, with_gas
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import EffectParameter


def plant(plant: Plant, ends: Ends, values: Values) -> Plant:
    """Adds to the constant part of V(h)."""
    return with_gas(plant, ends, lambda gas: gas._replace(volume_offset=gas.volume_offset + values[0]))


EFFECT = Effect(
    id="dead_volume",
    summary="volume of hose and fittings beside the spring's own",
    sites=ENDS,
    places=("{end}_air",),
    elsewhere=("front_air-rear_air", "{end}_air-later"),
    parameters=(
        EffectParameter(
            "dead_volume",
            "m3",
            -2e-5,
            3e-4,
            1e-5,
            size=True,
            meaning="volume of hoses and fittings beside the bellows'",
        ),
    ),
    plant=plant,
    guide=Guide(
        meaning="Hoses and fittings hold air beside the spring: it is softer and fills more slowly.",
        check=(
            "measure length and bore of the hose, or disconnect it at the spring and fill it with water: it takes "
            "{dead_volume}"
        ),
        mistaken_for={
            "heat_transfer": "softens slow strokes only",
            "orifice_coefficient": "leaves the stiffness with closed valves alone",
        },
    ),
)
