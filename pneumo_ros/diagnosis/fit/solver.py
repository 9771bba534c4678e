# SPDX-License-Identifier: Apache-2.0
"""Bounded robust least squares on the free-run error, by a projected Levenberg-Marquardt of its own.

The cost is ``N_eff log(geometric mean of the channels' mean squared residuals) + |prior|^2``: the likelihood when the
size of the misfit is unknown, another one in each channel, and its samples are correlated (the determinant criterion of
Box and Draper 1965, Biometrika 52, 355-365, for unrelated channels). A structure that fits badly is thereby not allowed
to move the nuisance parameters with the weight of thousands of samples, one that fits to the noise is held by the data
alone, and what is wrong with one sensor does not drown what the others see. Large isolated residuals are down-weighted
(Huber) at a threshold that follows the channel's misfit.

Sensitivities come from forward differences of the compiled simulator; those of the nuisance parameters hardly change
between candidates and are taken over from the refit for the first step. A step that gains about what they predicted
carries them on by a secant; after one that does not, or that gains little beside those before it, they are taken anew.

Why not ``scipy.optimize.least_squares``: this cost is no sum of squares, so that it has to be called in rounds with the
weight of the data set anew, and it takes no sensitivities from elsewhere, neither borrowed nor carried on. Measured
while one size of misfit stood for all channels, and this solver ran on its secants for longer: on a session pair with
a sensor's scale error four rounds end at the same cost (-540.3) with 650 simulations in 1.6 s, this solver with 86 in
0.2 s; on structures that are wrong (cost 2700) rounds with its Huber loss go on to a cost 2 % lower, with 1100 to 1750.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.diagnosis.fit.box import bounded_newton
from pneumo_ros.diagnosis.fit.pace import HALF_CAR
from pneumo_ros.diagnosis.fit.problem import Candidate, Problem

HUBER: Final = 4.0  # robust sigmas from which a residual counts linearly instead of squared [taste]
# Forward difference in scaled units: short, so that what nothing can tell apart stays exactly degenerate [numerics]
STEP: Final = 2e-3
CENTRAL: Final = 2e-3  # half width of the central differences, scaled units [numerics]
TOLERANCE: Final = 0.05  # of the cost; a diagnosis compares costs that differ by whole units [numerics]
# Scaled units: sensitivities are borrowed for the next step only after a step shorter than this [numerics]
NEAR: Final = 0.3
# Share of the predicted gain from which sensitivities are carried on by a secant rather than taken anew [numerics]
KEPT: Final = 0.3
# Share of the largest gain since they were taken below which a step says that they have had their day [numerics]
FADED: Final = 0.1
COST_FLOOR: Final = 0.05  # mean square, sigma squared: keeps the logarithm finite on noise-free data [numerics]
# Levenberg-Marquardt damping of a fit's first step, as a share of the curvature's diagonal [numerics]
START_DAMPING: Final = 1e-4
MOST_DAMPING: Final = 1e6  # largest damping; a step is nothing there [numerics]


@dataclass(frozen=True)
class Fit:
    """A candidate with its best unknowns.

    Attributes
    ----------
    candidate : what was fitted
    x : scaled unknowns, see :mod:`pneumo_ros.diagnosis.fit.problem`
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


def cost_of(
    residual: Array, rows: Mask | slice, x: Array, prior: Array, correlation: float = HALF_CAR.correlation
) -> float:
    """N_eff log(:func:`level`) + prior; inf for a diverged prediction.

    ``correlation`` : fit samples that count as one; free-run residuals of a wrong structure are smooth
    """
    r = residual[rows]
    if not np.all(np.isfinite(r)):
        return np.inf
    return float(r.size / correlation * np.log(level(r)) + (prior * x) @ x)


def level(residual: Array) -> float:
    """Geometric mean of the channels' :func:`mean_squares`, sigma squared; inf or NaN for a diverged prediction."""
    return float(np.exp(np.mean(np.log(mean_squares(residual)))))


def mean_squares(residual: Array) -> Array:
    """(C,) mean square of each channel of (n, C), large residuals linearly (Huber), with :data:`COST_FLOOR`."""
    magnitude, limit = np.abs(residual), _limits(residual)
    with np.errstate(over="ignore", invalid="ignore"):  # the branch that is not taken
        rho = np.where(magnitude <= limit, residual * residual, limit * (2.0 * magnitude - limit))
    return np.asarray(COST_FLOOR + rho.mean(axis=0))


def weights(residual: Array) -> Array:
    """(n, C) what each sample counts, over sigma squared: by what its channel leaves, large residuals less (Huber)."""
    huber = np.minimum(1.0, _limits(residual) / np.maximum(np.abs(residual), 1e-12))
    return np.asarray(huber / mean_squares(residual))


def _limits(residual: Array) -> Array:
    """(C,) from where on residuals count linearly: :data:`HUBER` times 1.4826 times the median magnitude, at least one
    sigma.
    """
    return np.asarray(HUBER * np.maximum(1.0, 1.4826 * np.median(np.abs(residual), axis=0)))


def fit(
    problem: Problem,
    candidate: Candidate,
    start: Array,
    jacobian: Array | None = None,
    rows: Mask | None = None,
    iterations: int = 10,
    probe: bool = False,
    shared: int | None = None,
) -> Fit:
    """Best unknowns from one start.

    Parameters
    ----------
    start : scaled unknowns
    jacobian : (n, C, >= shared) sensitivities whose first columns serve the first step
    rows : fitted samples; the problem's by default
    probe : never take the borrowed columns anew: a tenth of the cost, for a first look at a candidate
    shared : how many of them are of the same unknowns; by default the fixed ones, more where the candidate is the
        jacobian's own with further parts
    """
    rows = problem.fitted if rows is None else rows
    bounds = problem.bounds(candidate)
    state = _evaluate(problem, candidate, np.clip(start, *bounds), rows)
    if state.diverged:
        return state
    if not len(state.x):  # a rig without tolerances or states, as it is
        return replace(state, jacobian=np.zeros((*state.residual.shape, 0)))
    shared = problem.fixed if shared is None else shared
    borrowed = None if jacobian is None else jacobian[:, :, :shared]
    columns: Array | None = None  # None: to be taken anew
    stale: Array | None = None  # of an earlier step
    damping, failed, largest = START_DAMPING, False, 0.0
    for _ in range(iterations):
        anew = columns is None
        if columns is None:
            largest = 0.0
            columns, spent = _jacobian(problem, state, borrowed, stale)
            state = replace(state, simulations=state.simulations + spent)
        state = replace(state, jacobian=columns)
        better, damping, predicted = _step(problem, state, rows, bounds, damping)
        gained, moved = state.cost - better.cost, better.x - state.x
        largest = max(largest, gained)
        faded = gained < FADED * largest
        as_predicted = gained >= TOLERANCE and gained > KEPT * predicted and not faded
        columns = secant(columns, moved, better.residual - state.residual) if gained >= TOLERANCE else columns
        state = replace(better, jacobian=columns)
        if as_predicted:
            continue
        if gained < TOLERANCE:
            if (anew and borrowed is None) or failed or probe:
                break
            failed, damping = anew, START_DAMPING
        if not probe:
            near = gained >= TOLERANCE and np.max(np.abs(moved)) < NEAR and not faded
            borrowed = columns[:, :, :shared] if near else None
        stale, columns = columns, None
    return state


def secant(columns: Array, moved: Array, change: Array) -> Array:
    """Sensitivities (n, C, m) brought up to date by a step (m,) and the change of the residual it made (n, C).

    The smallest correction that reproduces the step (Broyden 1965, Math. Comp. 19, 577-593); it costs no
    simulation.
    """
    wrong = change - columns @ moved
    return np.asarray(columns + wrong[:, :, None] * (moved / (moved @ moved)))


def _evaluate(problem: Problem, candidate: Candidate, x: Array, rows: Mask, spent: int = 0) -> Fit:
    residual = problem.residual(candidate, x)
    return Fit(
        candidate,
        x,
        cost_of(residual, rows, x, problem.prior(candidate), problem.pace.correlation),
        residual,
        None,
        spent + 1,
    )


def _jacobian(problem: Problem, state: Fit, borrowed: Array | None, stale: Array | None = None) -> tuple[Array, int]:
    """Forward differences, towards the inside of the bounds, and how many simulations they took.

    What stands at a bound of an effect keeps its ``stale`` column, which tells well enough whether it may leave: of a
    shape's atoms most are absent.
    """
    low, high = problem.bounds(state.candidate)
    first = 0 if borrowed is None else borrowed.shape[2]
    columns = np.empty((*state.residual.shape, len(state.x)))
    if borrowed is not None:
        columns[:, :, :first] = borrowed
    wanted = np.arange(first, len(state.x), dtype=np.intp)
    if stale is not None:
        still = (wanted >= problem.fixed) & ((state.x[wanted] <= low[wanted]) | (state.x[wanted] >= high[wanted]))
        columns[:, :, wanted[still]] = stale[:, :, wanted[still]]
        wanted = wanted[~still]
    predict = problem.predict_coarse if problem.coarse_serves(state.candidate, state.x) else problem.predict
    here = predict(state.candidate, state.x)

    def changes(together: list[int]) -> Array:
        step = STEP if state.x[together[0]] + STEP <= high[together[0]] else -STEP
        moved = state.x.copy()
        moved[together] += step
        change = (here - predict(state.candidate, moved)) * (problem.weight / step)
        return np.where(np.isfinite(change), change, 0.0)

    groups = _together(problem, wanted.tolist())
    for group, change in zip(groups, problem.each(changes, groups), strict=True):
        if len(group) == 1:
            columns[:, :, group[0]] = change
            continue
        for m in group:
            rows = problem.rows_of[(m - len(problem.model.parameters)) // problem.states]
            columns[:, :, m] = 0.0
            columns[rows, :, m] = change[rows]
    return columns, len(groups)


def _together(problem: Problem, unknowns: Sequence[int]) -> list[list[int]]:
    """Unknowns that one simulation serves: a state at the start of each log moves that log alone."""
    first = len(problem.model.parameters)
    groups: dict[int, list[int]] = {}
    for m in unknowns:
        state = first + (m - first) % problem.states if first <= m < problem.fixed else m
        groups.setdefault(state, []).append(m)
    return list(groups.values())


def refreshed(problem: Problem, state: Fit) -> Fit:
    """The fit with its sensitivities taken anew where it ended: what others are screened and started by."""
    return state if state.diverged else replace(state, jacobian=_jacobian(problem, state, None)[0])


def sensitivities(problem: Problem, state: Fit) -> Fit:
    """The fit with central differences of the full model: for what is reported, where degenerate directions matter."""
    columns = np.empty((*state.residual.shape, len(state.x)))
    low, high = problem.bounds(state.candidate)

    def column(m: int) -> Array:
        ends = [float(np.clip(state.x[m] + s, low[m], high[m])) for s in (CENTRAL, -CENTRAL)]
        one = np.arange(len(state.x)) == m
        up, down = (problem.residual(state.candidate, np.where(one, end, state.x)) for end in ends)
        change = (up - down) / (ends[0] - ends[1])
        return np.where(np.isfinite(change), change, 0.0)

    for m, change in enumerate(problem.each(column, range(len(state.x)))):
        columns[:, :, m] = change
    return replace(state, jacobian=columns)


def _step(
    problem: Problem, state: Fit, rows: Mask, bounds: tuple[Array, Array], damping: float
) -> tuple[Fit, float, float]:
    """The first of a few ever more damped steps that gains, the next damping, and the gain that the sensitivities
    predict.
    """
    low, high = bounds
    H, g = normal_equations(problem, state, rows)
    for _ in range(5):
        move = bounded_newton(H + damping * np.diag(np.diag(H)), g, low - state.x, high - state.x)
        if np.max(np.abs(move)) < 1e-6:
            break
        trial = _evaluate(problem, state.candidate, state.x + move, rows, state.simulations)
        if trial.cost < state.cost:
            return trial, max(damping / 10.0, 1e-6), float(-2.0 * g @ move - move @ H @ move)
        state = replace(state, simulations=trial.simulations)
        damping = min(damping * 30.0, MOST_DAMPING)
    return state, damping, 0.0


def normal_equations(problem: Problem, state: Fit, rows: Mask) -> tuple[Array, Array]:
    """Curvature and gradient of half the cost at a fit that has its jacobian: (m, m) and (m,)."""
    assert state.jacobian is not None
    r = state.residual[rows]
    root = np.sqrt(weights(r))
    A = state.jacobian[rows]  # a copy
    A *= root[:, :, None]
    A = A.reshape(r.size, len(state.x))
    prior = problem.prior(state.candidate)
    strength = 1.0 / problem.pace.correlation
    with np.errstate(over="ignore", invalid="ignore"):  # a run that runs away: no step from there is taken
        H = strength * (A.T @ A) + np.diag(prior + 1e-9)
        return H, strength * (A.T @ (r * root).ravel()) + prior * state.x
