# SPDX-License-Identifier: Apache-2.0
"""What structures leave in a rig's own equations, a judgement that is independent of the free run that fitted them.

Effects act along the measured motion there, so that one which draws the free run towards the log with a wrong law is
found out where its forces and flows are not those of the rig.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.effects.parameters import Active

# (nuisance values, effects) -> mean square that they leave in the equations along the held-out log, null variances
Equations = Callable[[Array, tuple[Active, ...]], float]
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


def left_in(equations: Equations, problem: Problem, one: Fit) -> float:
    """Mean square that a structure leaves in the equations, null variances."""
    return equations(problem.nuisance(one.x), problem.active(one.candidate, problem.values(one.candidate, one.x)))
