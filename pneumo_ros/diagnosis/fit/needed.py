# SPDX-License-Identifier: Apache-2.0
"""How many unknowns of its effects a fit needs: what came along and moves nothing that others could not is no claim."""

from __future__ import annotations

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.fit.solver import Fit, normal_equations


def needed_unknowns(problem: Problem, fit: Fit, price: float) -> float:
    """Number of unknowns of a fit's effects, in which atoms that can be dropped for less than their price count as what
    dropping them costs, over the price.

    Atoms are dropped one after the other, the cheapest first, and all that stays answers as the curvature of the cost
    at the fit says; no simulation is spent. A law's own unknowns stay. Where a shape begins counts at most as it is
    worth by itself. Without a jacobian every unknown counts.

    Parameters
    ----------
    price : cost that an unknown must save
    """
    if fit.jacobian is None or fit.diverged or len(fit.x) == problem.fixed:
        return float(len(fit.x) - problem.fixed)
    H, _ = normal_equations(problem, fit, problem.fitted)
    atom, place = _of_shapes(problem, fit)
    absent = atom & (fit.x == 0.0)
    kept = ~absent
    dropped, paid = _dropped(H[np.ix_(kept, kept)], fit.x[kept], atom[kept], price)
    worth = np.minimum(1.0, fit.x[place] ** 2 * np.diag(H)[place] / price)
    laws = len(fit.x) - problem.fixed - int(atom.sum()) - int(place.sum())
    return float(laws + worth.sum() + (atom & kept).sum() - dropped + paid / price)


def _of_shapes(problem: Problem, fit: Fit) -> tuple[Array, Array]:
    """Which unknowns are sizes of atoms, and which say where an atom lies: (m,) each."""
    kinds = [(False, False)] * problem.fixed
    for part in fit.candidate.parts:
        shape = part in fit.candidate.shapes
        kinds += [(shape and p.size, shape and not p.size) for p in problem.parameters_of[part]]
    atom, place = np.array(kinds, dtype=bool).T
    return atom, place


def _dropped(H: Array, x: Array, may: Array, price: float) -> tuple[int, float]:
    """How many unknowns are dropped for less than ``price`` each, and what they cost in all: backward elimination on
    the quadratic that the curvature ``H`` (m, m) of half the cost makes about ``x`` (m,).
    """
    scale = np.sqrt(np.diag(H))
    inverse = np.linalg.pinv(H / np.outer(scale, scale), hermitian=True)
    x, left, paid = x * scale, np.flatnonzero(may), 0.0
    while len(left):
        costs = x[left] ** 2 / np.maximum(inverse[left, left], 1e-300)
        least = int(np.argmin(costs))
        if costs[least] >= price:
            break
        m = left[least]
        paid += float(costs[least])
        along = inverse[:, m] / inverse[m, m]
        x = x - along * x[m]
        inverse = inverse - np.outer(along, inverse[m])
        left = np.delete(left, least)
    return int(may.sum()) - len(left), paid
