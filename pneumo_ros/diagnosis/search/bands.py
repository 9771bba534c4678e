# SPDX-License-Identifier: Apache-2.0
"""How far must a command move before a part that sticks follows?

Such a part stays, and where it goes to depends on where it stayed before: a band that is off by a few per cent is
another record of jumps, and no gradient leads from the one to the other. So every band within the bounds is simulated,
a few per cent from the next, beside what a fit holds, and compared with the residual like any candidate
(:mod:`pneumo_ros.diagnosis.search.screening`), at the log's full rate: at half of it such a part jumps to other
commands, which move by a tenth of a band from row to row. What is fitted is sharpened the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Protocol, runtime_checkable

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit, refreshed
from pneumo_ros.diagnosis.model import Model
from pneumo_ros.diagnosis.search.fitting import of_law
from pneumo_ros.diagnosis.search.intervals import HasIntervals, simulated
from pneumo_ros.diagnosis.search.parts import reduced, shape_alone
from pneumo_ros.diagnosis.search.screening import compatible

RATIO: Final = 1.03  # of neighbouring bands [numerics]
FINER: Final = 7  # bands tried between the neighbours of the best one [numerics]
SMALLEST: Final = 0.04  # standard deviations of a command that bands are tried from [numerics]
LARGEST: Final = 2.5  # standard deviations of a command that bands are tried up to [numerics]
BARE: Final = 3  # iterations of a fit without what sticks, before its band is looked for anew [numerics]


@runtime_checkable
class Sticks(Protocol):
    """A shape that may stick."""

    @property
    def sticks(self) -> tuple[int, int] | tuple[()]:
        """Which of its parameters are the share that sticks and the band; empty where none does."""


def with_bands(problem: Problem, base: Fit) -> Problem:
    """The problem with start values of every shape that may stick, beside a fit that has none of its family there; the
    problem itself where none explains anything. At both ends with one band only where each end explains something by
    one of its own: half of two that stick explains less than both, but not nothing.
    """
    found: dict[Part, tuple[float, ...]] = {}
    for shape, which in _shapes_that_stick(problem.model):
        if not all(compatible(problem.model, shape, part) for part in base.candidate.parts):
            continue
        if shape[1] == "both" and sum(name == shape[0] for name, _ in found) < 2:
            continue
        best = _best(problem, base, shape, which, _bands(problem, shape, which[1]))
        if best is not None:
            band = best[which[1]]
            near = np.geomspace(band / RATIO, band * RATIO, FINER).tolist()
            found[shape] = _best(problem, base, shape, which, near) or best
    return replace(problem, scanned={**problem.scanned, **found}) if found else problem


def sharpened_bands(problem: Problem, found: Fit, iterations: int) -> Fit:
    """A fit whose bands are looked for anew, beside the rest of it, and that is fitted on from there; itself where that
    is no better. Not beside all of it: the other unknowns have adapted to the jumps that it has, and with a band that
    is off a play does as well.
    """
    best = found
    for shape, _ in _shapes_that_stick(problem.model):
        if shape not in found.candidate.parts:
            continue
        (law,) = (law for law in found.candidate.laws if shape in of_law(found.candidate, law))
        bare = refreshed(problem, reduced(problem, best, of_law(best.candidate, law), BARE))
        anew = None if bare.diverged else with_bands(problem, bare).scanned.get(shape)
        if anew is None or anew == problem.scanned.get(shape):
            continue
        start = shape_alone(problem, best, shape, anew, (), problem.values(best.candidate, best.x).tolist())
        x = problem.start(best.candidate, bare.x[: problem.fixed], start)
        other = fit(problem, best.candidate, x, None, iterations=iterations)
        best = other if other.cost < best.cost else best
    return best


def _shapes_that_stick(model: Model) -> list[tuple[Part, tuple[int, int]]]:
    """Id and site of every shape that may stick, with :attr:`Sticks.sticks`."""
    shapes = [((e.id, site), e.sticks) for e in model.effects.values() if isinstance(e, Sticks) and e.sticks
              for site in e.sites]  # fmt: skip
    return sorted(shapes, key=lambda one: one[0][1] == "both")  # each end before both of them


def _best(
    problem: Problem, base: Fit, shape: Part, which: tuple[int, int], bands: Sequence[float]
) -> tuple[float, ...] | None:
    """Values of a shape that sticks, with the band that explains most; None where none explains anything."""
    found = simulated(problem, base, shape, which, [(band,) for band in bands], coarsely=False)
    return found[0] if found else None


def _bands(problem: Problem, shape: Part, band: int) -> list[float]:
    """Bands worth trying, SI, neighbours by :data:`RATIO`: of a few per cent of what the command moves by, and more, up
    to so much that it would hardly ever be followed; none where it stands still.
    """
    model, parameter = problem.model, problem.parameters_of[shape][band]
    low, high = parameter.low, parameter.high
    if isinstance(model, HasIntervals):
        amount = max(model.amount(record, column) for record in problem.records for column in model.columns(shape[1]))
        low, high = max(low, SMALLEST * amount), min(high, LARGEST * amount)
    if not low < high:
        return []
    return np.geomspace(low, high, 1 + int(np.ceil(np.log(high / low) / np.log(RATIO)))).tolist()
