"""Bounded, regularised least squares for many subsets of places at once.

Fitted on one log, judged on another: both as quadratic forms, so that a subset costs one small linear solve.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

Array = NDArray[np.float64]

REACH = 3.0  # standard deviations that a parameter may be off
# Prior of a shape's size, relative to a shape that moves the residuals by one null standard deviation: wide enough for
# an effect a hundred times the null, narrow enough that near-copies of a shape do not cancel each other.
LOOSENESS = 30.0


@dataclass
class Forms:
    """Quadratic forms of a fit and of a judge, over P parameters and the bases, grouped by place.

    Built by :func:`forms_of`. ``fit_*`` and ``judge_*`` hold A'A, A'r and r'r of residual r and columns A (whose
    coefficients reduce it: |r + A x|^2), ``rows`` the number of judged residuals, ``offset`` (P,) how many standard
    deviations from nominal the parameters already are: the prior holds the sum.
    """

    parameters: int
    groups: dict[str, NDArray[np.intp]]
    sizes: Array
    fit_gram: Array
    fit_cross: Array
    fit_square: float
    judge_gram: Array
    judge_cross: Array
    judge_square: float
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
        index = self.index(places)
        prior = np.ones(len(index))
        prior[self.parameters :] = (self.sizes[index[self.parameters :] - self.parameters] / LOOSENESS) ** 2
        gram = self.fit_gram[np.ix_(index, index)] + np.diag(prior)
        cross = -self.fit_cross[index]
        cross[: self.parameters] -= self.offset
        return _bounded(gram, cross, self.offset)

    def value(self, places: Iterable[str]) -> float:
        """Mean square of the judged residuals with these places corrected (null: about one)."""
        return self._solved(frozenset(places))[0]

    def coefficients(self, places: Iterable[str]) -> Array:
        """As :meth:`solve`, remembered."""
        return self._solved(frozenset(places))[1]

    def fitted(self, places: Iterable[str]) -> float:
        """Mean square on the fitted residuals themselves, in the same unit as :meth:`value` if rows agree."""
        x, index = self.coefficients(places), self.index(places)
        return _square(self.fit_square, self.fit_cross[index], self.fit_gram[np.ix_(index, index)], x) / self.rows

    def _solved(self, places: frozenset[str]) -> tuple[float, Array]:
        if places not in self.cache:
            x, index = self.solve(places), self.index(places)
            square = _square(self.judge_square, self.judge_cross[index], self.judge_gram[np.ix_(index, index)], x)
            self.cache[places] = (square / self.rows, x)
        return self.cache[places]


def forms_of(fit: tuple[Array, Array], judge: tuple[Array, Array], offset: Array, places: Sequence[str]) -> Forms:
    """Quadratic forms from residuals (n,) and columns (n, P + B) of the fitted and the judged rows.

    Parameters
    ----------
    fit, judge : residual and columns of each; rows that carry nothing are zero
    offset : (P,) standard deviations that the parameters already are from nominal
    places : (B,) place of each basis column
    """
    parameters = len(offset)
    groups = {place: parameters + np.flatnonzero(np.asarray(places) == place) for place in dict.fromkeys(places)}
    fit_residual, fit_columns = fit
    residual, columns = judge
    sizes = np.sqrt(np.mean(fit_columns[:, parameters:] ** 2, axis=0)) + 1e-9
    return Forms(
        parameters, groups, sizes,
        fit_columns.T @ fit_columns, fit_columns.T @ fit_residual, float(fit_residual @ fit_residual),
        columns.T @ columns, columns.T @ residual, float(residual @ residual),
        float(max(int(np.count_nonzero(residual)), 1)), offset,
    )  # fmt: skip


def _square(square: float, cross: Array, gram: Array, x: Array) -> float:
    return float(max(square + 2.0 * np.dot(x, cross) + np.dot(x, gram @ x), 0.0))


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


@njit(cache=True)
def box_minimum(gram: Array, cross: Array, low: Array, high: Array) -> Array:
    """Coordinate descent for x'Gx/2 - c'x, low <= x <= high, to 1e-5."""
    x = np.minimum(np.maximum(np.zeros(len(cross)), low), high)
    gradient = gram @ x - cross
    for _ in range(3000):
        moved = 0.0
        for i in range(len(cross)):
            new = min(max(x[i] - gradient[i] / gram[i, i], low[i]), high[i])
            step = new - x[i]
            if step != 0.0:
                x[i] = new
                for j in range(len(cross)):
                    gradient[j] += gram[j, i] * step
                moved = max(moved, abs(step))
        if moved < 1e-5:
            break
    return x


def best_subset(forms: Forms, size: int, start: Sequence[str], places: Sequence[str]) -> list[str]:
    """Subset of ``size`` places with the lowest value: grown from ``start``, then improved by exchanges.

    Growth alone is not enough: two places that only work together (both ends of a rig) are found by the exchange.
    """
    chosen = list(start)
    while len(chosen) < size:
        chosen.append(min((p for p in places if p not in chosen), key=lambda p: forms.value([*chosen, p])))
    improving = True
    while improving:
        improving = False
        for k in range(len(chosen)):
            others = [p for p in places if p not in chosen]
            trials = [[*chosen[:k], p, *chosen[k + 1 :]] for p in others]
            if not trials:
                return chosen
            best = min(trials, key=forms.value)
            if forms.value(best) < forms.value(chosen) * (1.0 - 1e-6):
                chosen, improving = best, True
    return chosen


def shapley(forms: Forms, places: Sequence[str]) -> dict[str, float]:
    """Each place's fair share of ``value(nothing) - value(places)``, averaged over all orders of adding them."""
    count = len(places)
    weights = _order_weights(count)
    out = dict.fromkeys(places, 0.0)
    for size in range(count):
        for subset in combinations(places, size):
            before = forms.value(subset)
            for place in places:
                if place not in subset:
                    out[place] += weights[size] * (before - forms.value([*subset, place]))
    return out


def _order_weights(count: int) -> list[float]:
    """Probability that exactly a given subset of each size comes before a given place."""
    weights = []
    for size in range(count):
        choose = 1.0
        for k in range(size):
            choose *= (count - 1 - k) / (k + 1)
        weights.append(1.0 / (count * choose))
    return weights
