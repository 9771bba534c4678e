# SPDX-License-Identifier: Apache-2.0
"""An experiment that would split two rivals, of any rig: what it must tell, and how far it drives them apart.

Each rival keeps what its own fit of the log gave it, so that on the log they agree; on a candidate profile they are
simulated, the nuisance parameters answer linearly (a difference that a tolerance could explain separates nothing), and
what remains is compared with the sensors' noise.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Final

import numpy as np

from pneumo_ros.diagnosis.fit.averaging import average
from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.diagnosis.record import Record

SEPARATES: Final = 2.0  # noise standard deviations, rms, from which an experiment tells two structures apart [taste]
STEP: Final = 0.5  # prior sigmas by which a nuisance parameter is moved to see its answer [numerics]


@dataclass(frozen=True)
class NextExperiment(ABC):
    """A profile that was chosen among others.

    Attributes
    ----------
    separation, separation_now : rms difference of the rivals' outputs over the noise, nuisance parameters answered: on
        the profile, and on the log that was given
    chosen_from : profiles that were tried
    splits : ids of the two that it drives apart, the verdict first
    kind : of profiles, for people
    """

    name: str
    description: str
    separation: float
    separation_now: float
    chosen_from: int = field(default=1, kw_only=True)
    splits: tuple[str, ...] = field(default=(), kw_only=True)
    kind: ClassVar[str]

    @property
    def tells(self) -> bool:
        """Whether it is worth playing: below :data:`SEPARATES` it would cost an hour and tell nothing."""
        return self.separation >= SEPARATES

    @property
    def refusal(self) -> str:
        """Why it is not offered, for people."""
        best = (
            f"of {self.chosen_from} {self.kind} the best, {self.name}, would drive the rivals {self.separation:.2g} "
            "standard deviations of the noise"
        )
        return (
            f"no experiment is offered: {best} apart, and {SEPARATES:g} are needed; the check by hand tells them apart"
        )

    @property
    def aim(self) -> str:
        """What it is and what it separates, for people."""
        return f"{self.description} (separates the rivals to {self.separation:.0f} noise standard deviations)"

    @abstractmethod
    def write(self, folder: Path) -> list[Path]:
        """The profile as tables in a folder."""

    @abstractmethod
    def to_json(self) -> dict[str, Any]:
        """Without the profile, which has files of its own."""


def separation(problem: Problem, best: Fit, rival: Fit, record: Record) -> float:
    """Root mean square of the rivals' difference over the noise, free of what nuisance parameters could answer.

    0 where either runs away.
    """
    model = problem.model
    active = problem.active(best.candidate, problem.values(best.candidate, best.x))
    other = problem.active(rival.candidate, problem.values(rival.candidate, rival.x))
    nuisance = problem.nuisance(best.x)

    def outputs(values: Any, effects: Any) -> Any:
        initial = model.initial(record, effects)[0]
        return np.asarray(average(model.predict(record, values, initial, effects), problem.averaged) / record.noise)

    base = outputs(nuisance, active)
    difference = (outputs(problem.nuisance(rival.x), other) - base).ravel()
    columns = []
    for m, p in enumerate(model.parameters):
        moved = nuisance.copy()
        moved[m] += STEP * p.std
        columns.append((outputs(moved, active) - base).ravel() / STEP)
    J = np.array(columns).T if columns else np.zeros((len(difference), 0))
    if not (np.all(np.isfinite(J)) and np.all(np.isfinite(difference))):
        return 0.0
    answer = np.linalg.solve(J.T @ J + np.eye(J.shape[1]), J.T @ difference)
    return float(np.sqrt(np.mean((difference - J @ answer) ** 2)))
