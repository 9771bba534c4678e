# SPDX-License-Identifier: Apache-2.0
"""Beyond laws and pairs: shapes beside laws, further effects one at a time, exchange, and elimination.

A law of the library is seldom the rig's own. So each structure that leads is fitted once more with the shapes of its
families (:mod:`pneumo_ros.effects.shapes`) beside its laws, and a further effect counts only for what those cannot
close: the misfit of a law must not pass for a second effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit, refreshed
from pneumo_ros.diagnosis.search.competition import room_for_more
from pneumo_ros.diagnosis.search.fitting import of_law, probed, probed_one, short_fits, varied
from pneumo_ros.diagnosis.search.intervals import intervals, shapes_that_take, sharpened, taken_at
from pneumo_ros.diagnosis.search.parts import STEPS, beginnings, begun, reduced, rival, shaped, shapes_of, with_shapes
from pneumo_ros.diagnosis.search.screening import (
    CandidateScore,
    all_parts,
    as_scanned,
    candidate_scores,
    compatible,
    trials,
)
from pneumo_ros.diagnosis.search.selection import (
    SAME,
    THIRD,
    Scored,
    Thresholds,
    by_families,
    gained,
    likeliest,
    log_weight,
    score,
    select,
)
from pneumo_ros.diagnosis.search.state import Search
from pneumo_ros.effects.parameters import Active, family_of

MOST: Final = 6  # effects in a structure [numerics]
SHAPED: Final = 2  # leading pairs that are fitted with their shapes [numerics]
COUNTS: Final = (10, 4, 2)  # further effects probed, fitted shortly, fitted to the end [numerics]
GAINS: Final = 0.5  # of the best short fit's gain: what another one must gain to be fitted to the end [numerics]
EXCHANGED: Final = (4, 2)  # exchanges probed for each effect; those of so many effects fitted shortly [numerics]
ROUNDS: Final = 9  # additions and exchanges at most [numerics]
MISFIT: Final = 1.0  # mean square on the kept blocks, sigma squared, above which exchanges are tried [taste]
MISFIT_OF_REFIT: Final = 0.001  # the same as a share of the refit's [taste]
# Share of the gain that would be evident: what a round must bring, as a step towards one that is [taste]
STEP: Final = 0.3
EXCHANGES: Final = 6  # exchanges tried on the way [numerics]
POLISHES: Final = 3  # exchanges tried at the end, however little is left [numerics]
PASSES: Final = 2  # over the effects of the best structure, exchanging each; the second where the first did [numerics]
RIVALS: Final = 2  # families fitted in place of each effect then [numerics]
CLOSE: Final = 12.0  # log weight that a structure of other families may be behind to be fitted to the end [numerics]
ENDED: Final = 3  # structures of as many effects that are fitted to the end [numerics]
# Share (rms) of what the refit leaves, above which a structure leaves most of it: then singles are looked for by their
# families' shapes [taste]
HALF: Final = 0.5
BY_SHAPES: Final = (9, 3)  # places whose best is fitted shortly, and of these to the end [numerics]
IDLE: Final = 0.02  # mean square, sigma squared, that a shape may close without being missed [taste]


def grow(search: Search, limits: Thresholds, further: bool = True) -> None:
    """Add to ``search.structures``: leading pairs with their shapes, and what grows from the best."""
    search.progress(0.82, "shapes")
    search.structures += shaped(search.problem, search.pairs[:SHAPED])
    best = _selected(search, limits)
    if _unexplained(search, best) and room_for_more(search):
        search.structures += _by_shapes(search)
        best = _selected(search, limits)
    if further and best.size and room_for_more(search):
        _climb(search, best, max(limits.second_cost, limits.second_share * best.samples))
        best = _selected(search, limits)
        if _much_left(search, best) and _rescanned(search, best.fit):
            rescanned = _selected(search, limits)
            if rescanned.fit is not best.fit and _much_left(search, rescanned):
                _climb(search, rescanned, max(limits.second_cost, limits.second_share * best.samples))
            best = _selected(search, limits)
    if further and best.size >= THIRD:
        best = _polished(search, best, limits)
    if best.size > 1:
        _refine(search, best, limits)
        refined = _selected(search, limits)
        if further and refined.fit is not best.fit and _much_left(search, refined) and room_for_more(search):
            _climb(search, refined, max(limits.second_cost, limits.second_share * best.samples))
        _end(search, _selected(search, limits))
    best = _selected(search, limits)
    sharper = sharpened(search.problem, best.fit, search.effort.long)
    if sharper is not best.fit:
        search.structures.append(sharper)
        best = _selected(search, limits)
    if best.size and best.fit.candidate.shapes:
        search.structures.append(_without_idle_shapes(search, best.fit))


def _unexplained(search: Search, best: Scored) -> bool:
    """Whether no pair was found and the best single leaves most of what the refit leaves, and that is much."""
    most = best.level > HALF**2 * score(search.problem, search.refit).level
    return best.size < 2 and most and _much_left(search, best)


def _by_shapes(search: Search) -> list[Fit]:
    """Single effects as their families' shapes find them at the refit, the best families.

    The screening of singles sees the library's laws at a few values. Where none of them explains anything, a law that
    is far from all of these may still lie in its family's shape: a tank that a long run empties. Each place's best is
    tried.
    """
    problem, effort = search.problem, search.effort
    search.progress(0.83, "every family by its shape")
    base = refreshed(problem, search.refit)
    ranked = probed(problem, base, [_with_shape(problem, one) for one in search.screened])
    of_place: dict[str, CandidateScore] = {}
    for one in ranked:  # probes are short: what a place's best family comes to, a fit shows
        of_place.setdefault(problem.model.places(Active(*one.parts[0], ()))[0], one)
    short = short_fits(search, base, list(of_place.values())[: BY_SHAPES[0]], (0.83, 0.84))[: BY_SHAPES[1]]
    return problem.each(lambda one: fit(problem, one.candidate, one.x, one.jacobian, iterations=effort.long), short)


def _climb(search: Search, start: Scored, evident: float) -> None:
    """Structures of ever more effects, by floating search (Pudil, Novovicova, Kittler 1994, Pattern Recognition Letters
    15, 1119-1125): after each addition, an effect that the others have made needless goes, one that another serves
    better is exchanged, and what has room then may come. ``evident`` is the gain that a further effect must bring at
    last.
    """
    problem, worth = search.problem, STEP * evident

    def price(one: Fit) -> float:
        return score(problem, one).price

    current, known, exchanges = start.fit, {start.size: start.price}, EXCHANGES
    for number in range(ROUNDS):
        search.progress(0.84 + 0.05 * number / ROUNDS, f"beside {current.candidate.label}")
        if _much_left(search, score(problem, current)):
            current = _begun_anew(search, current)
        while exchanges and _much_left(search, score(problem, current)):
            other = _one_exchanged(search, current)
            exchanges -= 1
            if other is None or price(other) > price(current) - worth:
                break
            search.structures.append(other)
            current = other
            known[len(current.candidate.laws)] = price(current)
        found = _one_more(search, current) if len(current.candidate.laws) < MOST else []
        if not found or min(map(price, found)) > price(current) - worth:
            break
        search.structures += found
        current = min(found, key=price)
        size = len(current.candidate.laws)
        known[size] = min(price(current), known.get(size, np.inf))
        less = _one_less(search, current) if size > 2 else None
        if less is not None and price(less) < known.get(size - 1, np.inf) - worth:
            search.structures.append(less)
            current, known[size - 1] = less, price(less)
        if not room_for_more(search):
            break


def _begun_anew(search: Search, found: Fit) -> Fit:
    """The structure with the shapes of its earlier effects begun alone once more: what they did beside fewer effects is
    where small steps keep them, and no more what they do best.
    """
    best = found
    for law in found.candidate.laws[:-1]:
        best = begun(search.problem, best, law, search.effort.long)
    if best is not found:
        search.structures.append(best)
    return best


def _rescanned(search: Search, found: Fit) -> bool:
    """Scan for intervals once more, beside what has been found but for a delay, and fit what they promise; whether they
    promise anything.

    A driver that holds a tenth of the gap is not to be heard in what the refit leaves: the rest is ten times as loud.
    """
    problem = search.problem
    if taken_at(problem, found):
        return False
    families = {family_of(name) for name, _, _ in shapes_that_take(problem.model)}
    late = [law for law in found.candidate.laws if family_of(law[0]) in families]
    bare = reduced(problem, found, [p for law in late for p in of_law(found.candidate, law)], 2) if late else found
    bare = refreshed(problem, bare)
    scanned = {} if bare.diverged else intervals(problem, bare)
    if not scanned:
        return False
    search.problem = problem = replace(problem, scanned=scanned)
    search.exchange = None, None  # there is more to exchange for now
    search.logged = replace(search.logged, scanned=scanned)
    starts = [as_scanned(problem, law) for law in _compatible(problem, bare.candidate.laws)]
    short = short_fits(search, bare, [one for one in starts if one is not None], (0.89, 0.89))
    if short:
        search.structures.append(sharpened(problem, short[0], search.effort.long))
    return True


def _much_left(search: Search, one: Scored) -> bool:
    """Whether a structure leaves so much that others may serve better."""
    return one.level > max(MISFIT, MISFIT_OF_REFIT * score(search.problem, search.refit).level)


def _one_less(search: Search, found: Fit) -> Fit | None:
    """The structure without one of its effects, the one that costs least to remove; the latest effect always stays.

    None where every smaller structure diverges."""
    problem = search.problem
    without = problem.each(lambda law: _without(search, found, law), found.candidate.laws[:-1])
    best = min(without, key=lambda one: one.cost)
    return None if best.diverged else reduced(problem, best, (), STEPS)


def _without(search: Search, found: Fit, law: Part) -> Fit:
    """The structure without one of its effects, after few steps; kept for whoever asks next, until another is asked
    for.
    """
    of, bare = search.bare
    if of is not found:
        search.bare = of, bare = found, {}
    if law not in bare:
        bare[law] = reduced(search.problem, found, of_law(found.candidate, law), 2)
    return bare[law]


def _one_exchanged(search: Search, found: Fit) -> Fit | None:
    """:func:`_best_exchange` of a structure, which is asked for twice where it ends a climb: on the way and at the
    end.
    """
    of, other = search.exchange
    if of is not found:
        other = _best_exchange(search, found)
        search.exchange = found, other
    return other


def _best_exchange(search: Search, found: Fit) -> Fit | None:
    """The structure with one of its effects exchanged for another, or for another site: the best of those fitted.

    What is left without each effect is screened for what may take its place, the likeliest are probed, and the best one
    of each of the most promising effects is fitted: the effect that a structure misses least need not be the wrong one.
    What may act beside all of them is simulated once, beside all of them: what it changes hardly depends on one.
    """
    problem = search.problem
    beside = _compatible(problem, found.candidate.laws)
    simulated = trials(problem, found, beside)

    def instead(law: Part) -> list[tuple[float, CandidateScore, Fit]]:
        bare = _without(search, found, law)
        if bare.diverged:
            return []
        others = [part for part in _compatible(problem, bare.candidate.laws) if part != law and part not in beside]
        tried = [*simulated, *trials(problem, bare, others)]
        screened = varied(candidate_scores(problem, bare, tried), EXCHANGED[0], 2)
        probes = problem.each(lambda one: (*probed_one(problem, bare, _with_shape(problem, one)), bare), screened)
        return sorted(probes, key=lambda item: item[0])[:1]

    each = problem.each(instead, found.candidate.laws)
    chosen = sorted((one for some in each for one in some), key=lambda item: item[0])[: EXCHANGED[1]]
    short = [one for _, entry, bare in chosen for one in short_fits(search, bare, [entry], (0.86, 0.86))]
    ended = problem.each(lambda one: _with_all_shapes(search, one), short)
    return min(ended, key=lambda one: score(problem, one).price, default=None)


def _polished(search: Search, best: Scored, limits: Thresholds) -> Scored:
    """The best structure once its effects have been exchanged for any other, however little it leaves: an area that is
    off and a resonance leave next to nothing of a load, and the load less.
    """
    refit, found = score(search.problem, search.refit), best
    for _ in range(POLISHES):
        other = _one_exchanged(search, found.fit)
        if other is None:
            break
        search.structures.append(other)
        better = score(search.problem, other)
        if likeliest(refit, [found, better]) is found:
            break
        found = better
    return _selected(search, limits)


def _selected(search: Search, limits: Thresholds) -> Scored:
    problem = search.problem
    return select(score(problem, search.refit), [score(problem, f) for f in search.finalists], limits)


def _one_more(search: Search, base: Fit, counts: tuple[int, int, int] = COUNTS) -> list[Fit]:
    """The best structures with one more effect; ``counts`` are probed, fitted shortly, fitted to the end at most."""
    problem, effort = search.problem, search.effort
    leader = refreshed(problem, base)
    others = _compatible(problem, base.candidate.laws)
    screened = varied(candidate_scores(problem, leader, trials(problem, leader, others)), counts[0], 2)
    chosen = probed(problem, leader, [_with_shape(problem, one) for one in screened])[: counts[1]]
    short = short_fits(search, leader, chosen, (0.86, 0.86))

    def ended(one: Fit) -> Fit:
        return _with_all_shapes(search, fit(problem, one.candidate, one.x, one.jacobian, iterations=effort.long))

    least = GAINS * (leader.cost - short[0].cost) if short else 0.0
    return problem.each(ended, [one for one in short[: counts[2]] if leader.cost - one.cost >= least])


def _with_all_shapes(search: Search, one: Fit) -> Fit:
    """A structure whose last law has come just now, with the shapes that it lacks, and its own also begun alone."""
    problem, steps = search.problem, search.effort.short
    return with_shapes(problem, begun(problem, one, one.candidate.laws[-1], steps), steps)


def _with_shape(problem: Problem, one: CandidateScore) -> CandidateScore:
    """A screened effect with its family's shape at nothing, where that needs no screening of its own."""
    if len(one.parts) > 1:
        return one
    missing = shapes_of(problem.model, Candidate(one.parts))
    if any(p.starts and not p.size for part in missing for p in problem.parameters_of[part]):
        return one
    found = dict(zip((p.name for p in problem.parameters_of[one.parts[0]]), one.values, strict=True))
    more = [value for part in missing for value in beginnings(problem, part, found)]
    return replace(one, parts=(*one.parts, *missing), values=(*one.values, *more))


def _compatible(problem: Problem, laws: Sequence[Part]) -> list[Part]:
    """Parts of the library that may act beside all of ``laws``, see :func:`compatible`."""
    return [p for p in all_parts(problem) if all(compatible(problem.model, law, p) for law in laws)]


def _refine(search: Search, best: Scored, limits: Thresholds) -> None:
    """Each effect of the best structure against its rivals of the same place, and against its absence."""
    problem, found = search.problem, best.fit
    for _ in range(PASSES):
        before = found
        for law in found.candidate.laws:
            bare = _without(search, found, law)
            found = found if bare.diverged else _exchanged(search, found, bare, law)
        if found is before:
            break
    for law in found.candidate.laws:
        if len(found.candidate.laws) < 2:
            break
        without = reduced(problem, found, of_law(found.candidate, law))
        more, less = score(problem, found), score(problem, without)
        if gained(less, more) < limits.second or without.cost - found.cost < limits.second_cost:
            found = without
    if found is not best.fit:
        search.structures.append(found)


def _end(search: Search, best: Scored) -> None:
    """Fit to convergence the likeliest structures with as many effects as ``best``, where their weights are close.

    Short fits end at different depths, and that difference must not decide between families."""
    problem = search.problem
    scored = [score(problem, one) for one in search.finalists]
    groups = by_families([one for one in scored if one.size == best.size]).values()
    refit = score(problem, search.refit)
    leading = sorted((group[0] for group in groups), key=lambda one: -log_weight(one, refit))[:ENDED]
    for one in leading:
        if len(leading) > 1 and log_weight(one, refit) > log_weight(leading[0], refit) - CLOSE:
            old = one.fit
            search.structures.append(fit(problem, old.candidate, old.x, old.jacobian, iterations=search.effort.long))


def _exchanged(search: Search, found: Fit, bare: Fit, law: Part) -> Fit:
    """The likeliest of a structure and those with one effect exchanged for the best rivals of its place: the one that
    the probes prefer and, because these are short, the one that the screening does, or the next.
    """
    problem, effort = search.problem, search.effort
    bare = refreshed(problem, bare)
    rivals = [part for part in _compatible(problem, bare.candidate.laws) if rival(problem, law, part)]
    screened = candidate_scores(problem, bare, trials(problem, bare, rivals))[: effort.exchanged]
    screened = [_with_shape(problem, one) for one in screened]
    ranked = probed(problem, bare, screened)
    promising = dict.fromkeys(family_of(one.parts[0][0]) for one in (*ranked[:1], *screened[:1], *ranked))
    chosen = [next(e for e in ranked if family_of(e.parts[0][0]) == family) for family in list(promising)[:RIVALS]]
    short = short_fits(search, bare, chosen, (0.9, 0.9))
    others = problem.each(lambda one: _with_all_shapes(search, one), short)
    search.structures += others  # the worse ones as well: they may be as likely
    return likeliest(score(problem, search.refit), [score(problem, one) for one in (found, *others)]).fit


def _without_idle_shapes(search: Search, found: Fit) -> Fit:
    """The structure without those shapes that the kept blocks do not miss: there the law is the rig's."""
    problem = search.problem
    for bare in (one for one in search.laws if one.candidate.parts == found.candidate.laws):
        if _does(problem, bare, found):
            return bare
    for part in found.candidate.shapes:
        less = reduced(problem, found, (part,), iterations=STEPS)
        found = less if _does(problem, less, found) else found
    return found


def _does(problem: Problem, less: Fit, more: Fit) -> bool:
    """Whether the smaller structure ``less`` predicts the kept blocks as well as ``more`` and has no higher price."""
    one, other = score(problem, less), score(problem, more)
    return one.level <= other.level * (1.0 + SAME) + IDLE and one.price < other.price + 1.0
