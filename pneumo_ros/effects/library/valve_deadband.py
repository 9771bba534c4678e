# SPDX-License-Identifier: Apache-2.0
"""The valve does not answer small commands: overlap near the seat, and a spool that sticks until pulled far enough."""

from __future__ import annotations

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.effects.contract import ENDS, Effect, Ends, Inputs, Memory, Values, by_column
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.laws.filters import play
from pneumo_ros.laws.signal import dead


def inputs(inputs: Inputs, period: float, ends: Ends, values: Values, memory: Memory) -> tuple[Inputs, Memory]:
    """Inlets of the given ends: sticking, then overlap."""

    def opened(u: Array, held: Memory) -> tuple[Array, Memory]:
        moved, held = play(u, values[1], held)
        return np.maximum(moved - dead(moved, values[0]), 0.0), held

    commands, memory = by_column(opened, inputs.commands, ends.columns, memory)
    return inputs._replace(commands=commands), memory


EFFECT = Effect(
    id="valve_deadband",
    summary="the inlet valve ignores small commands (overlap, sticking spool)",
    sites=ENDS,
    places=("{end}_air",),
    parameters=(
        EffectParameter(
            "overlap_area", "m2", 0.0, 1e-6, 6e-8, size=True, meaning="command below which the inlet stays shut"
        ),
        EffectParameter(
            "sticking_area",
            "m2",
            0.0,
            5e-7,
            4e-8,
            size=True,
            meaning="half the change of command that the spool ignores",
        ),
    ),
    inputs=inputs,
    guide=Guide(
        meaning="The inlet ignores small commands: overlap of the spool, or it sticks and follows in jumps.",
        check=(
            "raise one inlet's command slowly from zero with all else closed: no pressure moves below "
            "{overlap_area}; lower it again: where it stops differs by up to twice {sticking_area} if the spool "
            "sticks"
        ),
        mistaken_for={
            "orifice_coefficient": "is a factor at every opening",
            "valve_lag": "shows with large steps as well",
        },
    ),
)
