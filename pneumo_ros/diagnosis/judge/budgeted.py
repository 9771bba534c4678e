# SPDX-License-Identifier: Apache-2.0
"""The budget as the diagnosis tells it: shares, laws, probabilities, measured curves, and the remainder's place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, sensitivities
from pneumo_ros.diagnosis.fit.uncertainty import covariance
from pneumo_ros.diagnosis.judge.budget import Budget
from pneumo_ros.diagnosis.judge.closable import WORTH
from pneumo_ros.diagnosis.judge.closable import Remainder as Closing
from pneumo_ros.diagnosis.judge.outcome import Outcome
from pneumo_ros.diagnosis.judge.verdict import Opinion
from pneumo_ros.diagnosis.model import HasCurves
from pneumo_ros.diagnosis.result import DIFFERS, BudgetEntry, Remainder
from pneumo_ros.diagnosis.search.fitting import of_law
from pneumo_ros.effects.parameters import ANYTHING, Active, Curve, family_of

NINETY: Final = 1.645  # standard deviations of half a 90 % band [definition]


@dataclass(frozen=True)
class Shares:
    """The budget with its remainder, as the result holds it."""

    entries: tuple[BudgetEntry, ...]
    refit: float
    remainder: Remainder | None
    floor: float


def budgeted(outcome: Outcome, opinion: Opinion) -> Shares:
    """Shares of the best structure."""
    best, found = outcome.best, outcome.budget
    cov = covariance(outcome.problem, best, absent=True)
    entries = outcome.problem.each(lambda law: _entry(outcome, opinion, found, law, cov), best.candidate.laws)
    ranked = tuple(sorted(entries, key=lambda e: -e.share))
    return Shares(ranked, found.refit, _remainder(outcome, found), found.floor)


def _entry(outcome: Outcome, opinion: Opinion, found: Budget, law: Part, cov: Array) -> BudgetEntry:
    problem, best = outcome.problem, outcome.best
    parts = of_law(best.candidate, law)
    where = problem.model.places(Active(*law, ()))
    share = found.effects[law]
    name = DIFFERS if len(parts) > 1 else law[0]
    known = next((e for e in outcome.closable.effects if e.law == law), None)
    form = 1.0 if known is None else left_by_form(known.own, known.without)
    curve = measured_curve(problem, best, outcome.holdout, parts, cov, form)
    side = problem.model.side(Active(*law, ()))
    return BudgetEntry((family_of(law[0]),), side, where, share.value, share.ci90, name,
                       float(opinion.effects.get(law, 0.0)), curve)  # fmt: skip


def left_by_form(left: float, whole: float) -> float:
    """Largest relative error of an effect's law that the held-out log allows, 0 to 1: sqrt(left / whole).

    Whatever is left with the effect fitted may be an error of its law; ``left`` and ``whole`` are the mean squares of
    the held-out gap with the effect and without it.
    """
    return float(np.sqrt(np.clip(left / max(whole, 1e-12), 0.0, 1.0)))


def measured_curve(
    problem: Problem, one: Fit, record: object, parts: Sequence[Part], cov: Array, form: float
) -> Curve | None:
    """Measured law of an effect in a fitted structure, with a 90 % band; None where the effect has no curve.

    The band holds the parameters' covariance and, added in squares, ``form`` times the rms of the curve: the error
    that the law itself may have (:func:`left_by_form`). Of flexible corrections at several places, or of
    several kinds at one, the curve is that of the most used one, in typical amplitudes: a force and a flow have no
    common axes.

    Parameters
    ----------
    problem, one : the fitted logs and the structure fitted to them
    record : log along which the curve is evaluated
    parts : the effect's law and shapes, all at one site
    cov : covariance of all scaled unknowns of the fit
    form : relative error of the law, 0 to 1
    """
    model = problem.model
    if not isinstance(model, HasCurves) or not parts:
        return None
    active = problem.active(one.candidate, problem.values(one.candidate, one.x))
    if family_of(parts[0][0]) == ANYTHING:
        used = {part: _used(problem, it) for part, it in zip(one.candidate.parts, active, strict=True)}
        parts = [max(parts, key=used.__getitem__)]
    own: list[Active] = []
    columns: list[int] = []
    first = problem.fixed
    scale = np.array([p.typical for p in problem.effect_parameters(one.candidate)])
    for part, acting in zip(one.candidate.parts, active, strict=True):
        if part in parts:
            own.append(acting)
            columns += range(first, first + len(acting.values))
        first += len(acting.values)
    size = scale[np.array(columns) - problem.fixed]
    known = cov[np.ix_(columns, columns)] * np.outer(size, size)
    found = model.curve(record, problem.nuisance(one.x), active, own, known)
    return None if found is None else _widened(found, form)


def _used(problem: Problem, acting: Active) -> float:
    """Largest amplitude of an effect, in typical ones."""
    parameters = problem.model.effects[acting.effect].parameters
    return max(abs(value) / p.typical for p, value in zip(parameters, acting.values, strict=True) if p.size)


def _widened(curve: Curve, form: float) -> Curve:
    x, y, low, high, weight = np.asarray(curve.points).T
    more = NINETY * form * float(np.sqrt(np.sum(weight * y * y) / max(float(np.sum(weight)), 1e-12)))
    return replace(
        curve, points=np.column_stack([x, y, y - np.hypot(y - low, more), y + np.hypot(high - y, more), weight])
    )


def _remainder(outcome: Outcome, found: Budget) -> Remainder | None:
    if found.remainder <= 0.0:
        return None
    closing = _place_of_rest(outcome)
    if closing is None:
        return Remainder(found.remainder)
    problem = outcome.problem
    fitted = sensitivities(problem, closing.fit)
    cov, form = covariance(problem, fitted, absent=True), left_by_form(closing.gap, outcome.closable.own)
    curve = measured_curve(problem, fitted, outcome.holdout, closing.parts, cov, form)
    return Remainder(found.remainder, closing.places, curve)


def _place_of_rest(outcome: Outcome) -> Closing | None:
    """The place at which most of what the structure leaves can be closed."""
    beside = outcome.closable
    if not beside.remainders:
        return None
    best = beside.remainders[0]
    return best if best.gap < (1.0 - WORTH) * beside.own else None
