# SPDX-License-Identifier: Apache-2.0
"""At what intervals does a part take its command, if it keeps what it took until the next?

The cost of a fit over such an interval has one narrow valley among hundreds: over a log of D seconds an interval T must
be known to about T^2/(4 D) before a gradient leads anywhere. So the whole range is scanned at that step, and at a few
phases. No simulation is needed for each: the command is pushed once for a moment at a time, and what an interval does
to the command, summed up over these moments, weighs what the pushes did to the outputs. Compared with the residual like
any candidate (:mod:`pneumo_ros.diagnosis.search.screening`), beside everything the tolerances answer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit, level
from pneumo_ros.diagnosis.model import Model
from pneumo_ros.diagnosis.record import Record
from pneumo_ros.diagnosis.search.screening import Trial, changes, projected
from pneumo_ros.effects.parameters import family_of

MOMENT: Final = 0.05  # s that a push lasts: of a rig that sums up flows more is not seen [numerics]
PHASES: Final = 8  # tried of each interval [numerics]
STEPS: Final = 4.0  # of the interval in T^2 over the log's length: an eighth of it at either end [numerics]
SHORTEST: Final = 8.0  # rows of the log: of a shorter interval nothing but its mean delay is seen [numerics]
SIMULATED: Final = 12  # intervals that are simulated, the best by the pushes: these are linear [numerics]
MOSTLY: Final = 0.5  # of the command that is taken so, from which on its instants are sharpened [taste]
NEAR: Final = (1.0, 0.25)  # steps about a fit's own interval that are tried, ever closer [numerics]
FINER: Final = 7  # intervals, and phases of each, within these [numerics]
TOGETHER: Final = 128 * PHASES  # weighed at a time: a log's thousands would not fit into memory [numerics]
MOST_PUSHES: Final = 2000  # one simulation each: longer logs are not scanned [numerics]
NEIGHBOURS: Final = 4  # steps of the interval that are one and the same [numerics]


@runtime_checkable
class HasIntervals(Protocol):
    """A model whose commands may be taken at intervals."""

    def columns(self, site: str) -> tuple[int, ...]:
        """Columns of the command that a part at a site takes."""

    def amount(self, record: Record, column: int) -> float:
        """By about how much a command moves, SI; 0 where it stands still."""

    def pushed(self, record: Record, column: int, first: int, last: int) -> Record:
        """The record with one command raised by that over rows ``first`` to ``last`` - 1."""

    def kept_off(self, record: Record, column: int, instants: Array, ends: NDArray[np.int64]) -> Array:
        """(K, P) by how much a command is off, in the mean over rows ``ends[p]`` to ``ends[p + 1]`` - 1, when it is
        taken every ``instants[k, 0]`` s and kept, from ``instants[k, 1]`` times that after the first row on."""


@runtime_checkable
class TakesAtIntervals(Protocol):
    """A shape that may take its command at intervals."""

    @property
    def taken(self) -> tuple[int, ...]:
        """Which of its parameters are the share that is taken so, the interval and the phase; empty where none is."""


@dataclass(frozen=True)
class _Pushes:
    """Every moment's push of one command in one log.

    Attributes
    ----------
    log, column : of the command
    ends : (P + 1,) rows where the moments begin, and where the last one ends
    amount : by which the command was raised
    done : what each did, as a trial's
    """

    log: int
    column: int
    ends: NDArray[np.int64]
    amount: float
    done: list[Array]


def intervals(problem: Problem, base: Fit) -> dict[Part, tuple[float, ...]]:
    """Start values, SI, of every shape that may take its command at intervals: those that explain most of what a fit
    leaves. Nothing of a shape that explains nothing.
    """
    model, shapes = problem.model, shapes_that_take(problem.model)
    if not isinstance(model, HasIntervals) or not shapes:
        return {}
    pushes = _pushes(problem, base, sorted({c for _, site, _ in shapes for c in model.columns(site)}))
    found = [Trial((), (), change) for one in pushes for change in one.done]
    if not found:
        return {}
    gram, with_residual, _ = projected(problem, base, found)
    column = np.repeat([one.column for one in pushes], [len(one.done) for one in pushes])

    own = [np.isin(column, model.columns(site)) for _, site, _ in shapes]

    def explained(some: Sequence[tuple[float, float]]) -> Array:
        """(shapes, some)"""
        weights = _weights(problem, pushes, np.array(some))
        each = [(weights[:, there], with_residual[there], gram[np.ix_(there, there)]) for there in own]
        return np.array([_explained(-w @ asked, np.einsum("ij,ij->i", w @ square, w)) for w, asked, square in each])

    tried = list(_tried(problem, max(problem.parameters_of[name, site][which[1]].high for name, site, which in shapes)))
    if not tried:
        return {}
    heights = np.hstack(problem.each(explained, [tried[k : k + TOGETHER] for k in range(0, len(tried), TOGETHER)]))
    out: dict[Part, tuple[float, ...]] = {}
    for (name, site, which), height in zip(shapes, heights, strict=True):
        best = simulated(problem, base, (name, site), which, [tried[k] for k in _peaks(height)])
        for width in NEAR if best else ():  # here tolerances still answer; a fit that began beside them is kept there
            near = list(_near(problem, best[0][which[1]], best[0][which[2]], width))
            best = simulated(problem, base, (name, site), which, near) or best
        if best:
            out[name, site] = best[0]
    return out


def shapes_that_take(model: Model) -> list[tuple[str, str, tuple[int, ...]]]:
    """Id, site and :attr:`TakesAtIntervals.taken` of every shape that may take its command at intervals."""
    return [(e.id, site, e.taken) for e in model.effects.values() if isinstance(e, TakesAtIntervals) and e.taken
            for site in e.sites]  # fmt: skip


def _explained(asked: Array, square: Array) -> Array:
    """What a part that does all it does in one way explains: a driver either keeps a command or does not, a spool
    either sticks or does not, so no multiple of it may fit the residual better.
    """
    return 2.0 * asked - square


def _peaks(explained: Array) -> list[int]:
    """The numbers of the best intervals, the best phase of each, neighbours of a better one left out."""
    of_interval = explained.reshape(-1, PHASES)
    height = of_interval.max(axis=1)
    out: list[int] = []
    for k in np.argsort(-height):
        if len(out) == SIMULATED or height[k] <= 0.0:
            break
        if all(abs(k - other // PHASES) > NEIGHBOURS for other in out):
            out.append(int(k) * PHASES + int(np.argmax(of_interval[k])))
    return out


def simulated(
    problem: Problem,
    base: Fit,
    shape: Part,
    which: Sequence[int],
    tried: Sequence[Sequence[float]],
    coarsely: bool = True,
) -> list[tuple[float, ...]]:
    """Values of a shape that does all it does in one way, by numbers of that way, each simulated; those that explain
    anything, the one first that explains most.

    Parameters
    ----------
    which : of its parameters, the share that is done so and its numbers, an interval and a phase for example
    tried : values of these numbers
    coarsely : at half the log's rate where the model knows how
    """
    share, *numbers = which
    starts = []
    for found in tried:
        values = [0.0 if p.size else p.typical for p in problem.parameters_of[shape]]
        values[share] = 1.0
        for place, value in zip(numbers, found, strict=True):
            values[place] = value
        starts.append(((shape,), tuple(values)))
    runs = [one for one in changes(problem, base, starts, coarsely) if one is not None]
    if not runs:
        return []
    gram, with_residual, _ = projected(problem, base, runs)
    explained = _explained(-with_residual, np.diag(gram))
    return [runs[k].values for k in np.argsort(-explained) if explained[k] > 0.0]


def taken_at(problem: Problem, found: Fit) -> list[tuple[Part, list[int]]]:
    """Shapes of a fit that take most of their command at intervals, with where interval and phase stand in its
    unknowns.
    """
    out, first = [], problem.fixed
    for part in found.candidate.parts:
        effect, own = problem.model.effects[part[0]], problem.parameters_of[part]
        if isinstance(effect, TakesAtIntervals) and effect.taken:
            share, *which = effect.taken
            if found.x[first + share] * own[share].typical > MOSTLY:
                out.append((part, [first + k for k in which]))
        first += len(own)
    return out


def interval_words(problem: Problem, found: Fit) -> list[str]:
    """What a fit says of each part that takes its command at intervals."""
    values = problem.values(found.candidate, found.x)
    return [f"{family_of(name).replace('_', ' ')}{f' ({site})' if site else ''}: the command is taken every "
            f"{1e3 * float(values[which[0] - problem.fixed]):.3g} ms and kept until the next time"
            for (name, site), which in taken_at(problem, found)]  # fmt: skip


def sharpened(problem: Problem, found: Fit, iterations: int) -> Fit:
    """A fit whose intervals and phases are those near its own that leave least, fitted on from there: a command that
    steps is taken before or after a step, and no gradient leads from the one to the other.
    """
    best = found
    for _, which in taken_at(problem, found):
        best = _sharpened(problem, best, which, iterations)
    return best


def _sharpened(problem: Problem, found: Fit, which: Sequence[int], iterations: int) -> Fit:
    parameters = problem.effect_parameters(found.candidate)
    scale = np.array([parameters[k - problem.fixed].typical for k in which])

    def left(x: Array) -> float:
        return level(problem.residual(found.candidate, x)[problem.fitted])

    x = found.x
    for width in NEAR:
        near, (interval, phase) = [x], (x[which] * scale).tolist()
        for values in _near(problem, interval, phase, width):
            near.append(x.copy())
            near[-1][which] = np.array(values) / scale
        x = near[int(np.argmin(np.nan_to_num(problem.each(left, near), nan=np.inf)))]
    again = fit(problem, found.candidate, x, None, iterations=iterations)
    return again if again.cost < found.cost else found


def _tried(problem: Problem, longest: float) -> Iterator[tuple[float, float]]:
    """Intervals, s, as close as the logs tell them apart, each with its phases."""
    length, interval = _length(problem), SHORTEST * max(r.period for r in problem.records)
    while interval < min(longest, length / 4.0):
        for number in range(PHASES):
            yield interval, number / PHASES
        interval += interval**2 / (STEPS * length)


def _near(problem: Problem, interval: float, phase: float, width: float) -> Iterator[tuple[float, float]]:
    """Intervals and phases up to ``width`` of the way to their neighbours."""
    step = interval**2 / (STEPS * _length(problem))
    for far in np.linspace(-width, width, FINER).tolist():
        for later in np.linspace(-width, width, FINER).tolist():
            yield interval + far * step, (phase + later / PHASES) % 1.0


def _length(problem: Problem) -> float:
    """Of the longest log, s."""
    return max(r.period * len(r.measured) for r in problem.records)


def _pushes(problem: Problem, base: Fit, columns: Sequence[int]) -> list[_Pushes]:
    """Every command that moves, pushed for every moment of every log."""
    model = problem.model
    assert isinstance(model, HasIntervals)
    here = problem.predict_coarse(base.candidate, base.x)
    moving = [(k, column) for k, r in enumerate(problem.records) for column in columns if model.amount(r, column) > 0.0]
    ends = [_moments(r) for r in problem.records]
    if sum(len(ends[k]) - 1 for k, _ in moving) > MOST_PUSHES:
        return []

    def pushed(what: tuple[int, int, int]) -> Array:
        k, column, first = what
        moved = model.pushed(problem.records[k], column, int(ends[k][first]), int(ends[k][first + 1]))
        rows, change = problem.rows_of[k], np.zeros_like(here)
        change[rows] = (here[rows] - problem.predict_log_coarse(k, moved, base.candidate, base.x)) * problem.weight[
            rows
        ]
        return change

    out = []
    for k, column in moving:
        done = problem.each(pushed, [(k, column, first) for first in range(len(ends[k]) - 1)])
        if np.all(np.isfinite(done)):
            out.append(_Pushes(k, column, ends[k], model.amount(problem.records[k], column), done))
    return out


def _moments(record: Record) -> NDArray[np.int64]:
    """Rows where a log's moments begin, and its end."""
    count = len(record.measured)
    return np.append(np.arange(0, count, max(1, round(MOMENT / record.period))), count)


def _weights(problem: Problem, pushes: Sequence[_Pushes], instants: Array) -> Array:
    """(K, P) how much of each push an interval with its phase makes: the mean over its moment."""
    model = problem.model
    assert isinstance(model, HasIntervals)
    records = problem.records
    return np.hstack([model.kept_off(records[p.log], p.column, instants, p.ends) / p.amount for p in pushes])
