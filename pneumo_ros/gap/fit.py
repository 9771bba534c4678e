"""Bounded robust least squares on the free-run error, by a projected Levenberg-Marquardt of its own.

The cost is ``N_eff log(mean squared residual) + |prior|^2``: the likelihood when the size of the misfit is unknown and its
samples are correlated. A structure that fits badly is thereby not allowed to bend the nuisance parameters with the weight
of thousands of samples, and one that fits to the noise is held by the data alone. Large isolated residuals are
down-weighted (Huber) at a threshold that follows the misfit.

Sensitivities come from forward differences of the compiled simulator; those of the nuisance parameters hardly change
between candidates and are taken over from the refit until a step disappoints.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pneumo_ros.gap.model import Array
from pneumo_ros.gap.problem import Candidate, Problem

CORRELATION = 10.0  # fit samples that count as one: free-run residuals of a wrong structure are smooth
HUBER = 4.0  # robust sigmas
STEP = 0.02  # forward difference in scaled units
TOLERANCE = 2e-3  # of the cost; a diagnosis compares costs that differ by whole units
MOST_DAMPING = 1e6


@dataclass(frozen=True)
class Fit:
    """A candidate with its best unknowns.

    Attributes
    ----------
    candidate : what was fitted
    x : scaled unknowns, see :mod:`pneumo_ros.gap.problem`
    cost : value of the cost on the fitted samples; inf when it diverged
    residual : (n, C) in sigmas, all samples
    jacobian : (n, C, m) derivative of the residual, the latest used; None before one is needed
    simulations : how many were spent
    """

    candidate: Candidate
    x: Array
    cost: float
    residual: Array
    jacobian: Array | None = None
    simulations: int = 0

    @property
    def diverged(self) -> bool:
        """No finite prediction was found."""
        return not np.isfinite(self.cost)


def cost_of(residual: Array, rows: Array, x: Array, fixed: int, sigma: float | None = None) -> float:
    """N_eff log(robust mean square) + prior; inf for a diverged prediction."""
    r = residual[rows]
    if not np.all(np.isfinite(r)):
        return np.inf
    limit = HUBER * robust_scale(r) if sigma is None else HUBER * sigma
    magnitude = np.abs(r)
    rho = np.where(magnitude <= limit, r * r, limit * (2.0 * magnitude - limit))
    return float(r.size / CORRELATION * np.log(0.05 + rho.mean()) + x[:fixed] @ x[:fixed])


def robust_scale(residual: Array) -> float:
    """1.4826 times the median magnitude, at least one."""
    return max(1.0, 1.4826 * float(np.median(np.abs(residual))))


def fit(
    problem: Problem,
    candidate: Candidate,
    start: Array,
    jacobian: Array | None = None,
    rows: Array | None = None,
    iterations: int = 8,
    fresh: bool = False,
) -> Fit:
    """Best unknowns from one start.

    Parameters
    ----------
    start : scaled unknowns
    jacobian : (n, C, >= fixed) sensitivities whose fixed columns may be taken over
    rows : fitted samples; the problem's by default
    fresh : compute every column in every iteration
    """
    rows = problem.fitted if rows is None else rows
    low, high = problem.bounds(candidate)
    x = np.clip(start, low, high)
    state = _evaluate(problem, candidate, x, rows)
    if state.diverged:
        return state
    fixed_columns = None if jacobian is None or fresh else jacobian[:, :, : problem.fixed]
    damping, stale = 1e-3, fixed_columns is not None
    for _ in range(iterations):
        columns = _jacobian(problem, state, fixed_columns)
        state = replace(state, jacobian=columns, simulations=state.simulations + _spent(columns, fixed_columns))
        better, damping = _step(problem, state, rows, low, high, damping)
        gained = state.cost - better.cost
        if gained > TOLERANCE:
            state = replace(better, jacobian=columns)
        if gained <= TOLERANCE * 50.0 and stale and not fresh:
            fixed_columns, stale = None, False  # the borrowed sensitivities have given what they can
            if gained <= TOLERANCE:
                continue
        elif gained <= TOLERANCE:
            break
        if not stale:
            fixed_columns = columns[:, :, : problem.fixed] if not fresh else None
            stale = fixed_columns is not None
    return state


def _evaluate(problem: Problem, candidate: Candidate, x: Array, rows: Array, spent: int = 0) -> Fit:
    residual = problem.residual(candidate, x)
    return Fit(candidate, x, cost_of(residual, rows, x, problem.fixed), residual, None, spent + 1)


def _spent(columns: Array, borrowed: Array | None) -> int:
    return columns.shape[2] - (0 if borrowed is None else borrowed.shape[2])


def _jacobian(problem: Problem, state: Fit, borrowed: Array | None) -> Array:
    """Forward differences, towards the inside of the bounds."""
    _, high = problem.bounds(state.candidate)
    first = 0 if borrowed is None else borrowed.shape[2]
    columns = np.empty((*state.residual.shape, len(state.x)))
    if borrowed is not None:
        columns[:, :, :first] = borrowed
    for m in range(first, len(state.x)):
        step = STEP if state.x[m] + STEP <= high[m] else -STEP
        moved = state.x.copy()
        moved[m] += step
        column = (problem.residual(state.candidate, moved) - state.residual) / step
        columns[:, :, m] = np.where(np.isfinite(column), column, 0.0)
    return columns


def _step(problem: Problem, state: Fit, rows: Array, low: Array, high: Array, damping: float) -> tuple[Fit, float]:
    """The best of a few damped steps."""
    r = state.residual[rows]
    limit = HUBER * robust_scale(r)
    w = np.minimum(1.0, limit / np.maximum(np.abs(r), 1e-12))
    rho = np.where(w < 1.0, limit * (2.0 * np.abs(r) - limit), r * r)
    strength = 1.0 / (CORRELATION * (0.05 + rho.mean()))
    assert state.jacobian is not None
    A = (state.jacobian[rows] * np.sqrt(w)[:, :, None]).reshape(-1, len(state.x))
    prior = np.zeros(len(state.x))
    prior[: problem.fixed] = 1.0
    H = strength * (A.T @ A) + np.diag(prior)
    g = strength * (A.T @ (r * np.sqrt(w)).ravel()) + prior * state.x
    best = state
    for _ in range(5):
        move = bounded_newton(H + damping * np.diag(np.diag(H) + 1e-9), g, low - state.x, high - state.x)
        if np.max(np.abs(move)) < 1e-6:
            break
        trial = _evaluate(problem, state.candidate, state.x + move, rows, best.simulations)
        best = replace(best, simulations=trial.simulations)
        if trial.cost < state.cost:
            return trial, max(damping / 10.0, 1e-6)
        damping = min(damping * 10.0, MOST_DAMPING)
    return best, damping


def bounded_newton(H: Array, g: Array, low: Array, high: Array) -> Array:
    """Minimiser of ``d H d / 2 + g d`` within bounds, by pinning what would leave them (a few rounds suffice)."""
    move = np.zeros(len(g))
    free = np.ones(len(g), dtype=bool)
    for _ in range(8):
        pinned = ~free
        rhs = -(g[free] + H[np.ix_(free, pinned)] @ move[pinned])
        move[free] = np.linalg.solve(H[np.ix_(free, free)], rhs)
        out = free & ((move < low) | (move > high))
        if not out.any():
            break
        move[out] = np.clip(move[out], low[out], high[out])
        free &= ~out
        if not free.any():
            break
    return np.clip(move, low, high)
