# SPDX-License-Identifier: Apache-2.0
"""The budget of the gap: which share of the nominal held-out gap each effect makes, and what is left.

Shares are of the squared nominal gap. The tolerances answer first: what they close alone is the refit's share, and they
answer anew, by a bounded linear step on the fitted logs, whichever effects are in the model. Of what the refit leaves,
an effect's share is the mean over all orders in which the effects can be added (Shapley, "A value for n-person games",
1953), so that shares add up whatever the effects do to each other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import factorial
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.box import bounded_newton
from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem, scale_of
from pneumo_ros.diagnosis.fit.record_pace import pace_of
from pneumo_ros.diagnosis.fit.solver import COST_FLOOR, Fit
from pneumo_ros.diagnosis.judge.held_out import free_run
from pneumo_ros.diagnosis.record import Record
from pneumo_ros.diagnosis.search.fitting import restricted
from pneumo_ros.effects.parameters import Active, family_of

DRAWS: Final = 200  # bootstrap draws of an interval [numerics]
WILD: Final = 1e6  # squared error of a run that diverged [numerics]


@dataclass(frozen=True)
class Share:
    """A player's share of the nominal gap with its 90 % interval."""

    value: float
    ci90: tuple[float, float]


@dataclass(frozen=True)
class Budget:
    """Shares that add up to one.

    Attributes
    ----------
    effects : law -> its share
    refit : what the parameters close alone, inside their tolerances
    remainder : what neither closes, above the floor
    floor : what sensors and the model's stated form leave, no more than is left
    """

    effects: dict[Part, Share]
    refit: float
    remainder: float
    floor: float


def budget(problem: Problem, best: Fit, holdout: Record, floor: float, nominal: float, refit: float) -> Budget:
    """Shares of a fitted structure on the held-out record.

    Parameters
    ----------
    best : with its sensitivities, on all blocks
    floor, nominal, refit : held-out gaps (as the contract's) of sensors and form, of the nominal and of the refitted
        structure
    """
    laws = best.candidate.laws
    players = [tuple(p for p in best.candidate.parts if _belongs(p, law, laws)) for law in laws]
    squares = _squares(problem, best, holdout, players, max(nominal, refit) ** 2)
    whole, last = max(nominal**2, 1e-12), float(np.mean(squares[frozenset(range(len(players)))]))
    fallen = float(np.mean(squares[frozenset()])) - last
    # The linear step of the tolerances is not quite the refit: its gap is the one that counts.
    scale = (refit**2 - last) / fallen / whole if laws and fallen > 0.0 else 0.0
    shares = _shapley(len(players), squares)
    draws = [np.quantile(one, [0.05, 0.95]) * scale for one in _drawn(len(players), squares, holdout)]
    effects = {
        law: Share(float(np.mean(share)) * scale, (float(low), float(high)))
        for law, share, (low, high) in zip(laws, shares, draws, strict=True)
    }
    tolerances = 1.0 - refit**2 / whole
    left = 1.0 - tolerances - sum(s.value for s in effects.values())
    base = min(floor**2 / whole, max(left, 0.0))  # sensors and form make no more of the gap than is there
    return Budget(effects, tolerances, left - base, base)


def _belongs(part: Part, law: Part, laws: Sequence[Part]) -> bool:
    """Whether a part is a law or the shape of its family where it acts."""
    return part == law or (part not in laws and family_of(part[0]) == family_of(law[0]) and part[1] == law[1])


def _squares(
    problem: Problem, best: Fit, holdout: Record, players: Sequence[tuple[Part, ...]], most: float
) -> dict[frozenset[int], Array]:
    """Squared normalised error of each held-out row (N,), for every subset of effects, the tolerances answering.

    A subset explains nothing at worst: its mean is ``most`` at most. What is half of a structure may run away where the
    whole and the nothing do not, and two shares of a thousand with either sign tell nobody anything.
    """
    model, there = problem.model, holdout.weight > 0.0
    acting = problem.active(best.candidate, problem.values(best.candidate, best.x))
    values = dict(zip(best.candidate.parts, acting, strict=True))
    scale, counts = scale_of(holdout), np.maximum(there.sum(axis=0), 1)
    answer = _Answer(problem, best)
    out = {}
    for subset in _subsets(len(players)):
        kept = tuple(part for k in sorted(subset) for part in players[k])
        moved = answer.nuisance(kept) if len(subset) < len(players) else problem.nuisance(best.x)
        active: list[Active] = [values[part] for part in kept]
        error = np.where(there, holdout.measured - free_run(model, holdout, moved, active), 0.0) / scale
        rows = np.sum(error**2 * (len(error) / counts), axis=1) / max(int(there.any(axis=0).sum()), 1)
        rows = np.where(np.isfinite(rows), np.minimum(rows, WILD), WILD)
        out[subset] = rows * min(1.0, most / max(float(np.mean(rows)), 1e-12))
    return out


class _Answer:
    """What the tolerances answer on the fitted logs when some effects are taken out of a structure."""

    def __init__(self, problem: Problem, best: Fit) -> None:
        assert best.jacobian is not None
        self.problem, self.best = problem, best
        self.columns = best.jacobian.reshape(best.residual.size, best.jacobian.shape[-1])[:, : problem.fixed]
        self.gram = self.columns.T @ self.columns

    def nuisance(self, kept: tuple[Part, ...]) -> Array:
        """(P,) parameter values after one bounded Gauss-Newton step."""
        problem, best = self.problem, self.best
        candidate = Candidate(kept)
        residual = problem.residual(candidate, restricted(problem, best, candidate)).ravel()
        if not np.all(np.isfinite(residual)):
            return problem.nuisance(best.x)
        with np.errstate(over="ignore"):  # of a run that leaves the log by so much the square has no end
            strength = 1.0 / (problem.pace.correlation * (COST_FLOOR + float(np.mean(residual**2))))
        x, low, high = best.x[: problem.fixed], *(b[: problem.fixed] for b in problem.bounds(Candidate()))
        step = bounded_newton(strength * self.gram + np.eye(problem.fixed), strength * self.columns.T @ residual + x,
                              low - x, high - x)  # fmt: skip
        return problem.nuisance(np.concatenate([x + step, best.x[problem.fixed :]]))


def _subsets(count: int) -> Iterator[frozenset[int]]:
    for size in range(count + 1):
        yield from map(frozenset, combinations(range(count), size))


def _shapley(count: int, squares: dict[frozenset[int], Array]) -> list[Array]:
    """For each player (N,) what it takes of the squares, averaged over the orders of joining."""
    out = [np.zeros_like(next(iter(squares.values()))) for _ in range(count)]
    for subset in _subsets(count):
        for k in set(range(count)) - subset:
            weight = factorial(len(subset)) * factorial(count - len(subset) - 1) / factorial(count)
            out[k] = out[k] + weight * (squares[subset] - squares[subset | {k}])
    return out


def _drawn(count: int, squares: dict[frozenset[int], Array], holdout: Record) -> list[Array]:
    """Means of the players' shares over moving blocks of time drawn with replacement, (DRAWS,) each."""
    shares = _shapley(count, squares)
    if not shares:
        return []
    rows = len(shares[0])
    length = max(1, min(rows, round(pace_of(holdout).wander / holdout.period)))
    starts = np.random.default_rng(1).integers(0, rows - length + 1, size=(DRAWS, max(1, rows // length)))
    sums = [np.concatenate([[0.0], np.cumsum(share)]) for share in shares]
    return [(c[starts + length] - c[starts]).sum(axis=1) / (starts.shape[1] * length) for c in sums]
