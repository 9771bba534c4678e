# SPDX-License-Identifier: Apache-2.0
"""An LVDT whose sensitivity differs from its calibration: reads (1 + error) times the height above the datum."""

from __future__ import annotations

from pneumo_ros.arrays import Array
from pneumo_ros.effects.contract import Effect, Memory, Values
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import STILL_FOLLOWS, EffectParameter
from pneumo_ros.laws.signal import scaled, unscaled
from pneumo_ros.rig.channels import DISPLACEMENTS


def outputs(
    outputs: Array, period: float, channels: tuple[int, ...], values: Values, memory: Memory
) -> tuple[Array, Memory]:
    """What the sensor reports."""
    outputs[:, channels] = scaled(outputs[:, channels], values[0])
    return outputs, None


def undo(measured: Array, channels: tuple[int, ...], values: Values) -> Array:
    """What was really there."""
    measured[:, channels] = unscaled(measured[:, channels], values[0])
    return measured


EFFECT = Effect(
    id="lvdt_scale",
    summary="an LVDT's sensitivity is off",
    sites=DISPLACEMENTS,
    places=(),
    parameters=(
        EffectParameter("scale_error", "1", -0.5, 0.5, 0.03, size=True, meaning="error of the sensitivity, as a share"),
    ),
    outputs=outputs,
    undo=undo,
    follows=STILL_FOLLOWS,
    guide=Guide(
        meaning="An LVDT's sensitivity is off.",
        check=(
            "put a gauge block of 10 mm under the core: the reading is off by {scale_error}; pneumo calibrate "
            "fits a new line"
        ),
        mistaken_for={"lvdt_offset": "is the same at every height"},
    ),
)
