# SPDX-License-Identifier: Apache-2.0
"""How long are the waves of a part over its coordinate?

A wave as long as the travel is a slope, a curvature or next to nothing, and from there no gradient leads to the length
it has: so a few lengths are simulated with both phases beside a fit, as far from each other as the travel of a session
tells apart. Where to begin is the length whose two phases explain most of what the fit leaves.
"""

from __future__ import annotations

from typing import Final, Protocol, runtime_checkable

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.diagnosis.search.screening import FOLLOWED, changes, projected

LENGTHS: Final = 8  # tried between the bounds [numerics]


@runtime_checkable
class HasWaves(Protocol):
    """A shape that may have waves."""

    @property
    def waves(self) -> tuple[int, int, int] | tuple[()]:
        """Which of its parameters are the sizes of the even and of the odd wave and how many there are a unit of the
        coordinate; empty where there are none.
        """


def begun_waves(problem: Problem, base: Fit, part: Part) -> list[float]:
    """Start values, SI, of a shape with waves beside a fit without it, all else at nothing; empty for other parts, and
    where no wave can be simulated.
    """
    effect, parameters = problem.model.effects[part[0]], problem.parameters_of[part]
    if not isinstance(effect, HasWaves) or not effect.waves:
        return []
    *phases, number = effect.waves
    still = [0.0 if p.size else p.typical for p in parameters]
    starts = []
    for count in np.linspace(parameters[number].low, parameters[number].high, LENGTHS).tolist():
        for phase in phases:
            values = list(still)
            values[phase], values[number] = parameters[phase].typical, count
            starts.append(((part,), tuple(values)))
    tried = changes(problem, base, starts)
    couples = [(one, two) for one, two in zip(tried[::2], tried[1::2], strict=True) if one and two]
    if not couples:
        return []
    gram, with_residual, _ = projected(problem, base, [one for couple in couples for one in couple])
    best, explained = still, 0.0
    for k, couple in enumerate(couples):
        own = slice(2 * k, 2 * k + 2)
        size = np.linalg.lstsq(gram[own, own], -with_residual[own], rcond=None)[0]
        size = np.clip(size, -FOLLOWED, FOLLOWED)  # the line of a trial is followed no further
        gain = float(-2.0 * with_residual[own] @ size - size @ gram[own, own] @ size)
        if gain > explained:
            explained, best = gain, list(still)
            best[number] = couple[0].values[number]
            for phase, one, factor in zip(phases, couple, size, strict=True):
                best[phase] = float(factor * one.values[phase])
    return best
