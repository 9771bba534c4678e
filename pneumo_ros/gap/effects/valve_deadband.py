"""The valve does not answer small commands: overlap near the seat, and a spool that sticks until pulled far enough."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.gap.effects.base import ENDS, Effect, Ends, Inputs, Values
from pneumo_ros.gap.model import EffectParameter


@njit(cache=True)
def _played(u: NDArray[np.float64], half: float) -> NDArray[np.float64]:
    """Backlash of half width ``half``: the follower moves only when pushed."""
    y = np.empty_like(u)
    held = u[0]
    for i in range(u.shape[0]):
        held = min(max(held, u[i] - half), u[i] + half)
        y[i] = held
    return y


def inputs(inputs: Inputs, period: float, ends: Ends, values: Values) -> Inputs:
    """Inlets of the given ends: sticking, then overlap."""
    commands = inputs.commands.copy()
    for end in ends.columns:
        commands[:, end] = np.maximum(_played(commands[:, end], values[1]) - values[0], 0.0)
    return inputs._replace(commands=commands)


EFFECT = Effect(
    id="valve_deadband",
    summary="the inlet valve ignores small commands (overlap, sticking spool)",
    sites=ENDS,
    places=("{end}_air",),
    parameters=(
        EffectParameter("overlap_area", "m2", 0.0, 1e-6, 6e-8, size=True),
        EffectParameter("sticking_area", "m2", 0.0, 5e-7, 4e-8, size=True),
    ),
    inputs=inputs,
)
