# SPDX-License-Identifier: Apache-2.0
"""An effect of a structure in exchange for another: for any other, and for the rivals of its place."""

from __future__ import annotations

from typing import Final

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit, refreshed
from pneumo_ros.diagnosis.search.fitting import (
    PROBE,
    of_law,
    probed,
    probed_one,
    short_fits,
    varied,
)
from pneumo_ros.diagnosis.search.parts import reduced, rival, with_all_shapes, with_own_shape
from pneumo_ros.diagnosis.search.screening import CandidateScore, candidate_scores, compatible_parts, trials
from pneumo_ros.diagnosis.search.selection import likeliest, score
from pneumo_ros.diagnosis.search.state import Search
from pneumo_ros.effects.parameters import family_of

FEW: Final = 3  # iterations of a structure without one of its effects [numerics]
FOR_EACH: Final = 4  # exchanges screened for each effect that may be probed [numerics]
PROBED: Final = 8  # exchanges probed, of all effects together [numerics]
TINY: Final = 1e-6  # of the misfit: what a share leaves at least [numerics]
RIVALS: Final = 2  # families fitted in place of each effect then [numerics]


def without(search: Search, found: Fit, law: Part) -> Fit:
    """The structure without one of its effects, after few steps; kept for whoever asks next, until another is asked
    for. The steps begin with the structure's own sensitivities: most are to tolerances and hardly change.
    """
    of, bare = search.bare
    if of is not found:
        search.bare = of, bare = found, {}
    if law not in bare:
        whole = fresh(search, found)
        bare[law] = reduced(search.problem, whole, of_law(whole.candidate, law), FEW, borrowed=True)
    return bare[law]


def fresh(search: Search, found: Fit) -> Fit:
    """The structure with its sensitivities taken anew; kept until another is asked for."""
    of, known = search.fresh
    if of is not found or known is None:
        known = refreshed(search.problem, found)
        search.fresh = found, known
    return known


def one_exchanged(search: Search, found: Fit) -> Fit | None:
    """:func:`_best_exchange` of a structure, which is asked for twice where it ends a climb: on the way and at the
    end.
    """
    of, other = search.exchange
    if of is not found:
        other = _best_exchange(search, found)
        search.exchange = found, other
    return other


def _best_exchange(search: Search, found: Fit) -> Fit | None:
    """The structure with one of its effects exchanged for another, or for another site; None where nothing may.

    What is left without each effect is screened for what may take its place, what promises most of all is probed, and
    the best of that is fitted: the effect that a structure misses least need not be the wrong one. What may act beside
    all of them is simulated once, beside all of them: what it changes hardly depends on one.
    """
    problem = search.problem
    fresh(search, found)  # before several ask for it at a time
    beside = compatible_parts(problem, found.candidate.laws)
    simulated = trials(problem, found, beside)

    def instead(law: Part) -> list[tuple[CandidateScore, Fit]]:
        bare = without(search, found, law)
        if bare.diverged:
            return []
        others = [part for part in compatible_parts(problem, bare.candidate.laws) if part != law and part not in beside]
        tried = [*simulated, *trials(problem, bare, others)]
        screened = varied(candidate_scores(problem, bare, tried), FOR_EACH, 2)
        return [(one, bare) for one in screened]

    def promised(one: CandidateScore, bare: Fit) -> float:
        """Training cost where the screening's share of the misfit is explained."""
        return bare.cost + problem.samples * float(np.log(max(1.0 - one.share, TINY)))

    def probe(entry: CandidateScore, bare: Fit) -> tuple[float, CandidateScore, Fit]:
        return (*probed_one(problem, bare, with_own_shape(problem, entry)), bare)

    each = [one for some in problem.each(instead, found.candidate.laws) for one in some]
    likely = sorted(each, key=lambda one: promised(*one))[:PROBED]
    probes = problem.each(lambda one: probe(*one), likely)
    if not probes:
        return None
    _, entry, bare = min(probes, key=lambda item: item[0])
    short = short_fits(search, bare, [entry], (0.86, 0.86))
    return with_all_shapes(problem, short[0], search.effort.short) if short else None


def widened(search: Search, found: Fit) -> Fit | None:
    """The structure with one of its effects at both ends, as it was found at one; None where none may be.

    A law at both ends is compared with the same law at one where both are screened; what its shape has become since
    is not seen there. A few cheap steps of each, and the best is fitted.
    """
    problem, whole = search.problem, fresh(search, found)
    families = [family_of(name) for name, _ in found.candidate.laws]
    alone = [law for law in found.candidate.laws if families.count(family_of(law[0])) == 1]

    def probe(law: Part) -> Fit:
        own = of_law(found.candidate, law)
        first = min(map(found.candidate.parts.index, own))
        candidate = Candidate(tuple((part[0], "both") if part in own else part for part in found.candidate.parts))
        before = problem.effect_parameters(Candidate(found.candidate.parts[:first]))
        return fit(problem, candidate, whole.x, whole.jacobian, iterations=PROBE, probe=True,
                   shared=problem.fixed + len(before))  # fmt: skip

    probes = problem.each(probe, [law for law in alone if _may_widen(problem, law)])
    best = min(probes, key=lambda one: one.cost, default=None)
    if best is None or best.diverged or best.cost > found.cost:
        return None
    return fit(problem, best.candidate, best.x, None, iterations=search.effort.short)


def _may_widen(problem: Problem, law: Part) -> bool:
    """Whether a law that acts at one end may act at both with the same parameters."""
    effect = problem.model.effects[law[0]]
    return (
        law[1] != "both"
        and "both" in effect.sites
        and len(problem.parameters_of[law]) == len(problem.parameters_of[law[0], "both"])
    )


def exchanged_in_place(search: Search, found: Fit, bare: Fit, law: Part) -> Fit:
    """The likeliest of a structure and those with one effect exchanged for the best rivals of its place: the one that
    the probes prefer and, because these are short, the one that the screening does, or the next.
    """
    problem, effort = search.problem, search.effort
    bare = refreshed(problem, bare)
    rivals = [part for part in compatible_parts(problem, bare.candidate.laws) if rival(problem, law, part)]
    screened = candidate_scores(problem, bare, trials(problem, bare, rivals))[: effort.exchanged]
    screened = [with_own_shape(problem, one) for one in screened]
    ranked = probed(problem, bare, screened)
    promising = dict.fromkeys(family_of(one.parts[0][0]) for one in (*ranked[:1], *screened[:1], *ranked))
    chosen = [next(e for e in ranked if family_of(e.parts[0][0]) == family) for family in list(promising)[:RIVALS]]
    short = short_fits(search, bare, chosen, (0.9, 0.9))
    others = problem.each(lambda one: with_all_shapes(problem, one, effort.short), short)
    search.structures += others  # the worse ones as well: they may be as likely
    return likeliest(score(problem, search.refit), [score(problem, one) for one in (found, *others)]).fit
