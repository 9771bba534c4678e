# SPDX-License-Identifier: Apache-2.0
"""A pressure sensor whose sensitivity is off; it may pivot about vacuum (absolute cell) or the atmosphere (gauge
cell).
"""

from __future__ import annotations

from pneumo_ros.arrays import Array
from pneumo_ros.effects.contract import PRESSURES_OR_BOTH, Effect, Memory, Values
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import STILL_FOLLOWS, EffectParameter
from pneumo_ros.laws.signal import scaled_about, unscaled_about
from pneumo_ros.units import ATMOSPHERE


def outputs(
    outputs: Array, period: float, channels: tuple[int, ...], values: Values, memory: Memory
) -> tuple[Array, Memory]:
    """What the sensor reports."""
    outputs[:, channels] = scaled_about(outputs[:, channels], values[0], values[1])
    return outputs, None


def undo(measured: Array, channels: tuple[int, ...], values: Values) -> Array:
    """What was really there."""
    measured[:, channels] = unscaled_about(measured[:, channels], values[0], values[1])
    return measured


EFFECT = Effect(
    id="pressure_scale",
    summary="a pressure sensor's sensitivity is off",
    sites=PRESSURES_OR_BOTH,
    places=(),
    elsewhere=("{end}_air",),
    parameters=(
        EffectParameter("scale_error", "1", -0.5, 0.5, 0.03, size=True, meaning="error of the sensitivity, as a share"),
        EffectParameter(
            "pivot_pressure", "Pa", 0.0, ATMOSPHERE, 5e4, meaning="pressure that it reads right: 0 or the atmosphere's"
        ),
    ),
    outputs=outputs,
    undo=undo,
    follows=STILL_FOLLOWS,
    guide=Guide(
        meaning="A pressure sensor's sensitivity is off.",
        check=(
            "put a reference gauge beside it at 1, 3 and 5 bar: the reading is off by {scale_error} of what is "
            "above {pivot_pressure}"
        ),
        mistaken_for={
            "effective_area_error": "the reference gauge agrees with the sensor",
            "pressure_offset": "is the same at every pressure",
        },
    ),
)
