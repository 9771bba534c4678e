"""A log's road through the rig *as diagnosed*, in closed loop: what other gains would do on the rig with its effects.

The composed model simulates whole records, with the effects' inner states inside. Closing the loop around it goes
window by window: guess the commands of a window, simulate up to its end, let estimator and controller answer, repeat
until the commands no longer change. Row i of the model depends on commands before row i alone, so the fixed point is
the exact closed loop, reached after as many rounds as the window has rows at the latest; in practice a handful.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.errors import InputError
from pneumo_ros.gap.model import Active
from pneumo_ros.gap.rig_model import RigModel
from pneumo_ros.gap.signals import Signals
from pneumo_ros.parameters import Value
from pneumo_ros.plant.trim import trim
from pneumo_ros.session.rerun import Rerun
from pneumo_ros.session.stages import ControllerStage, EstimatorStage

WINDOW = 40  # rows: shorter simulates the past more often, longer needs more rounds
_INLETS_AND_OUTLETS = 4


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
    rig_model = model or RigModel(signals.rig)
    active = active_of(diagnosis, rig_model)
    nuisance = nuisance_of(diagnosis, rig_model)
    stages = (
        EstimatorStage(signals.rig, signals.period, estimator),
        ControllerStage(signals.rig, signals.period, controller),
    )
    noise = np.random.default_rng(seed).standard_normal(signals.measured.shape) * signals.noise_stated
    loop = _Loop(rig_model, signals, active, nuisance, stages, noise)
    for begin in range(0, len(signals.measured), WINDOW):
        loop.close(begin, min(begin + WINDOW, len(signals.measured)))
    names = ", ".join(f"{a.effect} ({a.site or 'rig'})" for a in active) or "no effect"
    notes = (f"the rig as diagnosed: {names}", "the run starts from the measured state at the log's first sample")
    return Rerun(signals.time, loop.channels, loop.commands, signals.time, signals.measured, notes)


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


class _Loop:
    """The loop being closed, window by window."""

    def __init__(
        self,
        model: RigModel,
        signals: Signals,
        active: tuple[Active, ...],
        nuisance: NDArray[np.float64],
        stages: tuple[EstimatorStage, ControllerStage],
        noise: NDArray[np.float64],
    ) -> None:
        self._model, self._active, self._nuisance, self._noise = model, active, nuisance, noise
        self._estimator, self._controller = stages
        self.commands = np.tile(trim(signals.rig).command, (len(signals.measured), 1))
        self.channels = np.zeros_like(signals.measured)
        self._record = replace(signals, commands=self.commands)
        self._states: tuple[Any, Any] | None = None

    def close(self, begin: int, end: int) -> None:
        """Rows begin <= i < end."""
        self.commands[begin:end] = self.commands[max(begin - 1, 0)]
        for _ in range(end - begin + 1):
            out = self._model.simulate(self._record, self._nuisance, None, self._active, rows=end)
            self.channels[begin:end] = out[begin:end] + self._noise[begin:end]
            answers, states = self._answer(begin, end)
            settled = np.array_equal(answers, self.commands[begin:end])
            self.commands[begin:end] = answers
            if settled:
                break
        self._states = states

    def _answer(self, begin: int, end: int) -> tuple[NDArray[np.float64], tuple[Any, Any]]:
        """Commands of the window's rows, and the states after it."""
        seen, commanded = self._states or (None, None)
        answers = np.empty((end - begin, _INLETS_AND_OUTLETS))
        for i, sample in enumerate(self.channels[begin:end]):
            seen = self._estimator.first(sample) if seen is None else seen
            seen, estimate = self._estimator.step(seen, sample)
            commanded = self._controller.first(estimate.values) if commanded is None else commanded
            commanded, command = self._controller.step(commanded, estimate.values)
            answers[i] = command.values
        return answers, (seen, commanded)
