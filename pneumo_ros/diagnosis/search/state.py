# SPDX-License-Identifier: Apache-2.0
"""How much a search fits, and its state: what has been fitted so far, ending as its result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from pneumo_ros.diagnosis.fit.problem import Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.diagnosis.search.screening import CandidateScore
from pneumo_ros.diagnosis.search.selection import best_of_same, score

Progress = Callable[[float, str], None]  # share done 0..1, what is being done


@dataclass(frozen=True)
class Effort:
    """How much is fitted; more of each finds rarer combinations and costs time in proportion.

    Attributes
    ----------
    singles : singles that get a short fit
    finalists : singles fitted to convergence
    seconds : second effects tried on the first, second, ... leader
    blind_pairs : pairs taken from the screening at the refit
    pair_finalists : pairs fitted to convergence
    probes : second effects probed on each leader
    exchanged : rivals probed in place of each effect of the best pair
    short, anew, long : iterations of a short fit, of one from another shape, of a full one
    """

    singles: int = 10
    finalists: int = 5
    seconds: tuple[int, ...] = (4, 2)
    blind_pairs: int = 3
    pair_finalists: int = 3
    probes: int = 14
    exchanged: int = 6
    short: int = 6
    anew: int = 5
    long: int = 10


@dataclass
class Search:
    """The state of a competition; ends as its result.

    Attributes
    ----------
    logged : the problem with the command's jumps where the logs have them
    problem : the same as last timed
    refit : the nominal structure re-estimated
    singles, pairs : fits, best training cost first; the first ``finalists`` of each have converged
    structures : leading ones with the shapes of their families, and those that grew from them
    screened : screening of the singles at the refit, for the report
    lost : labels of candidates whose fit diverged
    visible : effect id -> rms in sigmas that its typical size would move the outputs by
    bare : the structure that was last asked for without one of its effects, and what it comes to then, by effect
    fresh : the structure that was last asked for with its sensitivities taken anew, and that
    exchange : the structure of which an effect was last exchanged, and the best that it comes to
    """

    logged: Problem
    problem: Problem
    refit: Fit
    effort: Effort
    progress: Progress
    singles: list[Fit] = field(default_factory=list)
    pairs: list[Fit] = field(default_factory=list)
    structures: list[Fit] = field(default_factory=list)
    screened: list[CandidateScore] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)
    visible: dict[str, float] = field(default_factory=dict)
    bare: tuple[Fit | None, dict[Part, Fit]] = field(default_factory=lambda: (None, {}))
    fresh: tuple[Fit | None, Fit | None] = (None, None)
    exchange: tuple[Fit | None, Fit | None] = (None, None)

    def start_from(self, found: Mapping[Part, tuple[float, ...]]) -> None:
        """Start whoever comes from now on from what the logs were scanned for, too."""
        found = {**self.problem.scanned, **found}
        if found != self.problem.scanned:
            self.problem, self.logged = replace(self.problem, scanned=found), replace(self.logged, scanned=found)

    @property
    def finalists(self) -> list[Fit]:
        """Every converged structure; of those with the same laws, with and without shapes, the best."""
        same: dict[tuple[Part, ...], list[Fit]] = {}
        for one in (*self.laws, *self.structures):
            same.setdefault(one.candidate.laws, []).append(one)
        return [fits[0] if len(fits) == 1 else self._best_of(fits) for fits in same.values()]

    def _best_of(self, fits: Sequence[Fit]) -> Fit:
        return best_of_same(score(self.problem, self.refit), [score(self.problem, one) for one in fits]).fit

    @property
    def laws(self) -> list[Fit]:
        """Converged singles and pairs by their laws alone."""
        return self.singles[: self.effort.finalists] + self.pairs[: self.effort.pair_finalists]

    @property
    def best(self) -> Fit:
        """Lowest training cost of all."""
        return min([self.refit, *self.finalists], key=lambda f: f.cost)
