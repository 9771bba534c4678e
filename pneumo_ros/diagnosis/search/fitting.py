# SPDX-License-Identifier: Apache-2.0
"""From screened candidates to fits: the order they are tried in, short fits, and fits to convergence."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.shooting import fit_from_windows, free_run_failed
from pneumo_ros.diagnosis.fit.solver import Fit, fit
from pneumo_ros.diagnosis.search.screening import CandidateScore
from pneumo_ros.diagnosis.search.state import Effort, Search
from pneumo_ros.effects.parameters import EffectParameter, family_of

PROBE: Final = 5  # iterations of the fit of a probed candidate [numerics]


def rescued(problem: Problem, state: Fit, iterations: int) -> Fit:
    """The fit, or, where its free run failed, the better one that starts from short windows."""
    if not free_run_failed(problem, state):
        return state
    other = fit_from_windows(problem, state.candidate, state.x, iterations)
    return state if other is None or not other.cost < state.cost else other


def varied(screened: Sequence[CandidateScore], count: int, sites: int) -> list[CandidateScore]:
    """Those with the best scores, but not more than a few sites of one effect, so that rivals of another kind get their
    chance.
    """
    taken: list[CandidateScore] = []
    for one in screened:
        kind = [effect for effect, _ in one.parts]
        if sum([effect for effect, _ in p.parts] == kind for p in taken) < sites:
            taken.append(one)
        if len(taken) == count:
            break
    return taken


def probed(problem: Problem, base: Fit, screened: Sequence[CandidateScore]) -> list[CandidateScore]:
    """The screened candidates in the order of their training costs after :data:`PROBE` cheap steps, with the values
    those end at: the screening is linear, and a typical size may be far from the true one.
    """
    return [entry for _, entry in ranked(problem, base, screened)]


def ranked(problem: Problem, base: Fit, screened: Sequence[CandidateScore]) -> list[tuple[float, CandidateScore]]:
    """:func:`probed`, with the training costs."""
    probes = problem.each(lambda entry: probed_one(problem, base, entry), screened)
    return sorted(probes, key=lambda item: item[0])


def probed_one(problem: Problem, base: Fit, entry: CandidateScore) -> tuple[float, CandidateScore]:
    """Training cost of a screened candidate after :data:`PROBE` cheap steps, and the candidate with its values then."""
    own = problem.values(base.candidate, base.x)
    candidate = Candidate((*base.candidate.parts, *entry.parts))
    start = problem.start(candidate, base.x[: problem.fixed], [*own, *entry.values])
    one = fit(problem, candidate, start, base.jacobian, iterations=PROBE, probe=True, shared=len(base.x))
    values = tuple(float(v) for v in problem.values(candidate, one.x)[len(own) :])
    return one.cost, entry if one.diverged else replace(entry, values=values)


def short_fits(search: Search, base: Fit, chosen: Sequence[CandidateScore], span: tuple[float, float]) -> list[Fit]:
    """Each chosen candidate on top of the base, fitted for ``effort.short`` iterations, lowest training cost first;
    those that diverge are noted in ``search.lost``. ``span`` : share of the whole search done before and after.
    """
    problem = search.problem

    def fitted(numbered: tuple[int, CandidateScore]) -> Fit:
        k, entry = numbered
        candidate = Candidate((*base.candidate.parts, *entry.parts))
        search.progress(span[0] + (span[1] - span[0]) * k / len(chosen), candidate.label)
        values = [*problem.values(base.candidate, base.x), *entry.values]
        start = problem.start(candidate, base.x[: problem.fixed], values)
        one = fit(problem, candidate, start, base.jacobian, iterations=search.effort.short, shared=len(base.x))
        return rescued(problem, one, search.effort.short)

    fits = problem.each(fitted, enumerate(chosen))
    search.lost += [one.candidate.label for one in fits if one.diverged]
    return by_cost(one for one in fits if not one.diverged)


def finished(problem: Problem, short: Fit, effort: Effort, anew: Fit | None = None) -> Fit:
    """To convergence, from where the short fit ended; with a fit to start ``anew`` from, also from its effect's other
    shapes and signs there; the best.
    """
    best = fit(problem, short.candidate, short.x, None, iterations=effort.long)
    parameters = problem.effect_parameters(short.candidate)
    if anew is None or all(p.size for p in parameters):
        return best
    for values in starts_elsewhere(parameters, problem.values(best.candidate, best.x)):
        # Not from where this fit ended: its tolerance parameters have adapted to the shape it has.
        start = problem.start(short.candidate, anew.x[: problem.fixed], values)
        other = fit(problem, short.candidate, start, anew.jacobian, iterations=effort.anew)
        if other.cost < best.cost - 1.0:
            best = fit(problem, short.candidate, other.x, None, iterations=effort.long)
    return best


def starts_elsewhere(parameters: Sequence[EffectParameter], found: Array) -> list[list[float]]:
    """Starts away from where a fit ended: each shape at its further starts, and each size with the other sign."""
    out = []
    for k, p in enumerate(parameters):
        if not p.size:
            out += [[value if m == k else float(v) for m, v in enumerate(found)] for value in p.starts]
            continue
        other = [value for value in (p.typical, *p.starts) if value * found[k] < 0.0][:1]
        out += [[value if m == k else q.typical for m, q in enumerate(parameters)] for value in other]
    return out


def by_cost(fits: Iterable[Fit]) -> list[Fit]:
    """Fits, lowest training cost first."""
    return sorted(fits, key=lambda f: f.cost)


def of_law(candidate: Candidate, law: Part) -> tuple[Part, ...]:
    """A law with its family's shape at the same site."""
    return tuple(p for p in candidate.parts if p[1] == law[1] and family_of(p[0]) == family_of(law[0]))


def restricted(problem: Problem, one: Fit, candidate: Candidate) -> Array:
    """The unknowns of a structure that another, smaller one has as well."""
    return np.asarray(one.x[_common(problem, one, candidate)])


def restricted_sensitivities(problem: Problem, one: Fit, candidate: Candidate) -> Array:
    """Sensitivities (n, C, m) of a structure to the unknowns that another, smaller one has as well."""
    assert one.jacobian is not None
    return np.asarray(one.jacobian[:, :, _common(problem, one, candidate)])


def _common(problem: Problem, one: Fit, candidate: Candidate) -> NDArray[np.intp]:
    """Where the unknowns of a smaller structure stand in one's."""
    own, first = {}, problem.fixed
    for part in one.candidate.parts:
        count = len(problem.effect_parameters(Candidate((part,))))
        own[part] = np.arange(first, first + count)
        first += count
    return np.concatenate([np.arange(problem.fixed), *(own[part] for part in candidate.parts)]).astype(np.intp)
