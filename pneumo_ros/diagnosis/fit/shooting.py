# SPDX-License-Identifier: Apache-2.0
"""Multiple shooting: a start for the fit where the free run fails.

A free run that diverges, or ends up further from the log than the log's own mean, tells a fit nothing about where to
go. Short windows, each with an initial state of its own, stay near the data whatever the parameters (Bock 1983). What
they find is the start of a free-run fit and no more: candidates are compared by free runs only.
"""

from __future__ import annotations

from typing import Final, Protocol, TypeVar, runtime_checkable

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import SELECT_EVERY, Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit
from pneumo_ros.diagnosis.record import Record

WINDOWS: Final = 2  # windows in a time block [taste]
ALL: Final = -1  # as a fold: no block is kept from the fit [definition]
FAILED_GAP: Final = 1.0  # normalised gap of a free run that is worse than the log's own mean [definition]


Piece = TypeVar("Piece", bound="Sliceable")


@runtime_checkable
class Sliceable(Record, Protocol):
    """A record that can be cut."""

    def slice(self: Piece, first: int, last: int) -> Piece:
        """Rows ``first`` to ``last`` (excluded) with an initial state estimated anew."""


def free_run_failed(problem: Problem, state: Fit) -> bool:
    """Whether a fit's free run diverged or is further from the log than the log's own mean."""
    return state.diverged or problem.gap(state.residual.clip(-1e6, 1e6)) > FAILED_GAP


def windowed(problem: Problem) -> Problem | None:
    """The same model on short windows of the fitted blocks, all of them fitted; None if the logs cannot be cut."""
    pieces = [piece for record in problem.records for piece in _windows(record, problem.fold, problem.pace.block)]
    return Problem(problem.model, tuple(pieces), problem.averaged, ALL) if pieces else None


def fit_from_windows(problem: Problem, candidate: Candidate, start: Array, iterations: int) -> Fit | None:
    """A free-run fit that starts from what windows of the fitted blocks say; None if they cannot be cut or diverge."""
    short = windowed(problem)
    if short is None:
        return None
    found = fit(short, candidate, carried(problem, short, start), iterations=iterations)
    if found.diverged:
        return None
    return fit(problem, candidate, carried(short, problem, found.x), iterations=iterations)


def carried(one: Problem, other: Problem, x: Array) -> Array:
    """Scaled unknowns for other pieces of the same logs: the initial states there are as they were measured."""
    shared = len(one.model.parameters)
    return np.concatenate([x[:shared], np.zeros(other.fixed - shared), x[one.fixed :]])


def _windows(record: Record, fold: int, block: float) -> list[Sliceable]:
    """Pieces of the blocks that the fit may see, see :attr:`Problem.block`."""
    if not isinstance(record, Sliceable):
        return []
    rows = len(record.measured)
    count = max(1, round(rows * record.period / block))
    edges = np.linspace(0, rows, WINDOWS * count + 1).astype(int)
    seen = [k for k in range(WINDOWS * count) if (k // WINDOWS) % SELECT_EVERY != fold]
    return [record.slice(int(edges[k]), int(edges[k + 1])) for k in seen]
