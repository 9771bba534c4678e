# SPDX-License-Identifier: Apache-2.0
"""What effects already in the model do along the measured motion, so that what is left can be told from drift.

A free run that misses something wanders off, and the effects in it act on another motion than the rig's: what they
explain would be confused with where the run has drifted to. Here the run is kept on the log: what the equations miss is
put in as forces, moment and flows, so the model moves as the rig did, and the missing part is what had to be put in.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.where.design import Design, car_of, inputs_of, pressure_rates
from pneumo_ros.diagnosis.half_car.where.features import Features
from pneumo_ros.diagnosis.half_car.where.weak import Windows, averaged, weak_residuals
from pneumo_ros.diagnosis.judge.held_out import settle
from pneumo_ros.effects.composition import CORRECTIONS
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel

PASSES: Final = 4  # the first is the free run; the third is within a few null standard deviations of the log [numerics]
# Places whose corrections carry what is missing, one an equation [definition]
CARRIERS: Final = ("body_heave", "body_pitch", "front_tyre", "rear_tyre", "front_air", "rear_air")


def explained(model: RigModel, design: Design, nuisance: Array, active: Sequence[Active]) -> Array:
    """Part of the nominal equations' residuals (K, 6) that parameters and effects account for, in the equations' units.

    Of the free run and of the runs kept on the log the one counts that leaves least: with nothing missing the free run
    moves as the rig did, and forces that follow the sensors' noise only shake the effects.

    Parameters
    ----------
    model : the rig
    design : of the log
    nuisance, active : (P,) parameter values and the effects in the model
    """
    signals, windows, features = design.signals, design.windows, design.features
    inputs, active = inputs_of(signals), tuple(active)
    nominal, car = weak_residuals(car_of(model), inputs, windows), car_of(model, nuisance)
    bare = weak_residuals(car, inputs, windows)
    if not active and not model.configured:
        return nominal - bare
    initial = settle(model, signals, nuisance, active)
    missing, best, least = np.zeros_like(bare), bare, np.inf
    for _ in range(PASSES):
        given = _series(missing, windows, len(inputs.measured))
        followed = model.simulate(signals, nuisance, initial, active, _held(given, features))
        if not np.all(np.isfinite(followed)):
            break
        off = bare - weak_residuals(car, inputs._replace(measured=followed), windows)
        left = off + np.column_stack([averaged(s, windows.window.value, windows.centres) for s in given.T])
        size = float(np.sum((left * design.weight / design.null) ** 2))
        best, least = (left, size) if size < least else (best, least)
        missing = missing + off
    return nominal - best


def _series(missing: Array, windows: Windows, rows: int) -> Array:
    """What the equations miss at the windows' centres (K, 6), at every row (N, 6)."""
    return np.column_stack([np.interp(np.arange(rows), windows.centres, column) for column in missing.T])


def _held(missing: Array, features: Features) -> Array:
    """What the equations miss (N, 6) as corrections (N, 9) of the simulation."""
    held = np.zeros((len(missing), len(CORRECTIONS)))
    for e, carrier in enumerate(CARRIERS):
        series = missing[:, e]
        held[:, CORRECTIONS.index(carrier)] = pressure_rates(series, features, e - 4) if e >= 4 else series
    return held
