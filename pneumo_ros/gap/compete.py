"""The competition: nominal re-estimated, single effects, pairs; each fitted with every nuisance parameter free.

Cheap screening first (:mod:`pneumo_ros.gap.screen`), short fits of what promises most, then the best to convergence, from
several starts. The second effect of a pair is looked for twice: among all pairs at the refit, and on top of each leading
single, where the first effect no longer hides it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pneumo_ros.gap.fit import Fit, fit
from pneumo_ros.gap.model import Array
from pneumo_ros.gap.problem import Candidate, Part, Problem
from pneumo_ros.gap.screen import Promise, all_parts, promises, start_values, trials

Progress = Callable[[float, str], None]  # share done 0..1, what is being done


@dataclass(frozen=True)
class Effort:
    """How much is fitted; more of each finds rarer combinations and costs time in proportion.

    Attributes
    ----------
    singles : singles that get a short fit
    finalists : singles fitted to convergence
    leaders : finalists on top of which a second effect is sought
    seconds : second effects tried on each leader
    blind_pairs : pairs taken from the screening at the refit
    pair_finalists : pairs fitted to convergence
    short, long : iterations of a short and of a full fit
    """

    singles: int = 14
    finalists: int = 6
    leaders: int = 3
    seconds: int = 4
    blind_pairs: int = 4
    pair_finalists: int = 4
    short: int = 3
    long: int = 8


@dataclass(frozen=True)
class Contest:
    """All fits that were made, the refit apart.

    Attributes
    ----------
    refit : the nominal structure re-estimated
    fits : singles and pairs, best training cost first; only the finalists have converged
    finalists : of those, the ones that did
    promised : screening of the singles, for the report
    """

    refit: Fit
    fits: tuple[Fit, ...]
    finalists: tuple[Fit, ...]
    promised: tuple[Promise, ...]


def compete(problem: Problem, effort: Effort, pairs: bool, progress: Progress, warm: Fit | None = None) -> Contest:
    """Run the competition.

    Parameters
    ----------
    pairs : look for pairs as well
    progress : called with the share done
    warm : a refit to start from
    """
    progress(0.0, "re-estimating the nominal model")
    nominal = Candidate()
    refit = _with_jacobian(problem, fit(problem, nominal, problem.start(nominal, None if warm is None else warm.x, ())))
    progress(0.05, "screening effects")
    found = trials(problem, refit, all_parts(problem))
    promised = promises(problem, refit, found)
    singles = _short_fits(problem, refit, _varied(promised, effort.singles), effort, progress, (0.1, 0.4))
    finalists = [_finish(problem, one, effort) for one in singles[: effort.finalists]]
    finalists.sort(key=lambda f: f.cost)
    fits = finalists + singles[effort.finalists :]
    if pairs and finalists:
        progress(0.6, "screening pairs")
        paired = _pair_fits(problem, refit, finalists, found, effort, progress)
        ended = [_finish(problem, one, effort) for one in paired[: effort.pair_finalists]]
        finalists, fits = finalists + ended, fits + ended + paired[effort.pair_finalists :]
    progress(0.9, "selecting")
    return Contest(refit, tuple(sorted(fits, key=lambda f: f.cost)), tuple(finalists), tuple(promised))


def _varied(promised: Sequence[Promise], count: int) -> list[Promise]:
    """The most promising, but not more than three sites of one effect, so that rivals of another kind get their chance."""
    taken: list[Promise] = []
    for promise in promised:
        same = sum(p.parts[0][0] == promise.parts[0][0] for p in taken)
        if same < 3:
            taken.append(promise)
    return taken[:count]


def _short_fits(
    problem: Problem, base: Fit, chosen: Sequence[Promise], effort: Effort, progress: Progress, span: tuple[float, float]
) -> list[Fit]:
    out = []
    for k, promise in enumerate(chosen):
        candidate = Candidate((*base.candidate.parts, *promise.parts))
        progress(span[0] + (span[1] - span[0]) * k / len(chosen), candidate.label)
        values = [*problem.values(base.candidate, base.x), *promise.values]
        start = problem.start(candidate, base.x[: problem.fixed], values)
        out.append(fit(problem, candidate, start, base.jacobian, iterations=effort.short))
    return sorted((f for f in out if not f.diverged), key=lambda f: f.cost)


def _pair_fits(
    problem: Problem, refit: Fit, singles: Sequence[Fit], found: Sequence, effort: Effort, progress: Progress
) -> list[Fit]:
    seen: set[frozenset[Part]] = set()
    out: list[Fit] = []

    def unseen(promised: Sequence[Promise], base: tuple[Part, ...], count: int) -> list[Promise]:
        fresh = [p for p in promised if frozenset((*base, *p.parts)) not in seen][:count]
        seen.update(frozenset((*base, *p.parts)) for p in fresh)
        return fresh

    leaders = singles[: effort.leaders]
    for k, leader in enumerate(leaders):
        leader = _with_jacobian(problem, leader)
        (first, site), *_ = leader.candidate.parts
        others = [p for p in all_parts(problem) if p[0] != first or (p[1] != site and "both" not in (site, p[1]))]
        promised = promises(problem, leader, trials(problem, leader, others))
        chosen = unseen(promised, leader.candidate.parts, effort.seconds)
        out += _short_fits(problem, leader, chosen, effort, progress, (0.65 + 0.05 * k, 0.7 + 0.05 * k))
    blind = unseen(promises(problem, refit, found, pairs=True), (), effort.blind_pairs)
    out += _short_fits(problem, refit, blind, effort, progress, (0.8, 0.85))
    return sorted(out, key=lambda f: f.cost)


def _finish(problem: Problem, short: Fit, effort: Effort) -> Fit:
    """To convergence, from where the short fit ended and from its effects' other starts; the best of them."""
    best = fit(problem, short.candidate, short.x, None, iterations=effort.long)
    shapes = [k for k, p in enumerate(problem.effect_parameters(short.candidate)) if not p.size]
    if not shapes or len(short.candidate.parts) > 1:
        return best
    parameters = problem.effect_parameters(short.candidate)
    for values in start_values(parameters)[2:]:
        kept = problem.values(best.candidate, best.x)
        mixed = [v if not p.size else k for v, k, p in zip(values, kept, parameters, strict=True)]
        start = problem.start(short.candidate, best.x[: problem.fixed], mixed)
        other = fit(problem, short.candidate, start, best.jacobian, iterations=effort.short)
        if other.cost < best.cost - 1.0:
            best = fit(problem, short.candidate, other.x, None, iterations=effort.long)
    return best


def _with_jacobian(problem: Problem, state: Fit) -> Fit:
    return state if state.jacobian is not None else fit(problem, state.candidate, state.x, iterations=1)


def initial_columns(problem: Problem) -> Array:
    """Indices of the initial-state unknowns."""
    return np.arange(len(problem.model.parameters), problem.fixed)
