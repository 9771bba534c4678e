"""An LVDT whose zero has moved."""

from __future__ import annotations

from pneumo_ros.arrays import Array
from pneumo_ros.effects.contract import LVDTS, Effect, Memory, Values
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
    id="lvdt_offset",
    summary="an LVDT's zero is off",
    sites=LVDTS,
    places=(),
    parameters=(EffectParameter("offset", "m", -0.03, 0.03, 1e-3, size=True),),
    outputs=outputs,
    undo=undo,
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
