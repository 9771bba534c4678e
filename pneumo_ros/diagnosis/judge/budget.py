"""The budget of the gap: which share of the nominal held-out gap each effect makes, and what is left.

Shares are of the squared nominal gap; what sensors and the model's stated form leave is the floor's share. Nuisance
parameters and effects are the players of a game whose value is the gap that they close together; a player's share is
the mean over all orders in which they can be added (Shapley, "A value for n-person games", 1953), so that shares add up
whatever the effects do to each other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import factorial
from typing import Any

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Part, Problem, scale_of
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.diagnosis.judge.held_out import free_run
from pneumo_ros.effects.parameters import Active, family_of

BLOCK = 1.0  # s of the moving blocks of the interval
DRAWS = 200


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
    refit : of the parameters inside their tolerances
    remainder : what neither closes, above the floor; below zero where the structure predicts better than it
    floor : what sensors and the model's stated form leave
    """

    effects: dict[Part, Share]
    refit: float
    remainder: float
    floor: float


def budget(problem: Problem, best: Fit, holdout: Any, floor: float) -> Budget:
    """Shares of a fitted structure on the held-out record; ``floor`` as the contract's gap."""
    players: list[tuple[Part, ...]] = [()]  # the tolerances play first
    laws = best.candidate.laws
    players += [tuple(p for p in best.candidate.parts if _belongs(p, law, laws)) for law in laws]
    squares = _squares(problem, best, holdout, players)
    whole = max(float(np.mean(squares[frozenset()])), 1e-12)
    base = min(floor**2 / whole, 1.0)
    shares = _shapley(len(players), lambda s: -float(np.mean(squares[s])))
    intervals = _intervals(len(players), squares, holdout)
    effects = {
        law: Share(shares[k + 1] / whole, (intervals[k + 1][0], intervals[k + 1][1])) for k, law in enumerate(laws)
    }
    return Budget(effects, shares[0] / whole, 1.0 - sum(shares) / whole - base, base)


def _belongs(part: Part, law: Part, laws: Sequence[Part]) -> bool:
    """Whether a part is a law or the shape of its family where it acts."""
    return part == law or (part not in laws and family_of(part[0]) == family_of(law[0]) and part[1] == law[1])


def _squares(
    problem: Problem, best: Fit, holdout: Any, players: Sequence[tuple[Part, ...]]
) -> dict[frozenset[int], Array]:
    """Squared normalised error of each row (N,), for every subset of players that act."""
    model, there = problem.model, holdout.weight > 0.0
    values = dict(zip(best.candidate.parts, problem.active(best.candidate, problem.values(best.candidate, best.x)),
                      strict=True))  # fmt: skip
    nominal = np.array([p.nominal for p in model.parameters])
    scale, counts = scale_of(holdout), np.maximum(there.sum(axis=0), 1)
    out = {}
    for subset in _subsets(len(players)):
        nuisance = problem.nuisance(best.x) if 0 in subset else nominal
        active: list[Active] = [values[part] for k in sorted(subset - {0}) for part in players[k]]
        error = np.where(there, holdout.measured - free_run(model, holdout, nuisance, active), 0.0) / scale
        rows = np.sum(error**2 * (len(error) / counts), axis=1) / max(int(there.any(axis=0).sum()), 1)
        out[subset] = np.where(np.isfinite(rows), np.minimum(rows, 1e6), 1e6)
    return out


def _subsets(count: int) -> Iterator[frozenset[int]]:
    for size in range(count + 1):
        yield from map(frozenset, combinations(range(count), size))


def _shapley(count: int, value: Callable[[frozenset[int]], float]) -> list[float]:
    out = [0.0] * count
    for subset in _subsets(count):
        weight = factorial(len(subset)) * factorial(count - len(subset) - 1) / factorial(count) if (
            len(subset) < count) else 0.0  # fmt: skip
        for k in set(range(count)) - subset:
            out[k] += weight * (value(subset | {k}) - value(subset))
    return out


def _intervals(count: int, squares: dict[frozenset[int], Array], holdout: Any) -> list[list[float]]:
    """90 % intervals of the shares by moving blocks of time."""
    rows = len(next(iter(squares.values())))
    length = max(1, min(rows, round(BLOCK / holdout.period)))
    starts = np.random.default_rng(1).integers(0, rows - length + 1, size=(DRAWS, max(1, rows // length)))
    sums = {s: np.concatenate([[0.0], np.cumsum(v)]) for s, v in squares.items()}
    means = {s: ((c[starts + length] - c[starts]).sum(axis=1) / (starts.shape[1] * length)) for s, c in sums.items()}
    whole = np.maximum(means[frozenset()], 1e-12)
    out = []
    for k in range(count):
        share = np.zeros(DRAWS)
        for subset in _subsets(count):
            if k in subset:
                continue
            weight = factorial(len(subset)) * factorial(count - len(subset) - 1) / factorial(count)
            share += weight * (means[subset] - means[subset | {k}])
        out.append([float(q) for q in np.quantile(share / whole, [0.05, 0.95])])
    return out
