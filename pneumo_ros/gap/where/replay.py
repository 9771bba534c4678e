"""A located correction put into the free-running model: what the gap becomes once that place is mended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.gap.compose import CORRECTIONS
from pneumo_ros.gap.rig_model import RigModel
from pneumo_ros.gap.where.design import PARAMETER_STEP, Design, pressure_rates
from pneumo_ros.gap.where.features import Features
from pneumo_ros.gap.where.flexible import Basis
from pneumo_ros.gap.where.locate import Location
from pneumo_ros.gap.where.solve import REACH, box_minimum

Array = NDArray[np.float64]

TARGET = 0.01  # normalised misfit of a free run that is as good as it gets with laws that are not the rig's own

_COLUMN = {"force": "{end}_force", "air": "{end}_air", "axle": "{end}_tyre", "heave": "body_heave",
           "pitch": "body_pitch", "supply": "supply"}  # fmt: skip


def correction_series(bases: Sequence[Basis], coefficients: Array, features: Features) -> tuple[Array, Array, Array]:
    """Corrections as time series: (N, 9) of :data:`~pneumo_ros.gap.compose.CORRECTIONS`, road (N, 2), sensors (N, 6).

    The last is what the measured channels would have to be corrected by; a prediction is corrected the other way.
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
    location : from :func:`pneumo_ros.gap.where.locate.locate`
    design : one of its logs (``location.judge`` for the log held out)
    polish : Gauss-Newton steps of the parameters on the *fitted* log's free run; the corrections stay. Equation
        residuals fix a parameter to what one instant shows, a free run of seconds integrates what is left of it.
    """
    nuisance = location.nuisance
    for _ in range(polish):
        nuisance = _polished(model, location, nuisance)
    return _run(model, location, design, nuisance)


def _run(model: RigModel, location: Location, design: Design, nuisance: Array) -> Array:
    held, road, sensors = correction_series(design.bases, location.coefficients, design.features)
    values = np.array([p.nominal + z * p.std for p, z in zip(model.parameters, nuisance, strict=True)])
    driven = replace(design.signals, road=design.signals.road + road)
    return np.asarray(model.simulate(driven, values, correction=held) - sensors)


def _polished(model: RigModel, location: Location, nuisance: Array) -> Array:
    design = location.fit[0]
    scale, weight = design.signals.scale, design.signals.weight
    base = _run(model, location, design, nuisance)
    columns = []
    for k in range(len(nuisance)):
        moved = nuisance.copy()
        moved[k] += PARAMETER_STEP
        columns.append(((_run(model, location, design, moved) - base) / scale * weight).ravel() / PARAMETER_STEP)
    sensitivity = np.array(columns)
    misfit = ((base - design.signals.measured) / scale * weight).ravel()
    # A free run's residuals are alike over about a second, so that 15 s of six channels are worth about a hundred.
    trust = 100.0 / misfit.size / TARGET**2
    gram = trust * sensitivity @ sensitivity.T + np.eye(len(nuisance))
    cross = gram @ nuisance - trust * sensitivity @ misfit - nuisance
    return np.asarray(box_minimum(gram, cross, REACH))
