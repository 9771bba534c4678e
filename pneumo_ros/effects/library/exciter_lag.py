# SPDX-License-Identifier: Apache-2.0
"""The road exciter follows its command as a second order lag, so that the tyre meets less road, later."""

from __future__ import annotations

from pneumo_ros.effects.contract import ENDS, Effect, Ends, Inputs, Memory, Values, by_column
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import Derived, EffectParameter
from pneumo_ros.laws.filters import lagged_line


def inputs(inputs: Inputs, period: float, ends: Ends, values: Values, memory: Memory) -> tuple[Inputs, Memory]:
    """Road heights that really act."""
    road, memory = by_column(
        lambda u, kept: lagged_line(u, period, values[0], values[1], kept), inputs.road, ends.columns, memory
    )
    return inputs._replace(road=road), memory


EFFECT = Effect(
    id="exciter_lag",
    summary="the road exciter follows its command late",
    sites=ENDS,
    places=("road_input",),
    parameters=(
        EffectParameter(
            "exciter_lag", "s", 0.0, 0.1, 0.005, size=True, starts=(0.015,), meaning="time constant of the exciter"
        ),
        EffectParameter("exciter_damping_ratio", "1", 0.3, 2.0, 0.8, meaning="below 1 it overshoots"),
    ),
    derived=(Derived("exciter_total_lag", "s", lambda p: 2.0 * p[1] * p[0]),),  # of a slow signal
    inputs=inputs,
    guide=Guide(
        meaning="The road exciter follows its command late and rounds its corners.",
        check=(
            "put an LVDT or dial gauge on the exciter's table and play a step: the table has gone two thirds of "
            "the way {exciter_lag} after the command"
        ),
        mistaken_for={"tyre_damping": "leaves the exciter's own position right"},
    ),
)
