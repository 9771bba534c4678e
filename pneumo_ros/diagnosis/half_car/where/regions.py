# SPDX-License-Identifier: Apache-2.0
"""In one sentence: the place, the regime and the band in which a gap lives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.where.locate import Location, corrected_residual
from pneumo_ros.diagnosis.half_car.where.regimes import BANDS, Regime, bands, regimes, sharpest, shows_in
from pneumo_ros.diagnosis.half_car.where.weak import EQUATIONS


@dataclass(frozen=True)
class Occurrence:
    """Where and when a gap shows.

    Attributes
    ----------
    place : contract name
    equation : in which it shows
    regime : that holds most of it, or None if it is there all the time
    band : (low, high, share): Hz and share of the squared error
    regimes : every regime of that equation
    """

    place: str
    equation: str
    regime: Regime | None
    band: tuple[float, float, float]
    regimes: tuple[Regime, ...]

    @property
    def text(self) -> str:
        """For example "in fast motion (90 % of it in 50 % of the time), mostly at 1-4 Hz"."""
        low, high, share = self.band
        where = f"{100 * share:.0f} % of it " + (f"above {low:g} Hz" if low >= BANDS[-1] else f"at {low:g}-{high:g} Hz")
        if self.regime is None:
            return f"it shows in every regime, {where}"
        r = self.regime
        held = f"{100 * r.gap_share:.0f} % of it in {100 * r.time_share:.0f} % of the time"
        return f"it shows mostly in one regime, {r.label}: {held}; {where}"


def occurrence(location: Location, error: Array | None = None, place: str | None = None) -> Occurrence:
    """Where and when the refitted model's gap shows on the held-out log.

    Parameters
    ----------
    location : of the gap
    error : (N, C) normalised free-running error whose band is wanted; without it the equation's own residual
    place : the place to look at; the largest share by default
    """
    judge = location.judge
    residual = corrected_residual(judge, location.refit_nuisance, np.zeros(len(judge.columns)))
    where = place or location.shares[0][0]
    equation = shows_in(where, residual, judge.weight)
    found = regimes(judge, residual, equation)
    step = float(np.diff(judge.windows.centres[:2])[0]) * judge.signals.period
    spread = bands(error, judge.signals.period) if error is not None else bands(_column(residual, equation), step)
    return Occurrence(where, equation, sharpest(found), max(spread, key=lambda band: band[2]), tuple(found))


def _column(residual: Array, equation: str) -> Array:
    return residual[:, [EQUATIONS.index(equation)]]
