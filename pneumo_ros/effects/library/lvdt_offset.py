"""An LVDT whose zero has moved."""

from __future__ import annotations

from pneumo_ros.arrays import Array
from pneumo_ros.effects.contract import Effect, Memory, Values
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.rig.channels import DISPLACEMENTS


def outputs(
    outputs: Array, period: float, channels: tuple[int, ...], values: Values, memory: Memory
) -> tuple[Array, Memory]:
    """What the sensor reports."""
    outputs[:, channels] += values[0]
    return outputs, None


def undo(measured: Array, channels: tuple[int, ...], values: Values) -> Array:
    """What was really there."""
    measured[:, channels] -= values[0]
    return measured


EFFECT = Effect(
    id="lvdt_offset",
    summary="an LVDT's zero is off",
    sites=DISPLACEMENTS,
    places=(),
    parameters=(EffectParameter("offset", "m", -0.03, 0.03, 1e-3, size=True),),
    outputs=outputs,
    undo=undo,
)
