# SPDX-License-Identifier: Apache-2.0
"""A log's road through the rig *as diagnosed*, in closed loop: what other gains would do on the rig with its effects.

The rig (:mod:`pneumo_ros.effects.corrected_rig`) is stepped period by period, estimator and controller as a session
runs them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.diagnosis.half_car.signals import Signals
from pneumo_ros.effects.configured import library_of
from pneumo_ros.effects.corrected_rig import CorrectedRig
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.errors import InputError
from pneumo_ros.parameters import Value
from pneumo_ros.session.rerun import Rerun, close_stepped
from pneumo_ros.session.stages import ControllerStage, EstimatorStage


def rerun_diagnosed(
    signals: Signals,
    diagnosis: Mapping[str, Any],
    estimator: Mapping[str, Value],
    controller: Mapping[str, Value],
    seed: int = 0,
    model: RigModel | None = None,
) -> Rerun:
    """Run a log's road through its diagnosed rig.

    Parameters
    ----------
    signals : the log; its rows are the control periods, its first row is where the run starts
    diagnosis : content of diagnosis.json, with its ``active`` effects and ``nuisance`` values
    estimator, controller : parameters by name; defaults for the rest
    seed : of the sensor noise
    model : in place of one made from the log's rig and the whole library of effects

    Raises
    ------
    InputError
        if the diagnosis names no effects or one that is not in the library.
    """
    rig_model = model or RigModel(signals.rig, library_of(signals.rig))
    active = active_of(diagnosis, rig_model)
    nuisance = nuisance_of(diagnosis, rig_model)
    stages = (
        EstimatorStage(signals.rig, signals.period, estimator),
        ControllerStage(signals.rig, signals.period, controller),
    )
    noise = np.random.default_rng(seed).standard_normal(signals.measured.shape) * signals.noise_stated
    start = rig_model.initial(signals, active)[0]
    corrected = CorrectedRig(rig_model, signals.period, nuisance, active, start)
    channels, commands = close_stepped(corrected, stages, signals.road, noise)
    notes = (
        f"the rig as diagnosed: {corrected.names}",
        "the run starts from the measured state at the log's first sample",
    )
    return Rerun(signals.time, channels, commands, signals.time, signals.measured, notes)


def active_of(diagnosis: Mapping[str, Any], model: RigModel) -> tuple[Active, ...]:
    """The diagnosed effects with their values.

    Raises
    ------
    InputError
        if the file has no such entry, or names an unknown effect.
    """
    entries = diagnosis.get("active")
    if not isinstance(entries, Sequence):
        raise InputError(
            "no entry 'active'", where="diagnosis", remedy="make the file with this version of pneumo diagnose"
        )
    for entry in entries:
        if entry["effect"] not in model.library:
            raise InputError("unknown effect", where="diagnosis", key=entry["effect"], allowed=", ".join(model.library))
    return tuple(Active(e["effect"], e["site"], tuple(float(v) for v in e["values"])) for e in entries)


def nuisance_of(diagnosis: Mapping[str, Any], model: RigModel) -> NDArray[np.float64]:
    """The fitted rig parameters in the model's order, nominal where the file has none; commands act at once.

    A fitted command delay within the logs' own resolution may be negative, which no closed loop can have.
    """
    fitted = diagnosis.get("nuisance") or {}
    values = []
    for parameter in model.parameters:
        entry = fitted.get(parameter.name)
        late = parameter.unit == "s"
        values.append(parameter.nominal if entry is None or late else float(entry["value"]))
    return np.array(values)
