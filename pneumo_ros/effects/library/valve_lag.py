# SPDX-License-Identifier: Apache-2.0
"""The inlet valve follows its command as a second order lag: 1/((lag s)^2 + 2 damping lag s + 1)."""

from __future__ import annotations

from pneumo_ros.effects.contract import ENDS, Effect, Ends, Inputs, Memory, Values, by_column
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import Derived, EffectParameter
from pneumo_ros.laws.filters import lagged_hold


def inputs(inputs: Inputs, period: float, ends: Ends, values: Values, memory: Memory) -> tuple[Inputs, Memory]:
    """Mean opening over each period, inlets and outlets of the given ends."""
    columns = [column for end in ends.columns for column in (end, 2 + end)]
    commands, memory = by_column(
        lambda u, kept: lagged_hold(u, period, values[0], values[1], kept), inputs.commands, columns, memory
    )
    return inputs._replace(commands=commands), memory


EFFECT = Effect(
    id="valve_lag",
    summary="the valve's opening follows its command late",
    sites=ENDS,
    places=("{end}_air",),
    parameters=(
        EffectParameter(
            "valve_lag", "s", 0.0, 0.15, 0.012, size=True, starts=(0.04,), meaning="time constant of the inlet valve"
        ),
        EffectParameter("valve_damping_ratio", "1", 0.3, 2.0, 0.8, meaning="below 1 the spool overshoots"),
    ),
    derived=(Derived("valve_total_lag", "s", lambda p: 2.0 * p[1] * p[0]),),  # of a slow signal
    inputs=inputs,
    guide=Guide(
        meaning="The valve's opening follows its command late, as a first or second order system.",
        check=(
            "step one inlet open at rest and log the pressure at full rate: it starts to rise at once but slowly, "
            "and rises at two thirds of its full rate {valve_lag} after the step"
        ),
        mistaken_for={
            "transport_delay": "nothing at all happens for a while, then the full rate",
            "pressure_lag": "the force (LVDTs) reacts in time, only the gauge is late",
        },
    ),
)
