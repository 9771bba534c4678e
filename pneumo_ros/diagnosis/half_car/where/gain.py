# SPDX-License-Identifier: Apache-2.0
"""What a structure leaves in the equations, and how much better a flexible correction on top predicts held-out data.

The judgement is independent of the free run that fitted the structure: effects act along the measured motion
(:mod:`pneumo_ros.diagnosis.half_car.where.path_share`), so that one which draws the free run towards the log with a
wrong law is found out where its forces and flows are not those of the rig.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from pneumo_ros.diagnosis.half_car.where.locate import Location, corrected_residual
from pneumo_ros.diagnosis.judge.equations import EXPLAINED, kept

SPAN: Final = 1.0  # s of a block whose mean squares are taken as independent [taste]


@dataclass(frozen=True)
class FlexibleGain:
    """What a structure leaves of a held-out log's equations, mean squares in null standard deviations.

    Attributes
    ----------
    before : by the nominal structure re-estimated inside its tolerances
    left : by the structure, re-estimated likewise
    mended : with the flexible correction of the places that need it, fitted to other logs
    spread : standard error of ``log_ratio``, from blocks of the held-out log
    places : where the flexible correction acts; empty where nothing calls for one
    shares : of what is left, by place, largest first
    """

    before: float
    left: float
    mended: float
    spread: float
    places: tuple[str, ...]
    shares: tuple[tuple[str, float], ...] = ()

    @property
    def log_ratio(self) -> float:
        """Logarithm of the mean square left over that with the flexible correction; 0 where nothing is left to mend."""
        return float(np.log(max(self.left, EXPLAINED) / max(self.mended, EXPLAINED)))

    @property
    def kept(self) -> float:
        """Share of what the re-estimated nominal structure leaves, above noise and form, that this one leaves as well.

        See :func:`pneumo_ros.diagnosis.judge.equations.kept`.
        """
        return kept(self.left, self.before)


def flexible_gain(nominal: Location, found: Location) -> FlexibleGain:
    """Judge a structure by the equations of a log it was not fitted to.

    Parameters
    ----------
    nominal, found : places of what the nominal model leaves of the logs, and of what the structure does
    """
    left, mended = found.level["refit"] ** 2, found.level["chosen"] ** 2
    return FlexibleGain(nominal.level["refit"] ** 2, left, mended, _spread(found), found.chosen, found.shares)


def _spread(found: Location) -> float:
    """Standard error of the logarithm of (squares left over squares mended), by leaving out one block after another."""
    none = np.zeros_like(found.coefficients)
    squares = [
        np.sum(corrected_residual(found.judge, nuisance, coefficients) ** 2, axis=1)
        for nuisance, coefficients in ((found.refit_nuisance, none), (found.nuisance, found.coefficients))
    ]
    time = found.judge.windows.centres * found.judge.signals.period
    sums = np.array([np.bincount((time / SPAN).astype(int), s) for s in squares])
    without = np.maximum(sums.sum(axis=1, keepdims=True) - sums, 1e-12)
    ratios = np.log(without[0] / without[1])
    count = len(ratios)
    return float(np.sqrt((count - 1) / count * np.sum((ratios - ratios.mean()) ** 2)))
