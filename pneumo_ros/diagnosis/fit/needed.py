# SPDX-License-Identifier: Apache-2.0
"""How many unknowns of its effects a fit needs: what came along and moves nothing that others could not is no claim."""

from __future__ import annotations

from math import lgamma

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.fit.solver import Fit, normal_equations


def needed_unknowns(problem: Problem, fit: Fit, price: float) -> float:
    """Number of unknowns of a fit's effects, in which atoms that can be dropped for less than their price count as what
    dropping them costs, over the price.

    Atoms are dropped one after the other, the cheapest first, and all that stays answers as the curvature of the cost
    at the fit says; no simulation is spent. Which few of many atoms are needed is told by the data as well: k of n
    cost twice the logarithm of the number of such choices beside their price (extended Bayes information criterion:
    Chen and Chen, Biometrika 95, 2008). A law's own unknowns stay. Where a shape begins counts at most as it is worth
    by itself. Without a jacobian every unknown counts.

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
    paid = _dropped(H[np.ix_(kept, kept)], fit.x[kept], atom[kept])
    worth = np.minimum(1.0, fit.x[place] ** 2 * np.diag(H)[place] / price)
    laws = len(fit.x) - problem.fixed - int(atom.sum()) - int(place.sum())
    offered, used = int(atom.sum()), len(paid) - 1
    costs = [cost + price * k + _choice(offered, k) for cost, k in zip(paid, range(used, -1, -1), strict=True)]
    return float(laws + worth.sum() + min(costs) / price)


def _choice(offered: int, taken: int) -> float:
    """What telling which atoms are taken costs."""
    return 2.0 * (lgamma(offered + 1) - lgamma(taken + 1) - lgamma(offered - taken + 1))


def _of_shapes(problem: Problem, fit: Fit) -> tuple[Array, Array]:
    """Which unknowns are sizes of atoms, and which say where an atom lies: (m,) each."""
    kinds = [(False, False)] * problem.fixed
    for part in fit.candidate.parts:
        shape = part in fit.candidate.shapes
        kinds += [(shape and p.size, shape and not p.size) for p in problem.parameters_of[part]]
    atom, place = np.array(kinds, dtype=bool).T
    return atom, place


def _dropped(H: Array, x: Array, may: Array) -> list[float]:
    """Cost of dropping none, one, two ... of the unknowns that ``may`` go (m,): backward elimination on the quadratic
    that the curvature ``H`` (m, m) of half the cost makes about ``x`` (m,).
    """
    scale = np.sqrt(np.diag(H))
    inverse = np.linalg.pinv(H / np.outer(scale, scale), hermitian=True)
    x, left, paid = x * scale, np.flatnonzero(may), [0.0]
    while len(left):
        costs = x[left] ** 2 / np.maximum(inverse[left, left], 1e-300)
        m = left[np.argmin(costs)]
        paid.append(paid[-1] + float(costs.min()))
        along = inverse[:, m] / inverse[m, m]
        x = x - along * x[m]
        inverse = inverse - np.outer(along, inverse[m])
        left = left[left != m]
    return paid
