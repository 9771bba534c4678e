# SPDX-License-Identifier: Apache-2.0
"""The next experiment of one's own rig: what to drive its inputs with, inside what the log has seen of them.

Only inputs that the rig file marks ``drive: true`` are moved, one at a time, the others resting at their middle; never
beyond the log's own range, never faster than the log moved them (but for those that are held from row to row). A
measured input is nobody's to command: without a mark nothing is offered.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.experiment import NextExperiment, separation
from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.files import new_file
from pneumo_ros.own_rig.model import OwnRig
from pneumo_ros.own_rig.records import OwnRecord

FILE = "next_experiment.csv"
FASTEST = 0.999  # quantile of an input's rate in the log that a profile may reach
PATTERN = np.array([0.0, 1.0, -0.6, 0.5, -1.0, 0.8, -0.3, 0.0])  # of steps, of half the range
BEGIN = 0.05  # of a profile, from rest


@dataclass(frozen=True)
class Shape:
    """A course of an input in halves of its range: ``of`` takes times (N,) and the slowest motion's period, s."""

    name: str
    says: str
    of: Callable[[Array, float], Array]


def _triangle(t: Array, period: float) -> Array:
    turn = np.mod(t / min(8.0 * period, t[-1] / 2.0), 1.0)
    return 1.0 - 4.0 * np.abs(np.mod(turn + 0.25, 1.0) - 0.5)


def _sweep(size: float) -> Callable[[Array, float], Array]:
    def course(t: Array, period: float) -> Array:
        low, high = max(2.0 / t[-1], 0.1 / period), 10.0 / period
        rate = np.log(high / low) / t[-1]
        return np.asarray(size * np.sin(2.0 * np.pi * low * np.expm1(rate * t) / rate))

    return course


def _steps(t: Array, period: float) -> Array:
    hold = min(3.0 * period, t[-1] / len(PATTERN))
    return PATTERN[np.mod(t // hold, len(PATTERN)).astype(int)]


SHAPES = (
    Shape("slow", "to and fro over its whole range, slowly", _triangle),
    Shape("sweep", "a sine sweep over its whole range, from slow to fast", _sweep(1.0)),
    Shape("small", "a sine sweep over a tenth of its range, from slow to fast", _sweep(0.1)),
    Shape("steps", "steps to other levels, each held", _steps),
)


@dataclass(frozen=True)
class OwnExperiment(NextExperiment):
    """A course of the inputs with how far it drives the rivals apart.

    Attributes
    ----------
    time, inputs : (N,) s, (N, U) in the log's own units
    names : of the log's columns, with their units
    """

    time: Array
    inputs: Array
    names: tuple[str, ...]
    kind: ClassVar[str] = "courses of the inputs"

    def write(self, folder: Path) -> list[Path]:
        """The course as a table."""
        with new_file(folder / FILE) as part:
            table = np.column_stack([self.time, self.inputs])
            np.savetxt(part, table, "%.9g", ",", header=",".join(("time_s", *self.names)), comments="")
        return [folder / FILE]

    def to_json(self) -> dict[str, Any]:
        """Without the course, which has a file of its own."""
        text = f"{self.aim}; {FILE} holds it"
        return {"text": text, "file": FILE, "name": self.name, "description": self.description,
                "separation": self.separation, "separation_now": self.separation_now,
                "splits": list(self.splits)}  # fmt: skip


def design_own(problem: Problem, best: Fit, rival: Fit) -> OwnExperiment | None:
    """The course that separates two fitted structures most; None where no input is marked ``drive``."""
    model, log = problem.model, problem.records[-1]
    if not isinstance(model, OwnRig) or not isinstance(log, OwnRecord):
        return None
    if not any(spec.drive for spec in model.description.inputs.values()):
        return None
    tried = [(separation(problem, best, rival, record), name, says, record)
             for name, says, record in courses(model, log)]  # fmt: skip
    found, name, says, record = max(tried, key=lambda one: one[0])
    specs = [(k, s) for k, s in enumerate(model.description.inputs.values()) if not s.rate_of]
    inputs = np.column_stack([(record.inputs[:, k] - s.shift) / s.scale for k, s in specs])
    names = tuple(f"{s.field} ({s.unit})" for _, s in specs)
    now = separation(problem, best, rival, log)
    return OwnExperiment(name, says, found, now, record.time, inputs, names, chosen_from=len(tried))


def courses(model: OwnRig, log: OwnRecord) -> Iterator[tuple[str, str, OwnRecord]]:
    """Name, sentence and record of each course, as long as the log."""
    specs = list(model.description.inputs.values())
    middle = 0.5 * (log.inputs.min(axis=0) + log.inputs.max(axis=0))
    still = np.tile(middle, (len(log.inputs), 1))
    for j, spec in enumerate(specs):
        if spec.rate_of:
            still[:, j] = 0.0
    for k, spec in enumerate(specs):
        for shape in SHAPES if spec.drive and not spec.rate_of else ():
            inputs = still.copy()
            inputs[:, k] = driven(log.inputs[:, k], log.period, log.pace.period, shape, spec.hold)
            for j, other in enumerate(specs):
                if other.rate_of == spec.name:
                    inputs[:, j] = np.gradient(inputs[:, k], log.period)
            rest = np.tile(np.mean(log.measured, axis=0), (len(inputs), 1))
            yield (f"{spec.name}-{shape.name}", f"Drive {spec.name.replace('_', ' ')} with {shape.says}.",
                   replace(log, inputs=inputs, measured=rest, weight=np.ones_like(rest), since=0.0))  # fmt: skip


def driven(own: Array, period: float, slowest: float, shape: Shape, held: bool) -> Array:
    """A course (N,) of an input that stays inside what the log ``own`` (N,) had of range and rate."""
    low, high = float(own.min()), float(own.max())
    t = np.asarray(np.arange(len(own)) * period, dtype=float)
    wanted = shape.of(t, slowest) * np.minimum(1.0, t / (BEGIN * t[-1]))
    course = 0.5 * (low + high) + 0.5 * (high - low) * wanted
    if held:
        return course
    most = max(float(np.quantile(np.abs(np.diff(own)), FASTEST)), 1e-12 * (high - low))
    out, last = np.zeros(len(course)), float(course[0])
    for i, value in enumerate(course):
        last = out[i] = last + min(max(float(value) - last, -most), most)
    return out
