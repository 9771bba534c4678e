"""Air leaks from a spring to the atmosphere through an opening that no valve commands (Eq. 4.11's law)."""

from __future__ import annotations

from pneumo_ros.gap.effects.base import ENDS, Effect, Ends, Inputs, Values
from pneumo_ros.gap.model import EffectParameter


def inputs(inputs: Inputs, period: float, ends: Ends, values: Values) -> Inputs:
    """Adds to the outlet openings (columns 2 and 3)."""
    commands = inputs.commands.copy()
    for end in ends.columns:
        commands[:, 2 + end] += values[0]
    return inputs._replace(commands=commands)


EFFECT = Effect(
    id="leak",
    summary="the spring or its fittings leak to the atmosphere",
    sites=ENDS,
    places=("{end}_air",),
    parameters=(EffectParameter("leak_area", "m2", 0.0, 5e-6, 2e-7, size=True),),
    inputs=inputs,
)
