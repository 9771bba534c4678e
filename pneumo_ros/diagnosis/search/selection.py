# SPDX-License-Identifier: Apache-2.0
"""Which structure the logs prefer: of each number of effects the likeliest, and the most effects that are evident.

Among structures of the same families the one of lowest price; among those of others, with as many effects, the one of
largest weight (:func:`log_weight`): what is left on the fitted and on the kept blocks counts only beyond what laws of
the right kind leave, and each unknown has its price.
A richer structure must beat a poorer one on the kept blocks by more than structures without a true effect do (null
thresholds, made by bench/null_distribution.py), and by more than the laws of the library are true to; or let the
tolerances come back from where they answer for what is missing (:func:`relieved`).
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.needed import needed_unknowns
from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.fit.solver import Fit, level
from pneumo_ros.effects.parameters import family_of
from pneumo_ros.paths import share_file

# Mean square, sigma squared, that is added to both levels compared: what model form leaves is no evidence [taste]
FORM: Final = 0.5
PARAMETER_PENALTY: Final = 4.0  # cost of each parameter, and of each effect that is claimed at both ends [taste]
EVEN: Final = 1.0  # difference of prices that tells nothing: a fit may end that far from its minimum [taste]
SAME: Final = 0.05  # relative difference of levels that counts as none, whatever the blocks say [taste]
# Mean square, sigma squared, that laws of the right kind leave beside noise and their own share of the misfit: where
# two families leave less, what is left does not tell them apart [calibration: set 0.4, opened]
ALIKE: Final = 0.6
LAW_SHARE: Final = 0.01  # of the refit's root mean square: what right laws leave [calibration: set 0.4, opened]
# Of what the refit leaves, mean square: the most that a right law leaves, where all of it is little [taste]
QUARTER: Final = 0.25
# Log weight for a fall of one of the log mean square: as many samples' worth of evidence, however long the log, because
# laws differ by more than chance does [calibration: development cases of 0.3]
SHARPNESS: Final = 36.0
# Of what nulls win: the highest that 160 rigs tell within 20 % (test_null_table.py) [definition]
NULL_QUANTILE: Final = 0.95
THIRD: Final = 3  # effects from which on the fitted samples count as the kept ones do [taste]
# Log weight that each unknown used costs: what could fit anything proves less [calibration: set 0.4, opened]
PER_UNKNOWN: Final = 1.0
FAR: Final = 3.0  # log weight by which a fit of the same laws must be likelier than the one of lowest price [taste]


@dataclass(frozen=True)
class Thresholds:
    """What counts as evidence: floors for model form; :func:`null_thresholds` raises them where chance wins more.

    Attributes
    ----------
    first, second : fall of log mean square that the first (second) effect must bring on the selection blocks
    first_cost, second_cost : fall of the training cost that it must bring in any case
    first_share, second_share : the same for each effective sample, a fall of the log mean square of the fitted data
    alone : so many times the fall of the training cost is evidence for a first effect that the selection blocks neither
        show nor deny
    least : fall of mean square (in sigmas, which hold the model-form floor) below which nothing is evidence
    model_form : share of the misfit's root mean square that laws of the right kind may leave; no second effect is
        inferred from less
    relief : fall of the squares of strained tolerances, prior sigmas, that is evidence for a further effect which
        leaves no more than there was
    """

    first: float = 0.1
    second: float = 0.3
    first_cost: float = 15.0
    second_cost: float = 20.0
    first_share: float = 0.2
    second_share: float = 0.25
    alone: float = 2.5
    least: float = 0.06
    model_form: float = 0.01
    relief: float = 9.0


@lru_cache(maxsize=1)
def null_thresholds() -> Thresholds:
    """The floors of :class:`Thresholds`, raised to the :data:`NULL_QUANTILE` of what nulls win by."""
    floor = Thresholds()

    def chance(column: str, added: int) -> float:
        return float(np.quantile(null_wins(column, added), NULL_QUANTILE))

    return replace(
        floor,
        first=max(floor.first, chance("advantage", 1)),
        second=max(floor.second, chance("advantage", 2)),
        first_cost=max(floor.first_cost, chance("cost", 1)),
        second_cost=max(floor.second_cost, chance("cost", 2)),
        least=max(floor.least, chance("fall", 1)),
        relief=max(floor.relief, chance("relief", 2)),
    )


def null_wins(column: str, added: int) -> Array:
    """What the best effect won that was not there, on simulated rigs inside their tolerances, one value a rig.

    Parameters
    ----------
    column : "advantage" (fall of the log mean square on the kept blocks), "fall" (of the mean square, sigma squared),
        "cost" (of the training cost) or "relief" (of the squares of stretched tolerances)
    added : 1: over the refit where nothing is missing; 2: on top of a true effect

    Source: config/tables/diagnosis_null.csv, made by bench/null_distribution.py.
    """
    with share_file("config", "tables", "diagnosis_null.csv").open(newline="", encoding="utf-8") as handle:
        return np.array([float(row[column]) for row in csv.DictReader(handle) if int(row["added"]) == added])


@dataclass(frozen=True)
class Scored:
    """A fit with its score on the selection blocks.

    Attributes
    ----------
    fit : the candidate
    level : mean square on the selection blocks, sigma squared, the geometric mean of the channels
    blocks : (B,) the same of each block
    stretch : sum of squares of the nuisance parameters, in prior sigmas
    samples : effective number of fitted samples, what the training cost grows with
    fitted : robust mean square of the fitted samples, in the same way
    strain : what the prior of initial state and effects adds to the training cost
    unknowns : of effects that the fit needs (:func:`pneumo_ros.diagnosis.fit.needed.needed_unknowns`)
    """

    fit: Fit
    level: float
    blocks: Array
    stretch: float
    samples: float = 600.0
    fitted: float = 1.0
    strain: float = 0.0
    unknowns: float = 0.0

    @property
    def size(self) -> int:
        """Number of effects."""
        return len(self.fit.candidate.laws)

    @property
    def price(self) -> float:
        """Training cost with :data:`PARAMETER_PENALTY` for each parameter used and each effect claimed at both ends: an
        effect at one end is preferred where the other end's was not seen, because on another road it would act.
        """
        return self.fit.cost + PARAMETER_PENALTY * self.claims

    @property
    def claims(self) -> float:
        """Unknowns of effects that are used, and effects claimed at both ends."""
        return self.unknowns + sum(site == "both" for _, site in self.fit.candidate.laws)


def score(problem: Problem, fit: Fit) -> Scored:
    """What is left on the selection blocks; samples that are missing do not count."""
    there = problem.weight > 0.0
    with np.errstate(over="ignore"):  # of a run that leaves the log by so much the square has no end
        squares = np.where(there, fit.residual**2, 0.0)
    blocks = []
    for number in np.unique(problem.block[~problem.fitted]):
        rows = problem.block == number
        blocks.append(squares[rows].sum(axis=0) / np.maximum(1, there[rows].sum(axis=0)))
    left = np.array(blocks) if blocks else np.mean(squares, axis=0)[None]
    count = len(problem.model.parameters)
    stretch = float(np.sum(fit.x[:count] ** 2))
    fitted = level(fit.residual[problem.fitted])
    strain = float((problem.prior(fit.candidate) * fit.x)[count:] @ fit.x[count:])
    unknowns = needed_unknowns(problem, fit, PARAMETER_PENALTY)
    return Scored(
        fit, float(_joined(left.mean(axis=0))), _joined(left), stretch, problem.samples, fitted, strain, unknowns
    )


def _joined(squares: Array) -> Array:
    """Geometric mean of the channels' mean squares (..., C), form added: as the cost counts them."""
    return np.asarray(np.exp(np.mean(np.log(FORM + squares), axis=-1)) - FORM)


def noise_level(problem: Problem) -> float:
    """Mean square, sigma squared, that sensor noise and a stated model form leave on average.

    Less than one: the sigmas of a fit also hold a floor for model form."""
    there = problem.weight > 0.0
    return float(np.sum((problem.weight * problem.expected) ** 2) / max(1, there.sum()))


def alike(whole: float) -> float:
    """Mean square, sigma squared, that a law of the right kind may leave beside noise of what the refit leaves."""
    return min(ALIKE, QUARTER * whole) + LAW_SHARE**2 * whole


def log_weight(one: Scored, refit: Scored) -> float:
    """Of a structure among others with as many effects: what it leaves of fitted and kept samples, half and half, what
    it claims for that, and how unlikely the tolerances are that it needs.

    What laws of the right kind leave (:func:`alike`) is added to both levels: two families that both leave less are
    told apart by what they need for it alone. The tolerances count in full, as the normal distributions that the maker
    states, for no error of a law moves the rig's own numbers.
    """
    pairs = ((refit.fitted, one.fitted), (refit.level, one.level))
    left = [float(np.log(alike(whole) + level)) for whole, level in pairs]
    return -SHARPNESS * (0.5 * sum(left) + one.strain / one.samples) - 0.5 * one.stretch - PER_UNKNOWN * one.claims


def by_families(structures: Sequence[Scored]) -> dict[frozenset[str], list[Scored]]:
    """Structures of the same families, wherever these act, the one of lowest price first; of those whose prices are
    :data:`EVEN` the one that leaves least of the kept blocks.

    Laws of one family differ by what chance does: there the training cost counts in full, and what is left at a site
    that was not claimed is no matter of form.
    """
    groups: dict[frozenset[str], list[Scored]] = {}
    for one in sorted(structures, key=lambda s: s.price):
        groups.setdefault(frozenset(family_of(effect) for effect, _ in one.fit.candidate.laws), []).append(one)
    for group in groups.values():
        first = min((one for one in group if one.price < group[0].price + EVEN), key=lambda one: one.level)
        group.sort(key=lambda one: one is not first)  # the others stay in their order
    return groups


def best_of_same(refit: Scored, fits: Sequence[Scored]) -> Scored:
    """Of fits with the same laws, with and without shapes, the one of lowest price, and a law alone before one with its
    shape that does as well; another one only where it is likelier by :data:`FAR`: a fit may end where it serves nothing
    but the samples that it was fitted to.
    """
    ordered = sorted(fits, key=lambda one: one.price + len(one.fit.candidate.shapes))
    other = max(ordered, key=lambda one: log_weight(one, refit))
    return other if log_weight(other, refit) > log_weight(ordered[0], refit) + FAR else ordered[0]


def likeliest(refit: Scored, rivals: Sequence[Scored]) -> Scored:
    """The structure of largest :func:`log_weight` among those of one number of effects, the best of each family set."""
    leaders = [group[0] for group in by_families(rivals).values()]
    return max(leaders, key=lambda one: log_weight(one, refit))


def advantage(poorer: Scored, richer: Scored) -> float:
    """Fall of log mean square from the poorer to the richer structure."""
    return float(np.log((FORM + poorer.level) / (FORM + richer.level)))


def gained(poorer: Scored, richer: Scored) -> float:
    """Fall of log mean square that a further effect brings, against a threshold for :func:`advantage`.

    For a second effect that of the kept blocks alone: the misfit of a first one's law is all that it might serve. For
    those after it also the mean of fitted and kept samples, as in :func:`log_weight`, at most twice that of the kept
    ones: where several laws leave their misfits, some blocks hardly show one effect more.
    """
    kept = advantage(poorer, richer)
    if richer.size < THIRD:
        return kept
    fitted = float(np.log((FORM + poorer.fitted) / (FORM + richer.fitted)))
    return max(kept, min(0.5 * (kept + fitted), 2.0 * kept))


def relieved(poorer: Scored, richer: Scored, limits: Thresholds) -> bool:
    """Whether a further effect lets strained tolerances come back by so much that it is there, whatever is left.

    What changes the rig's own numbers, a load, tolerances may answer for wholly: then nothing is left to show it, but
    they are farther from what the maker states than chance takes them. What it costs otherwise counts against it. Of
    several effects more each must bring as much, or one that brings nothing would come along.
    """
    wanted = limits.relief * max(1, richer.size - poorer.size)
    relief = poorer.stretch - richer.stretch
    paid = poorer.price - richer.price
    return min(relief, paid + PARAMETER_PENALTY) > wanted and richer.level < (1.0 + SAME) * poorer.level


def standard_error(one: Scored, other: Scored) -> float:
    """Of the difference of their levels over the blocks."""
    difference = one.blocks - other.blocks
    if len(difference) < 2:
        return 0.0
    return float(np.std(difference, ddof=1) / np.sqrt(len(difference)))


def select(refit: Scored, finalists: Sequence[Scored], limits: Thresholds) -> Scored:
    """The chosen structure; the refit itself when nothing beats it by enough."""
    chosen = refit
    first = (limits.first, max(limits.first_cost, limits.first_share * refit.samples))
    further = (limits.second, max(limits.second_cost, limits.second_share * refit.samples))
    for size in range(1, 1 + max((f.size for f in finalists), default=0)):
        gain, cost = first if size == 1 else further
        rivals = [f for f in finalists if f.size == size]
        if not rivals:
            continue
        best = likeliest(refit, rivals)
        poorer = chosen
        fallen = poorer.level - best.level
        paid = poorer.fit.cost - best.fit.cost
        shown = gained(poorer, best) > gain and fallen > limits.least and paid > cost
        if size == 1:
            # A stop that is hit once lies in one block: where the kept blocks say nothing, the fit must say it by far.
            evidence = shown or (paid > limits.alone * cost and fallen > -SAME * poorer.level)
        else:
            evidence = shown and fallen > limits.model_form**2 * refit.level
            evidence = evidence or relieved(poorer, best, limits)
        if evidence:
            chosen = best
    return chosen
