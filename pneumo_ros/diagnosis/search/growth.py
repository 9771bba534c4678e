# SPDX-License-Identifier: Apache-2.0
"""Beyond laws and pairs: shapes beside laws, further effects one at a time, exchange, and elimination.

A law of the library is seldom the rig's own. So each structure that leads is fitted once more with the shapes of its
families (:mod:`pneumo_ros.effects.shapes`) beside its laws, and a further effect counts only for what those cannot
close: the misfit of a law must not pass for a second effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit, refreshed
from pneumo_ros.diagnosis.search.bands import sharpened_bands, with_bands
from pneumo_ros.diagnosis.search.competition import room_for_more
from pneumo_ros.diagnosis.search.exchange import exchanged_in_place, fresh, one_exchanged, widened, without
from pneumo_ros.diagnosis.search.fitting import by_cost, of_law, probed, ranked, short_fits, varied
from pneumo_ros.diagnosis.search.intervals import intervals, shapes_that_take, sharpened, taken_at
from pneumo_ros.diagnosis.search.parts import STEPS, begun, reduced, shaped, with_all_shapes, with_own_shape
from pneumo_ros.diagnosis.search.screening import (
    SMALL,
    CandidateScore,
    candidate_scores,
    compatible_parts,
    scanned_laws,
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
    relieved,
    score,
    select,
)
from pneumo_ros.diagnosis.search.state import Search
from pneumo_ros.diagnosis.traits import ChangesNumbers
from pneumo_ros.effects.parameters import Active, family_of

MOST: Final = 6  # effects in a structure [numerics]
SHAPED: Final = 2  # leading pairs that are fitted with their shapes [numerics]
COUNTS: Final = (10, 4, 2)  # further effects probed, fitted shortly, fitted to the end [numerics]
# Of the best one's gain: what another one must gain by its probe to be fitted shortly, by that to be fitted to the end
# [numerics]
GAINS: Final = (0.5, 0.8)
ROUNDS: Final = 9  # additions and exchanges at most [numerics]
MISFIT: Final = 1.0  # mean square on the kept blocks, sigma squared, above which exchanges are tried [taste]
MISFIT_OF_REFIT: Final = 0.001  # the same as a share of the refit's [taste]
# Share of the gain that would be evident: what a round must bring, as a step towards one that is [taste]
STEP: Final = 0.3
EXCHANGES: Final = 6  # exchanges tried on the way [numerics]
POLISHES: Final = 3  # exchanges tried at the end, however little is left [numerics]
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
    asked: set[frozenset[Part]] = set()
    if further and best.size and _relief(search, best, limits, asked):
        best = _selected(search, limits)
    if further and best.size >= THIRD:
        best = _polished(search, best, limits)
    if best.size > 1:
        _refine(search, best, limits)
        refined = _selected(search, limits)
        if further and refined.fit is not best.fit and _much_left(search, refined) and room_for_more(search):
            _climb(search, refined, max(limits.second_cost, limits.second_share * best.samples))
        best = _selected(search, limits)
    if best.size:
        _end(search, best)
        best = _selected(search, limits)
    sharper = sharpened(search.problem, best.fit, search.effort.long)
    sharper = sharpened_bands(search.problem, sharper, search.effort.long)
    if sharper is not best.fit:
        search.structures.append(sharper)
        best = _selected(search, limits)
    if further and best.size and _relief(search, best, limits, asked):
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
    likely = probed(problem, base, [with_own_shape(problem, one) for one in search.screened])
    of_place: dict[str, CandidateScore] = {}
    for one in likely:  # probes are short: what a place's best family comes to, a fit shows
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
            wide = widened(search, current)
            if wide is not None and price(wide) < price(current) - worth:
                search.structures.append(wide)
                current = wide
                known[len(wide.candidate.laws)] = price(wide)
        while exchanges and _much_left(search, score(problem, current)):
            other = one_exchanged(search, current)
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
    """The structure with the shapes of its earlier effects begun alone once more, and with the bands of what sticks
    looked for anew: what they did beside fewer effects is where small steps keep them, and no more what they do best.
    """
    best = found
    for law in found.candidate.laws[:-1]:
        best = begun(search.problem, best, law, search.effort.long)
    best = sharpened_bands(search.problem, best, search.effort.short)
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
    search.start_from(scanned)
    problem = search.problem
    search.exchange = None, None  # there is more to exchange for now
    starts = scanned_laws(problem, compatible_parts(problem, bare.candidate.laws), scanned)
    short = short_fits(search, bare, starts, (0.89, 0.89))
    if short:
        search.structures.append(sharpened(problem, short[0], search.effort.long))
    return True


def _relief(search: Search, best: Scored, limits: Thresholds, asked: set[frozenset[Part]]) -> bool:
    """Fit the structure with one effect more that changes the rig's own numbers, where its tolerances may answer for
    one; whether any lets them come back. The best that does is fitted without each earlier one of these as well.

    They can answer for such an effect wholly, so that what is left, which the others are found by, says nothing of it.
    ``asked`` holds the effects of those structures that were asked already, and this one's afterwards.
    """
    problem, own = search.problem, frozenset(best.fit.candidate.laws)
    if best.stretch < limits.relief or best.size >= MOST or own in asked:
        return False
    asked.add(own)
    effects = problem.model.effects
    numbers = [e.id for e in effects.values() if isinstance(e, ChangesNumbers) and e.changes_numbers]
    there = [part for part in compatible_parts(problem, best.fit.candidate.laws) if part[0] in numbers]

    def beside(law: Part) -> Fit:
        """From a small size, with sensitivities of its own: the tolerances move far and all together."""
        candidate = Candidate((*best.fit.candidate.parts, law))
        small = [p.typical * SMALL if p.size else p.typical for p in problem.parameters_of[law]]
        values = [*problem.values(best.fit.candidate, best.fit.x), *small]
        start = problem.start(candidate, best.fit.x[: problem.fixed], values)
        return fit(problem, candidate, start, None, iterations=search.effort.long)

    laws = by_cost(one for one in problem.each(beside, there) if not one.diverged)[: COUNTS[2]]
    cheaper = [one for one in laws if score(problem, one).price < best.price]  # what costs more does not relieve
    found = [*laws, *shaped(problem, cheaper)]
    search.structures += found
    helped = [one for one in found if relieved(best, score(problem, one), limits)]
    if helped:
        search.structures += _without_others(search, min(helped, key=lambda one: score(problem, one).price), numbers)
    return bool(helped)


def _without_others(search: Search, found: Fit, numbers: Sequence[str]) -> list[Fit]:
    """The structure without each of its earlier effects of some kinds: what stood in for the latest one, a load for a
    shift of the centre of mass, need not be there beside it.
    """
    laws = [law for law in found.candidate.laws[:-1] if law[0] in numbers]
    fewer = search.problem.each(
        lambda law: reduced(search.problem, found, of_law(found.candidate, law), search.effort.long), laws
    )
    return [one for one in fewer if not one.diverged]


def _much_left(search: Search, one: Scored) -> bool:
    """Whether a structure leaves so much that others may serve better."""
    return one.level > max(MISFIT, MISFIT_OF_REFIT * score(search.problem, search.refit).level)


def _one_less(search: Search, found: Fit) -> Fit | None:
    """The structure without one of its effects, the one that costs least to remove; the latest effect always stays.

    None where every smaller structure diverges."""
    problem = search.problem
    fresh(search, found)  # before several ask for it at a time
    fewer = problem.each(lambda law: without(search, found, law), found.candidate.laws[:-1])
    best = min(fewer, key=lambda one: one.cost)
    return None if best.diverged else reduced(problem, best, (), STEPS)


def _polished(search: Search, best: Scored, limits: Thresholds) -> Scored:
    """The best structure once its effects have been exchanged for any other, however little it leaves: an area that is
    off and a resonance leave next to nothing of a load, and the load less.
    """
    refit, found = score(search.problem, search.refit), best
    for _ in range(POLISHES):
        other = one_exchanged(search, found.fit)
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
    leader, effort = fresh(search, base), search.effort
    search.start_from(with_bands(search.problem, leader).scanned)
    problem = search.problem
    others = compatible_parts(problem, base.candidate.laws)
    screened = varied(candidate_scores(problem, leader, trials(problem, leader, others)), counts[0], 2)
    probes = ranked(problem, leader, [with_own_shape(problem, one) for one in screened])[: counts[1]]
    chosen = [one for cost, one in probes if leader.cost - cost >= GAINS[0] * (leader.cost - probes[0][0])]
    short = short_fits(search, leader, chosen or [one for _, one in probes], (0.86, 0.86))

    def ended(one: Fit) -> Fit:
        found = fit(problem, one.candidate, one.x, one.jacobian, iterations=effort.long)
        return with_all_shapes(problem, found, effort.short)

    least = GAINS[1] * (leader.cost - short[0].cost) if short else 0.0
    return problem.each(ended, [one for one in short[: counts[2]] if leader.cost - one.cost >= least])


def _refine(search: Search, best: Scored, limits: Thresholds) -> None:
    """Each effect of the best structure against its rivals of the same place, and against its absence."""
    problem, found = search.problem, best.fit
    seen: set[Part] = set()
    while law := next((one for one in found.candidate.laws if one not in seen), None):
        seen.add(law)
        bare = without(search, found, law)
        other = found if bare.diverged else exchanged_in_place(search, found, bare, law)
        if other is not found and found is best.fit:  # those before the first exchange once more, beside what it made
            seen = set(other.candidate.laws) - set(found.candidate.laws)
        found = other
    for law in found.candidate.laws:
        if len(found.candidate.laws) < 2:
            break
        fewer = reduced(problem, found, of_law(found.candidate, law))
        more, less = score(problem, found), score(problem, fewer)
        shown = gained(less, more) >= limits.second and fewer.cost - found.cost >= limits.second_cost
        if not shown and not relieved(less, more, limits):
            found = fewer
    if found is not best.fit:
        search.structures.append(found)


def _end(search: Search, best: Scored) -> None:
    """Fit to convergence the likeliest structures with as many effects as ``best``, where others' weights are close.

    Short fits end at different depths, and that difference must not decide between families; no more may an end at
    which one of them was not tried."""
    problem = search.problem
    scored = [score(problem, one) for one in search.finalists]
    groups = by_families([one for one in scored if one.size == best.size]).values()
    refit = score(problem, search.refit)
    leading = sorted((group[0] for group in groups), key=lambda one: -log_weight(one, refit))[:ENDED]
    close = [one.fit for one in leading if log_weight(one, refit) > log_weight(leading[0], refit) - CLOSE]
    if len(close) > 1:
        ended = problem.each(
            lambda one: fit(problem, one.candidate, one.x, one.jacobian, iterations=search.effort.long), close
        )
        wide = [widened(search, one) for one in ended] if best.size > 1 else []
        search.structures += [*ended, *(one for one in wide if one is not None)]


def _without_idle_shapes(search: Search, found: Fit) -> Fit:
    """The structure without those shapes that the kept blocks do not miss: there the law is the rig's."""
    problem = search.problem
    for bare in (one for one in search.laws if one.candidate.parts == found.candidate.laws):
        if _does(problem, bare, found):
            return bare
    for part in found.candidate.shapes:
        less = reduced(problem, found, (part,), iterations=search.effort.long)  # the law takes back what it shared
        found = less if _does(problem, less, found) else found
    return found


def _does(problem: Problem, less: Fit, more: Fit) -> bool:
    """Whether the smaller structure ``less`` predicts the kept blocks as well as ``more`` and has no higher price."""
    one, other = score(problem, less), score(problem, more)
    return one.level <= other.level * (1.0 + SAME) + IDLE and one.price < other.price + 1.0
