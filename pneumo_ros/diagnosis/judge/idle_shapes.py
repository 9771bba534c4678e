# SPDX-License-Identifier: Apache-2.0
"""Shapes that a structure keeps and that do nothing there: where one does, the law that acts is the library's own.

A structure keeps its families' shapes unless the fit without them is as good to a small margin, so one may stay with
sizes of next to nothing: a pure delay of 15 ms with a share of 6e-6 that comes later.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from pneumo_ros.diagnosis.fit.problem import Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.diagnosis.result import DIFFERS, BudgetEntry
from pneumo_ros.diagnosis.search.fitting import of_law
from pneumo_ros.effects.parameters import Active, family_of

# Of their typical values: shapes whose sizes all stay below do nothing that is worth a word. That of a pure delay ended
# at 2e-5, the least of those in docs/blind2 at 0.04 [display]
IDLE: Final = 0.01


def with_own_laws(problem: Problem, best: Fit, entries: Sequence[BudgetEntry]) -> tuple[BudgetEntry, ...]:
    """The budget, in which effects whose shapes do nothing have the library's law."""
    active = problem.active(best.candidate, problem.values(best.candidate, best.x))
    values = dict(zip(best.candidate.parts, (one.values for one in active), strict=True))
    laws = {_key(problem, law): law for law in best.candidate.laws}

    def told(entry: BudgetEntry) -> BudgetEntry:
        law = laws[entry.effects[0], entry.side, entry.places]
        shapes = [part for part in of_law(best.candidate, law) if part in best.candidate.shapes]
        idle = all(_idle(problem, part, values[part]) for part in shapes)
        return replace(entry, law=law[0]) if entry.law == DIFFERS and idle else entry

    return tuple(told(entry) for entry in entries)


def _key(problem: Problem, law: Part) -> tuple[str, str | None, tuple[str, ...]]:
    acting = Active(*law, ())
    return family_of(law[0]), problem.model.side(acting), tuple(problem.model.places(acting))


def _idle(problem: Problem, part: Part, values: Sequence[float]) -> bool:
    sizes = [(value, p) for value, p in zip(values, problem.parameters_of[part], strict=True) if p.size]
    return all(abs(value) <= IDLE * abs(p.typical) for value, p in sizes)
