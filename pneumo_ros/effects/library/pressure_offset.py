"""A pressure sensor whose zero has moved."""

from __future__ import annotations

from pneumo_ros.arrays import Array
from pneumo_ros.effects.contract import PRESSURES_OR_BOTH, Effect, Memory, Values
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import EffectParameter


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
    id="pressure_offset",
    summary="a pressure sensor's zero is off",
    sites=PRESSURES_OR_BOTH,
    places=(),
    parameters=(EffectParameter("offset", "Pa", -6e4, 6e4, 2e3, size=True),),
    outputs=outputs,
    undo=undo,
    guide=Guide(
        meaning="A pressure sensor's zero is off.",
        check="vent the spring: the sensor says {offset} more (less) than the barometer",
        mistaken_for={
            "pressure_scale": "vented, the sensor is right",
            "payload": "the scales under the axles agree with the rig file",
        },
    ),
)
