# SPDX-License-Identifier: Apache-2.0
"""What structures leave in the equations of a held-out log, many structures of the same logs one after another.

:func:`pneumo_ros.diagnosis.half_car.where.locate.locate` tells where what one structure leaves lies; this only tells
how much it is, without shapes, and works the logs' own part of the problem out once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.diagnosis.half_car.signals import Signals
from pneumo_ros.diagnosis.half_car.where.design import FEEDS, Design, design_of
from pneumo_ros.diagnosis.half_car.where.locate import Start
from pneumo_ros.diagnosis.half_car.where.solve import Rows, forms_of
from pneumo_ros.diagnosis.half_car.where.weak import EQUATIONS
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel

# Equations that something acts in, by the kind of its place; of an end its own [definition]
ACTS_IN: Final = {
    "force": ("heave", "pitch", "{end}_axle"),
    "tyre": ("{end}_axle",),
    "air": ("{end}_air",),
    "body_heave": ("heave",),
    "body_pitch": ("pitch",),
    "road_input": ("front_axle", "rear_axle"),
    "supply": ("front_air", "rear_air"),
}


@dataclass(frozen=True)
class HeldEquations:
    """The equations of some logs, prepared; as of :class:`pneumo_ros.diagnosis.judge.equations.Equations`.

    Attributes
    ----------
    model : the rig with its tolerances
    fit, judge : problems of the logs that the tolerances are estimated from, and of the one that judges
    """

    model: RigModel
    fit: tuple[Design, ...]
    judge: Design

    def left(self, nuisance: Array, active: Sequence[Active]) -> Array:
        """Mean square that a structure leaves in each of :data:`EQUATIONS`, (6,), in null variances: about 1 where
        noise and model form are all, 0 where the log has not the channels.

        Parameters
        ----------
        nuisance, active : (P,) parameter values, SI, and effects; the parameters are estimated anew from the equations
        """
        start = Start(nuisance, tuple(active))
        fit, judge = [start.put_into(self.model, d) for d in self.fit], start.put_into(self.model, self.judge)
        rows = [_rows(design) for design in fit]
        stacked = Rows(np.concatenate([r.residual for r in rows]), np.concatenate([r.columns for r in rows]), {})
        moved = forms_of(stacked, _rows(judge), start.offset(self.model), ()).coefficients(())
        squares = (judge.residual + np.tensordot(moved, judge.parameters, 1)) ** 2
        return np.asarray(squares.sum(axis=0) / np.maximum(np.count_nonzero(judge.residual, axis=0), 1))

    def of(self, places: Sequence[str]) -> Mask:
        """Which of :data:`EQUATIONS` something at some places of the contract acts in, (6,)."""
        names = {equation for place in places for equation in _equations_of(place)}
        return np.array([equation in names for equation in EQUATIONS])


def _equations_of(place: str) -> tuple[str, ...]:
    """The equations that something at a place acts in; all that a sensor's channel feeds."""
    sensor, _, channel = place.partition(":")
    if sensor == "sensor":
        return tuple(equation for equation, fed in FEEDS.items() if channel in fed)
    end, _, kind = place.rpartition("_")
    return tuple(name.format(end=end) for name in ACTS_IN.get(place, ACTS_IN.get(kind, ())))


def held_equations(model: RigModel, fit: Sequence[Signals], holdout: Signals) -> HeldEquations:
    """Prepare the equations of logs to fit and of a held-out one."""
    first = design_of(model, fit[0])
    rest = [design_of(model, log, first.features.yardstick) for log in (*fit[1:], holdout)]
    *others, judge = [replace(design, columns=design.columns[:0], bases=[]) for design in rest]
    return HeldEquations(model, (replace(first, columns=first.columns[:0], bases=[]), *others), judge)


def _rows(design: Design) -> Rows:
    columns = design.parameters.reshape(len(design.parameters), -1).T
    return Rows(design.residual.ravel(), columns, {})
