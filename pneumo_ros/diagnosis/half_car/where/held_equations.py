# SPDX-License-Identifier: Apache-2.0
"""What structures leave in the equations of a held-out log, many structures of the same logs one after another.

:func:`pneumo_ros.diagnosis.half_car.where.locate.locate` tells where what one structure leaves lies; this only tells
how much it is, without shapes, and works the logs' own part of the problem out once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.signals import Signals
from pneumo_ros.diagnosis.half_car.where.design import Design, design_of
from pneumo_ros.diagnosis.half_car.where.locate import Start
from pneumo_ros.diagnosis.half_car.where.solve import Rows, forms_of
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel


@dataclass(frozen=True)
class HeldEquations:
    """The equations of some logs, prepared.

    Attributes
    ----------
    model : the rig with its tolerances
    fit, judge : problems of the logs that the tolerances are estimated from, and of the one that judges
    """

    model: RigModel
    fit: tuple[Design, ...]
    judge: Design

    def left(self, nuisance: Array, active: Sequence[Active]) -> float:
        """Mean square that a structure leaves, in null variances: about 1 where noise and model form are all.

        Parameters
        ----------
        nuisance, active : (P,) parameter values, SI, and effects; the parameters are estimated anew from the equations
        """
        start = Start(nuisance, tuple(active))
        fit, judge = [start.put_into(self.model, d) for d in self.fit], start.put_into(self.model, self.judge)
        rows = [_rows(design) for design in fit]
        stacked = Rows(np.concatenate([r.residual for r in rows]), np.concatenate([r.columns for r in rows]), {})
        return forms_of(stacked, _rows(judge), start.offset(self.model), ()).value(())


def held_equations(model: RigModel, fit: Sequence[Signals], holdout: Signals) -> HeldEquations:
    """Prepare the equations of logs to fit and of a held-out one."""
    first = design_of(model, fit[0])
    rest = [design_of(model, log, first.features.yardstick) for log in (*fit[1:], holdout)]
    *others, judge = [replace(design, columns=design.columns[:0], bases=[]) for design in rest]
    return HeldEquations(model, (replace(first, columns=first.columns[:0], bases=[]), *others), judge)


def _rows(design: Design) -> Rows:
    columns = design.parameters.reshape(len(design.parameters), -1).T
    return Rows(design.residual.ravel(), columns, {})
