# SPDX-License-Identifier: Apache-2.0
"""What structures leave in a rig's own equations, a judgement that is independent of the free run that fitted them.

Effects act along the measured motion there, so that one which draws the free run towards the log with a wrong law is
found out where its forces and flows are not those of the rig.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Protocol

import numpy as np

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.effects.parameters import Active


class Equations(Protocol):
    """The equations of a rig along its held-out log."""

    def left(self, nuisance: Array, active: Sequence[Active]) -> Array:
        """Mean square, null variances, that (P,) tolerances and effects leave in each equation, (E,)."""
        ...

    def of(self, places: Sequence[str]) -> Mask:
        """Which equations something at some places of the contract acts in, (E,)."""
        ...


# Mean square, null variances, that noise, tolerances and model form leave anyway [definition]
EXPLAINED: Final = 1.0
# Mean square above that, from which on the equations show a gap: rigs without one leave up to 0.6 [taste]
SHOWN: Final = 2.0


def kept(left: float, before: float) -> float:
    """Share of what the equations miss before, above noise and form, that is left: near zero for the right kind of law,
    near one for what does not act in them, above where it puts forces that the rig does not have.

    A gap that the equations hardly show counts as :data:`SHOWN`. Both mean squares in null variances.
    """
    return max(left - EXPLAINED, 0.0) / max(before - EXPLAINED, SHOWN)


def held_up(left: float, without: float) -> float:
    """How much more the equations miss without an effect, over what they miss with it: 0 where they do not miss it,
    above one where they miss more than twice as much and so hold it up. Mean squares in null variances.
    """
    own = max(left, EXPLAINED)
    return max(without - own, 0.0) / own


def left_in(equations: Equations, problem: Problem, one: Fit) -> Array:
    """Mean square that a structure leaves in each equation, (E,), null variances."""
    return equations.left(problem.nuisance(one.x), problem.active(one.candidate, problem.values(one.candidate, one.x)))


def mean_in(left: Array, acting: Mask) -> float:
    """Mean square left in the equations that something acts in; in all where it acts in none.

    What is missing in the others says nothing of it: one sensor that is late may fill all of them.
    """
    return float(np.mean(left[acting])) if np.any(acting) else float(np.mean(left))


def mended_in(left: Array, before: Array, acting: Mask) -> float:
    """:func:`kept` in the equations that something acts in; infinite where these hardly show a gap before."""
    own, other = mean_in(left, acting), mean_in(before, acting)
    return kept(own, other) if other - EXPLAINED >= SHOWN else np.inf
