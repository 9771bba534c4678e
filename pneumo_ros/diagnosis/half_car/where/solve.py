# SPDX-License-Identifier: Apache-2.0
"""Bounded, regularised least squares for many subsets of places at once.

Fitted on one log, judged on another: both as quadratic forms, so that a subset costs one small linear solve.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.box import box_minimum
from pneumo_ros.diagnosis.fit.problem import REACH

# Prior of a shape's size, relative to a shape that moves the residuals by one null standard deviation: wide enough
# for an effect a hundred times the null, narrow enough that near-copies of a shape do not cancel each other
# [numerics]
LOOSENESS: Final = 30.0


class Rows(NamedTuple):
    """Residuals of some windows and what changes them.

    Attributes
    ----------
    residual : (n,)
    columns : (n, P + B) change by one unit of each parameter and each basis
    nonlinear : place -> (n,) what the correction of a sensor there changes beyond its linear columns
    """

    residual: Array
    columns: Array
    nonlinear: Mapping[str, Array]

    def masked(self, rows: NDArray[np.bool_]) -> Rows:
        """The same with all other rows zero."""
        nonlinear = {place: rest * rows for place, rest in self.nonlinear.items()}
        return Rows(self.residual * rows, self.columns * rows[:, None], nonlinear)


@dataclass
class Forms:
    """Quadratic forms of a fit and of a judge, over P parameters and the bases, grouped by place.

    Attributes
    ----------
    parameters : P
    groups : place -> its columns
    nonlinear : place -> number of its nonlinear part's column in the Gram matrices
    sizes : (B,) rms of each basis column over the fitted rows
    fit, judge : Gram matrices of [columns, nonlinear, residual]; the residual and the nonlinear parts of corrected
        places enter with coefficient one, the others with the coefficients sought
    rows : number of judged residuals
    offset : (P,) how many standard deviations from nominal the parameters already are: the prior holds the sum
    """

    parameters: int
    groups: dict[str, NDArray[np.intp]]
    nonlinear: dict[str, int]
    sizes: Array
    fit: Array
    judge: Array
    rows: float
    offset: Array
    cache: dict[frozenset[str], tuple[float, Array]] = field(default_factory=dict)

    def index(self, places: Iterable[str]) -> NDArray[np.intp]:
        """Columns of the parameters and of these places."""
        return np.concatenate([np.arange(self.parameters), *(self.groups[p] for p in sorted(places))]).astype(int)

    def testable(self) -> list[str]:
        """Places that move any residual; a channel that the log lacks moves none."""
        return [place for place, columns in self.groups.items() if self.sizes[columns - self.parameters].max() > 1e-6]

    def solve(self, places: Iterable[str]) -> Array:
        """Coefficients of the parameters (in standard deviations) and of these places' shapes, fitted."""
        chosen = sorted(places)
        index, ones = self.index(chosen), self._ones(chosen)
        prior = np.ones(len(index))
        prior[self.parameters :] = (self.sizes[index[self.parameters :] - self.parameters] / LOOSENESS) ** 2
        gram = self.fit[np.ix_(index, index)] + np.diag(prior)
        cross = -self.fit[np.ix_(index, ones)].sum(axis=1)
        cross[: self.parameters] -= self.offset
        return _bounded(gram, cross, self.offset)

    def value(self, places: Iterable[str]) -> float:
        """Mean square of the judged residuals with these places corrected (null: about one)."""
        return self._solved(frozenset(places))[0]

    def coefficients(self, places: Iterable[str]) -> Array:
        """Result of :meth:`solve`, kept for the next call with the same places."""
        return self._solved(frozenset(places))[1]

    def _ones(self, places: Iterable[str]) -> NDArray[np.intp]:
        return np.array([*(self.nonlinear[place] for place in places if place in self.nonlinear), len(self.fit) - 1])

    def _solved(self, places: frozenset[str]) -> tuple[float, Array]:
        if places not in self.cache:
            x = self.solve(places)
            whole = np.concatenate([x, np.ones(len(self._ones(places)))])
            index = np.concatenate([self.index(places), self._ones(sorted(places))]).astype(int)
            square = float(whole @ self.judge[np.ix_(index, index)] @ whole)
            self.cache[places] = (max(square, 0.0) / self.rows, x)
        return self.cache[places]


def forms_of(fit: Rows, judge: Rows, offset: Array, places: Sequence[str]) -> Forms:
    """Quadratic forms of the fitted and of the judged rows.

    Parameters
    ----------
    fit, judge : rows that carry nothing are zero
    offset : (P,) standard deviations that the parameters already are from nominal
    places : (B,) place of each basis column
    """
    parameters, count = len(offset), fit.columns.shape[1]
    groups = {place: parameters + np.flatnonzero(np.asarray(places) == place) for place in dict.fromkeys(places)}
    sizes = np.sqrt(np.mean(fit.columns[:, parameters:] ** 2, axis=0)) + 1e-9
    nonlinear = {place: count + k for k, place in enumerate(fit.nonlinear)}
    rows = float(max(int(np.count_nonzero(judge.residual)), 1))
    return Forms(parameters, groups, nonlinear, sizes, _gram(fit), _gram(judge), rows, offset)


def _gram(rows: Rows) -> Array:
    whole = np.column_stack([rows.columns, *rows.nonlinear.values(), rows.residual])
    return np.asarray(whole.T @ whole)


def _bounded(gram: Array, cross: Array, offset: Array) -> Array:
    """Minimum of x'Gx/2 - c'x with the parameters inside their reach: shapes eliminated, then box descent."""
    p = len(offset)
    low, high = -REACH - offset, REACH - offset
    if len(cross) == p:
        return box_minimum(gram, cross, low, high)
    factor = cho_factor(gram[p:, p:], check_finite=False)
    eliminated = cho_solve(factor, np.column_stack([gram[p:, :p], cross[p:]]), check_finite=False)
    reduced = gram[:p, :p] - gram[:p, p:] @ eliminated[:, :p]
    z = box_minimum(np.ascontiguousarray(reduced), cross[:p] - gram[:p, p:] @ eliminated[:, p], low, high)
    return np.concatenate([z, eliminated[:, p] - eliminated[:, :p] @ z])
