# SPDX-License-Identifier: Apache-2.0
"""Structures on logs that nothing was fitted to: the held-out log, and a log of the rig after a known change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.diagnosis.judge.held_out import channel_gaps, free_run, total_gap
from pneumo_ros.diagnosis.model import Model
from pneumo_ros.diagnosis.record import Record
from pneumo_ros.diagnosis.result import EditTest
from pneumo_ros.diagnosis.traits import HasChanges
from pneumo_ros.effects.parameters import Active


@dataclass(frozen=True)
class HeldOut:
    """A structure on the held-out log."""

    predicted: Array
    channels: Array
    total: float


def held_out(model: Model, record: Record, nuisance: Array, active: Sequence[Active]) -> HeldOut:
    """Prediction and gaps of a structure on a record from its measured initial state."""
    predicted = free_run(model, record, nuisance, active)
    channels = channel_gaps(record, predicted)
    return HeldOut(predicted, channels, total_gap(channels))


def held_by(problem: Problem, one: Fit, holdout: Record) -> HeldOut:
    """The same of a fit."""
    active = problem.active(one.candidate, problem.values(one.candidate, one.x))
    return held_out(problem.model, holdout, problem.nuisance(one.x), active)


def held_runs(problem: Problem, base: Fit, best: Fit, holdout: Record) -> dict[str, HeldOut]:
    """Nominal, re-estimated and best structure on the held-out log."""
    nominal_values = np.array([p.nominal for p in problem.model.parameters])
    runs = {"nominal": held_out(problem.model, holdout, nominal_values, ()), "refit": held_by(problem, base, holdout)}
    return runs | {"best": runs["refit"] if best is base else held_by(problem, best, holdout)}


def edit_test(problem: Problem, edit: Record, base: Fit, best: Fit) -> EditTest:
    """Predict a log of the rig after a known change: what the log's configuration states differently is applied to the
    estimates as a factor; nothing is fitted again."""
    model = problem.model
    factors = model.changes(edit) if isinstance(model, HasChanges) else {}
    scale = np.array([factors.get(p.name, 1.0) for p in model.parameters])
    nominal = np.array([p.nominal for p in model.parameters])
    active = problem.active(best.candidate, problem.values(best.candidate, best.x))
    gaps = [
        held_out(model, edit, nuisance * scale, effects).total
        for nuisance, effects in (
            (nominal, ()),
            (problem.nuisance(base.x), ()),
            (problem.nuisance(best.x), active),
        )
    ]
    changed = {name: factor for name, factor in factors.items() if factor != 1.0}
    return EditTest(edit.name, changed, *gaps)
