# SPDX-License-Identifier: Apache-2.0
"""When within a sample did the command jump?

A log holds the command once a sample, but it may be held over a shorter control period: a jump that the log shows at a
row really happened up to one sample earlier. On a rig this costs about the sensor noise in the free-run error, more
than a small effect does. The fraction of a sample by which each jump came earlier is estimated, bounded to [0, 1], from
the fit logs only, after the best candidate is known and for all candidates alike; held-out logs are predicted from what
they hold.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final, Protocol, runtime_checkable

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.box import bounded_newton
from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit, level
from pneumo_ros.diagnosis.record import Record

# prior sigma of a lead, samples: a lead costs something, so that jumps nothing depends on stay where the log has them
# [taste]
PRIOR_STD: Final = 0.5
# The mean square must fall below this share, or the log's own times are kept: jumps that really came earlier make
# most of what a right structure leaves, while a wrong one can always hide some of its error behind them [taste]
WORTH: Final = 0.6
# Mean square, sigma squared, above which the structure is too wrong to time anything by it [taste]
TOO_COARSE: Final = 400.0
MOST_EVENTS: Final = 600  # jumps in all logs, one simulation each: more are not timed [numerics]


@runtime_checkable
class HasEvents(Protocol):
    """A model whose inputs jump at times the log knows only to a sample."""

    def events(self, record: Record) -> list[tuple[int, int]]:
        """(row, column) of each jump: the first row that has the new value."""

    def advanced(self, record: Record, events: list[tuple[int, int]], lead: Array) -> Record:
        """The record with each jump ``lead`` (samples, 0..1) earlier, as the mean over the row before it."""


def timed(logged: Problem, current: Problem, best: Fit) -> Problem:
    """The problem with its commands' jumps put where the best candidate wants them, or the current one if that gains
    nothing.

    Parameters
    ----------
    logged : the problem with the jumps where the logs have them: every timing starts from it, so that what an earlier,
        wrong structure made of the jumps is undone
    current : the problem as last timed
    best : the best fit of the current problem
    """
    model = logged.model
    if not isinstance(model, HasEvents) or best.diverged or best.jacobian is None:
        return current
    rows = current.fitted
    if level(best.residual[rows]) > TOO_COARSE:
        return current
    listed = [model.events(record) for record in logged.records]
    count = sum(len(events) for events in listed)
    if not 0 < count <= MOST_EVENTS:
        return current
    lead, x = _leads(logged, replace(best, residual=logged.residual(best.candidate, best.x)), listed)
    split = np.split(lead, np.cumsum([len(events) for events in listed])[:-1])
    records = tuple(model.advanced(r, e, x) for r, e, x in zip(logged.records, listed, split, strict=True))
    moved = replace(logged, records=records)
    after = fit(moved, best.candidate, x, best.jacobian, iterations=3)
    return moved if level(after.residual[rows]) < WORTH * level(best.residual[rows]) else current


def _leads(problem: Problem, best: Fit, listed: list[list[tuple[int, int]]]) -> tuple[Array, Array]:
    """Bounded least squares for all leads and, with them, the candidate's own unknowns."""
    model = problem.model
    assert isinstance(model, HasEvents) and best.jacobian is not None
    left = np.sqrt(np.maximum(1.0, np.mean(best.residual**2, axis=0)))

    def moved(jump: tuple[int, tuple[int, int]]) -> Array:
        """What a jump one sample earlier does; only its own log's prediction moves."""
        k, event = jump
        rows = problem.rows_of[k]
        advanced = model.advanced(problem.records[k], [event], np.ones(1))
        there = problem.measured[rows] - problem.predict_log(k, advanced, best.candidate, best.x)
        change = np.zeros_like(best.residual)
        change[rows] = (there * problem.weight[rows] - best.residual[rows]) / left
        return change.ravel()

    columns = problem.each(moved, [(k, event) for k, events in enumerate(listed) for event in events])
    T = np.array(columns).T
    J = (best.jacobian / left[:, None]).reshape(T.shape[0], -1)
    A = np.concatenate([T, J], axis=1)
    prior = np.concatenate([np.full(T.shape[1], PRIOR_STD**-2), problem.prior(best.candidate)])
    strength = 1.0 / problem.pace.correlation
    H = strength * A.T @ A + np.diag(prior + 1e-9)  # an effect may have no prior, and move nothing
    g = strength * A.T @ (best.residual / left).ravel()
    low = np.concatenate([np.zeros(T.shape[1]), np.full(J.shape[1], -np.inf)])
    high = np.concatenate([np.ones(T.shape[1]), np.full(J.shape[1], np.inf)])
    move = bounded_newton(H, g, low, high)
    return move[: T.shape[1]], best.x + move[T.shape[1] :]
