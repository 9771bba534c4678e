# SPDX-License-Identifier: Apache-2.0
"""The competition: nominal re-estimated, single effects, pairs; each fitted with every nuisance parameter free.

Cheap screening first (:mod:`pneumo_ros.diagnosis.search.screening`), short fits of what scores best, then the best to
convergence, from several starts. The second effect of a pair is looked for twice: among all pairs at the refit, and on
top of each leading single, where the first effect no longer hides it. Whenever the best fit so far is good enough to
time the command's jumps by (:mod:`pneumo_ros.diagnosis.fit.command_events`), they are timed and the finalists fitted
again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest
from typing import Final

import numpy as np

from pneumo_ros.diagnosis.fit.command_events import timed
from pneumo_ros.diagnosis.fit.problem import SELECT_EVERY, Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.shooting import carried, free_run_failed, windowed
from pneumo_ros.diagnosis.fit.solver import Fit, fit, refreshed
from pneumo_ros.diagnosis.search.bands import with_bands
from pneumo_ros.diagnosis.search.fitting import (
    by_cost,
    finished,
    of_law,
    probed,
    rescued,
    restricted,
    short_fits,
    varied,
)
from pneumo_ros.diagnosis.search.intervals import intervals, sharpened
from pneumo_ros.diagnosis.search.parts import rival, shaped
from pneumo_ros.diagnosis.search.screening import (
    CandidateScore,
    all_parts,
    candidate_scores,
    compatible,
    scanned_laws,
    trials,
    visibility,
)
from pneumo_ros.diagnosis.search.selection import FORM, Thresholds, noise_level, score
from pneumo_ros.diagnosis.search.state import Effort, Progress, Search
from pneumo_ros.effects.parameters import family_of
from pneumo_ros.errors import InputError

# Shares of the nominal model's misfit outside which another fold is kept from the fit [taste]
LOPSIDED: Final = (0.1, 0.6)
# Share of the fall that a second effect must bring: if less could be gained, none is looked for [taste]
NOT_EVIDENT: Final = 0.9
# Mean square, sigma squared, that a single with its shape may leave for no pairs to be looked for [numerics]
SUFFICES: Final = 1.0
SUFFICES_OF_REFIT: Final = 0.05  # the same beside it, as a share (rms) of what the refit leaves [numerics]
SHAPED: Final = 3  # leading singles that are fitted with their shapes [numerics]
PROBED: Final = 45  # singles that are probed, of some seventy that move anything [numerics]
RIVALS: Final = 3  # other families at the leading single's place that are fitted with their shapes [numerics]
# Most iterations of the refit, against which everything else is measured: of some nulls it stood 20 above its minimum
# after ten, and any effect's fit then took what it had left (bench/null_distribution.py) [numerics]
PATIENT: Final = 40
STARTED_TWICE: Final = 3  # leading singles whose shape parameters are started from elsewhere as well [numerics]


def compete(problem: Problem, effort: Effort, pairs: bool, progress: Progress) -> Search:
    """Run the competition; ``progress`` is called with the share done."""
    progress(0.0, "re-estimating the nominal model")
    nominal = Candidate()
    refit = rescued(problem, fit(problem, nominal, problem.start(nominal, None, ()), iterations=PATIENT), PATIENT)
    if refit.diverged:
        raise InputError("the nominal model runs away on these logs, whatever its tolerances",
                         where=", ".join(r.name for r in problem.records),
                         remedy="check rig values, units and signs of command and road")  # fmt: skip
    problem, refit = _choose_fold(problem, refit)
    search = Search(problem, problem, refit, effort, progress)
    _time_jumps(search)
    _run_singles(search)
    _time_jumps(search)
    search.progress(0.55, "shapes")
    leading = shaped(search.problem, search.singles[:SHAPED])
    search.structures = [*leading, *_rivals_of_first(search)]
    if _much_missing(search):
        _scan_intervals(search)
        if pairs and _much_missing(search):
            run_pairs(search)
            _time_jumps(search)
    return search


def _much_missing(search: Search) -> bool:
    """Whether the best single leaves so much that more is worth looking for."""
    return bool(search.singles) and room_for_more(search) and not _one_suffices(search)


def _scan_intervals(search: Search) -> None:
    """Parts that may take their command at intervals of their own, as these logs show them: a start for whoever fits
    them from here on, and single effects.
    """
    search.progress(0.58, "scanning intervals")
    base = refreshed(search.problem, search.refit)
    found = intervals(search.problem, base)
    if not found:
        return
    search.start_from(found)
    own = scanned_laws(search.problem, all_parts(search.problem), found)
    short = short_fits(search, base, own, (0.58, 0.6))
    ended = search.problem.each(lambda one: finished(search.problem, one, search.effort), short)
    search.structures += [sharpened(search.problem, one, search.effort.long) for one in ended]


def _choose_fold(problem: Problem, refit: Fit) -> tuple[Problem, Fit]:
    """The problem with those blocks kept from the fit that hold about their share of what the nominal model leaves.

    A stop that is hit once, or a wheel that leaves the ground once, may lie in the kept blocks alone, where nothing can
    be fitted to it.
    """
    squares = np.where(problem.weight > 0.0, refit.residual**2, 0.0).sum(axis=1)
    whole = max(float(squares.sum()), 1e-12)
    shares = [squares[problem.block % SELECT_EVERY == fold].sum() / whole for fold in range(SELECT_EVERY)]
    if LOPSIDED[0] <= shares[problem.fold] <= LOPSIDED[1]:
        return problem, refit
    fold = int(np.argmin(np.abs(np.array(shares) - 1.0 / SELECT_EVERY)))
    if fold == problem.fold:
        return problem, refit
    problem = replace(problem, fold=fold)
    return problem, fit(problem, refit.candidate, refit.x, refit.jacobian, iterations=PATIENT)


def room_for_more(search: Search) -> bool:
    """Whether a second effect could still be shown to act.

    It could not where the best structure so far leaves so little on the selection blocks above the sensors' noise that
    a second effect which took all of it would still stay below its threshold (:class:`Thresholds`)."""
    problem = search.problem
    least = min(score(problem, one).level for one in (search.refit, *search.finalists))
    return float(np.log((FORM + least) / (FORM + noise_level(problem)))) > NOT_EVIDENT * Thresholds().second


def _one_suffices(search: Search) -> bool:
    """Whether the best single, with its family's shape beside it, leaves so little that no pairs are searched.

    A second effect is then looked for beside that single only."""
    problem = search.problem
    enough = SUFFICES + SUFFICES_OF_REFIT**2 * score(problem, search.refit).level
    return min((score(problem, one).level for one in search.finalists), default=np.inf) < enough


def _rivals_of_first(search: Search) -> list[Fit]:
    """Other families at the place of the leading single with their shapes, those that the screening thinks most of.

    What a family leaves by the library's law says little of what it leaves by another.
    """
    problem, found = search.problem, search.singles
    if not found:
        return []
    leader = found[0].candidate.laws[0]
    taken = {family_of(law[0]) for one in found[:SHAPED] for law in one.candidate.laws if law[1] == leader[1]}
    rivals: dict[str, CandidateScore] = {}
    for entry in search.screened:
        law = entry.parts[0]
        if family_of(law[0]) not in taken and rival(problem, leader, law):
            rivals.setdefault(family_of(law[0]), entry)
    short = short_fits(search, search.refit, list(rivals.values())[:RIVALS], (0.56, 0.58))
    return shaped(problem, short, search.effort.long)


def _time_jumps(search: Search) -> None:
    """Time the command's jumps by the best fit so far; when that helps, fit all finalists again."""
    moved = timed(search.logged, search.problem, search.best)
    if moved is search.problem:
        return
    search.problem = moved

    def again(found: Sequence[Fit], iterations: int) -> list[Fit]:
        return moved.each(lambda f: fit(moved, f.candidate, f.x, f.jacobian, iterations=iterations), found)

    laws = again(search.laws, search.effort.long)
    search.refit = fit(moved, Candidate(), search.refit.x, search.refit.jacobian, iterations=PATIENT)
    singles, pairs = search.effort.finalists, search.effort.pair_finalists
    done = len(search.singles[:singles])
    search.singles = by_cost(laws[:done]) + search.singles[singles:]
    search.pairs = by_cost(laws[done:]) + search.pairs[pairs:]
    search.structures = again(search.structures, search.effort.short)


def _run_singles(search: Search) -> None:
    effort, problem = search.effort, search.problem
    search.progress(0.05, "screening effects")
    search.refit = refreshed(problem, search.refit)
    search.start_from(with_bands(problem, search.refit).scanned)
    problem = search.problem
    found = trials(problem, search.refit, all_parts(problem))
    search.screened = candidate_scores(problem, search.refit, found)
    search.visible = visibility(problem, search.refit, found)
    likely = probed(problem, search.refit, search.screened[:PROBED])
    if free_run_failed(problem, search.refit):
        likely = _merged(_near_the_log(search), likely)
    chosen = varied(likely, effort.singles, 3)
    short = short_fits(search, search.refit, chosen, (0.1, 0.4))
    anew = [search.refit if k < STARTED_TWICE else None for k in range(effort.finalists)]
    leading = list(zip(short, anew, strict=False))
    ended = problem.each(lambda one: finished(problem, one[0], effort, one[1]), leading)
    search.singles = by_cost(ended) + short[effort.finalists :]


def _near_the_log(search: Search) -> list[CandidateScore]:
    """Singles ranked by fits to short windows of the log, the best first; none where these cannot be fitted.

    Used where the nominal structure's free run has left the log altogether: from there all candidates score alike.
    """
    problem, short = search.problem, windowed(search.problem)
    if short is None:
        return []
    base = fit(short, Candidate(), carried(problem, short, search.refit.x), iterations=search.effort.short)
    if base.diverged:
        return []
    base = refreshed(short, base)
    screened = candidate_scores(short, base, trials(short, base, all_parts(short)))
    return probed(short, base, screened[:PROBED])


def _merged(one: Sequence[CandidateScore], other: Sequence[CandidateScore]) -> list[CandidateScore]:
    """Two rankings in turn; the same candidate from other values is another start."""
    return [entry for both in zip_longest(one, other) for entry in both if entry is not None]


def run_pairs(search: Search) -> None:
    """Fit the likeliest pairs to the end: a second effect beside each leading single, and both at once."""
    effort, problem = search.effort, search.problem
    search.progress(0.6, "screening pairs")
    seen: set[frozenset[Part]] = set()

    def unseen(screened: Sequence[CandidateScore], base: tuple[Part, ...], count: int) -> list[CandidateScore]:
        fresh = varied([p for p in screened if frozenset((*base, *p.parts)) not in seen], count, 2)
        seen.update(frozenset((*base, *p.parts)) for p in fresh)
        return fresh

    short: list[Fit] = []
    for k, (single, count) in enumerate(zip(search.singles, effort.seconds, strict=False)):
        leader = refreshed(problem, single)
        own = leader.candidate.parts
        others = [p for p in all_parts(problem) if compatible(problem.model, own[0], p)]
        screened = candidate_scores(problem, leader, trials(problem, leader, others))
        screened = probed(problem, leader, varied(screened, effort.probes, 3))
        span = (0.65 + 0.05 * k, 0.7 + 0.05 * k)
        short += short_fits(search, leader, unseen(screened, own, count), span)
    found = trials(problem, search.refit, all_parts(problem))
    blind = unseen(candidate_scores(problem, search.refit, found, pairs=True), (), effort.blind_pairs)
    short = by_cost(short + short_fits(search, search.refit, blind, (0.8, 0.85)))
    ended = problem.each(lambda one: finished(problem, one, effort), short[: effort.pair_finalists])
    search.pairs = by_cost(ended) + short[effort.pair_finalists :]
    _exchange_each(search)
    _try_without_each(search)


def _exchange_each(search: Search) -> None:
    """For each effect of the best pair, the likeliest other one of the same place: a lag has a delay as its rival, and
    neither may win because the other was never tried beside the same second effect.
    """
    problem, effort = search.problem, search.effort
    if not search.pairs:
        return
    pair = search.pairs[0]
    for law in pair.candidate.laws:
        bare = Candidate(tuple(part for part in pair.candidate.parts if part not in of_law(pair.candidate, law)))
        alone = refreshed(problem, fit(problem, bare, restricted(problem, pair, bare), pair.jacobian, iterations=1))
        if alone.diverged:  # without the other effect
            continue
        (kept,) = bare.laws
        rivals = [p for p in all_parts(problem) if rival(problem, law, p) and compatible(problem.model, kept, p)]
        tried = {frozenset(f.candidate.parts) for f in search.pairs[: effort.pair_finalists]}
        screened = candidate_scores(problem, alone, trials(problem, alone, rivals))
        fresh = [p for p in screened if frozenset((*bare.parts, *p.parts)) not in tried][: effort.exchanged]
        for short in short_fits(search, alone, probed(problem, alone, fresh)[:1], (0.86, 0.88)):
            search.pairs = by_cost([*search.pairs[: effort.pair_finalists], finished(problem, short, effort)])


def _try_without_each(search: Search) -> None:
    """Each effect of the best pair alone, from the pair's values: a start that no screening of singles has seen."""
    problem, pair = search.problem, search.pairs[0] if search.pairs else None
    if pair is None:
        return
    for law in pair.candidate.laws:
        candidate = Candidate(of_law(pair.candidate, law))
        start = restricted(problem, pair, candidate)
        start[: problem.fixed] = search.refit.x[: problem.fixed]
        alone = fit(problem, candidate, start, search.refit.jacobian, iterations=search.effort.long)
        before = min((f.cost for f in search.finalists if f.candidate == candidate), default=np.inf)
        if alone.cost < before - 1.0:
            rest = [f for f in search.singles if f.candidate != candidate]
            search.singles = by_cost([alone, *rest[: search.effort.finalists]]) + rest[search.effort.finalists :]
