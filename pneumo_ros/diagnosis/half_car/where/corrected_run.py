# SPDX-License-Identifier: Apache-2.0
"""A located correction put into the free-running model: what the gap becomes once that place is mended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.box import box_minimum
from pneumo_ros.diagnosis.fit.problem import REACH
from pneumo_ros.diagnosis.half_car.signals import Signals
from pneumo_ros.diagnosis.half_car.where.design import PARAMETER_STEP, Design, pressure_rates
from pneumo_ros.diagnosis.half_car.where.features import Features
from pneumo_ros.diagnosis.half_car.where.flexible import Basis
from pneumo_ros.diagnosis.half_car.where.locate import Location, Start, locate, spread
from pneumo_ros.diagnosis.judge.held_out import channel_gaps, total_gap
from pneumo_ros.effects.composition import CORRECTIONS
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel

# Normalised misfit of a free run that is as good as it gets with laws that are not the rig's own [taste]
TARGET: Final = 0.01

PROMISING: Final = 0.02  # share of the squared residual that a place must close alone to be tried in a free run [taste]
TRIED: Final = 4  # places; a free run with parameters polished costs 18 simulations [numerics]

# place that a kind of basis corrects [definition]
_COLUMN: Final = {"force": "{end}_force", "air": "{end}_air", "axle": "{end}_tyre", "heave": "body_heave",
           "pitch": "body_pitch", "supply": "supply"}  # fmt: skip


def correction_series(bases: Sequence[Basis], coefficients: Array, features: Features) -> tuple[Array, Array, Array]:
    """Corrections as time series: (N, 9), road (N, 2), sensors (N, 6).

    The first are those of :data:`~pneumo_ros.effects.composition.CORRECTIONS`; the last is what the measured channels
    would have to be corrected by, and a prediction is corrected the other way.
    """
    count = len(features.heave)
    held, road, sensors = np.zeros((count, len(CORRECTIONS))), np.zeros((count, 2)), np.zeros((count, 6))
    for basis, value in zip(bases, coefficients, strict=True):
        if value == 0.0:
            continue
        if basis.kind == "sensor":
            sensors[:, basis.column] += value * basis.series
        elif basis.kind == "road":
            road[:, basis.column] += value * basis.series
        else:
            column = CORRECTIONS.index(_COLUMN[basis.kind].format(end=("front", "rear")[basis.column]))
            held[:, column] += value * _in_kernel_unit(basis, features)
    return held, road, sensors


def _in_kernel_unit(basis: Basis, features: Features) -> Array:
    if basis.kind == "air":
        return pressure_rates(basis.series, features, basis.column)
    return -basis.series if basis.kind == "supply" else basis.series


def predict_located(model: RigModel, location: Location, design: Design, polish: int = 2) -> Array:
    """Free-running channels (N, 6) with the located correction put in.

    Parameters
    ----------
    model : the rig
    location : from :func:`pneumo_ros.diagnosis.half_car.where.locate.locate`
    design : one of its logs (``location.judge`` for the log held out)
    polish : Gauss-Newton steps of the parameters on the *fitted* log's free run; the corrections stay. Equation
        residuals fix a parameter to what one instant shows, a free run of seconds integrates what is left of it.
    """
    mended = _Mended(model, location.start, location.coefficients)
    nuisance = location.nuisance
    for _ in range(polish):
        nuisance = mended.polished(location.fit[0], nuisance)
    return mended.run(design, nuisance)


def place_gaps(
    model: RigModel,
    fit: Sequence[Signals],
    holdout: Signals,
    nuisance: Array | None = None,
    active: Sequence[Active] = (),
) -> dict[str, float]:
    """Held-out gap of the free run when one place alone gets its flexible correction on top of a fitted model.

    Parameters
    ----------
    model, fit, holdout : as in :func:`~pneumo_ros.diagnosis.half_car.where.locate.locate`
    nuisance, active : the fitted model the corrections are added to; nominal without

    Returns
    -------
    Place -> normalised gap, and under ``"a+b"`` the gap with all of the chosen places corrected, if there are several.
    """
    location = locate(model, fit, holdout, Start(nuisance, tuple(active)))
    places = [place for place, share in location.alone if share > PROMISING]
    sets = [[place] for place in dict.fromkeys([*location.chosen, *places[:TRIED]])]
    if len(location.chosen) > 1:
        sets.append(list(location.chosen))
    return {"+".join(part): _gap_with(model, location, part) for part in sets}


def _gap_with(model: RigModel, location: Location, places: Sequence[str]) -> float:
    coefficients = spread(location.forms, places)
    found = location.forms.coefficients(places)[: location.forms.parameters]
    mended = _Mended(model, location.start, coefficients)
    sigmas = mended.polished(location.fit[0], found)
    return total_gap(channel_gaps(location.judge.signals, mended.run(location.judge, sigmas)))


@dataclass(frozen=True)
class _Mended:
    """A rig model at a fitted structure, its free run corrected by flexible corrections with these coefficients."""

    model: RigModel
    start: Start
    coefficients: Array

    def run(self, design: Design, sigmas: Array) -> Array:
        held, road, sensors = correction_series(design.bases, self.coefficients, design.features)
        driven = replace(design.signals, road=design.signals.road + road)
        values = self.start.values(self.model, sigmas)
        predicted = self.model.simulate(driven, values, active=self.start.active, correction=held)
        return np.asarray(predicted - sensors)

    def polished(self, design: Design, sigmas: Array) -> Array:
        scale, weight = design.signals.scale, design.signals.weight
        base = self.run(design, sigmas)
        columns = []
        for k in range(len(sigmas)):
            moved = sigmas.copy()
            moved[k] += PARAMETER_STEP
            columns.append(((self.run(design, moved) - base) / scale * weight).ravel() / PARAMETER_STEP)
        sensitivity = np.array(columns)
        misfit = ((base - design.signals.measured) / scale * weight).ravel()
        # A free run's residuals are alike over about a second, so that 15 s of six channels are worth about a hundred.
        trust = 100.0 / misfit.size / TARGET**2
        gram = trust * sensitivity @ sensitivity.T + np.eye(len(sigmas))
        offset = self.start.offset(self.model)
        cross = gram @ sigmas - trust * sensitivity @ misfit - (sigmas + offset)
        return np.asarray(box_minimum(gram, cross, -REACH - offset, REACH - offset))
