# SPDX-License-Identifier: Apache-2.0
"""Commands reach the valves late by a pure delay (bus, driver, line), any fraction of a sample."""

from __future__ import annotations

from pneumo_ros.effects.contract import ENDS, Effect, Ends, Inputs, Memory, Values, by_column
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.laws.filters import delayed_hold


def inputs(inputs: Inputs, period: float, ends: Ends, values: Values, memory: Memory) -> tuple[Inputs, Memory]:
    """Mean opening over each period, inlets and outlets of the given ends."""
    columns = [column for end in ends.columns for column in (end, 2 + end)]
    commands, memory = by_column(
        lambda u, kept: delayed_hold(u, period, values[0], kept), inputs.commands, columns, memory
    )
    return inputs._replace(commands=commands), memory


EFFECT = Effect(
    id="transport_delay",
    summary="the valve command acts late by a pure delay",
    sites=ENDS,
    places=("{end}_air",),
    parameters=(
        EffectParameter("delay", "s", 0.0, 0.2, 0.012, size=True, starts=(0.04,), meaning="time until a command acts"),
    ),
    inputs=inputs,
    guide=Guide(
        meaning="The command acts late by a pure delay: bus, driver, valve electronics.",
        check="step one inlet open at rest: for {delay} nothing happens, then the pressure rises at its full rate",
        mistaken_for={"valve_lag": "begins at once but slowly", "exciter_lag": "concerns the road, not the valves"},
    ),
)
