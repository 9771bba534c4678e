# SPDX-License-Identifier: Apache-2.0
"""Multiple shooting on a plant whose free run leaves the log behind: an unstable one, held by the logged input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest
from helpers.driven_log import NOISE, PERIOD, DrivenLog

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.shooting import fit_from_windows, free_run_failed
from pneumo_ros.diagnosis.fit.solver import fit
from pneumo_ros.diagnosis.model import EffectLike
from pneumo_ros.diagnosis.search.competition import compete
from pneumo_ros.diagnosis.search.state import Effort
from pneumo_ros.effects.parameters import Active, Parameter
from pneumo_ros.errors import InputError

TRUE_GROWTH = 1.5


@dataclass(frozen=True)
class Plant:
    """x' = growth x + u."""

    channels: tuple[str, ...] = ("x",)
    parameters: tuple[Parameter, ...] = (Parameter("growth", "1/s", 1.0, 0.3),)
    effects: Mapping[str, EffectLike] = field(default_factory=dict)

    def initial(self, record: DrivenLog, active: Sequence[Active] = ()) -> tuple[Array, Array]:
        return record.measured[:25].mean(axis=0), np.array([NOISE])

    def predict(
        self, record: DrivenLog, nuisance: Array, initial: Array, active: Sequence[Active], rows: int | None = None
    ) -> Array:
        count = len(record.measured) if rows is None else rows
        grown = np.exp(nuisance[0] * PERIOD)
        out = np.empty((count, 1))
        out[0] = initial
        for i in range(count - 1):
            out[i + 1] = grown * out[i] + (grown - 1.0) / nuisance[0] * record.drive[i]
        return out

    def places(self, active: Active) -> tuple[str, ...]:
        return ()

    def side(self, active: Active) -> str | None:
        return None


def record(seconds: float) -> DrivenLog:
    """The plant held near zero by feedback from its true state, disturbed by a slow wave."""
    rng = np.random.default_rng(1)
    count = round(seconds / PERIOD)
    x, pushed = np.zeros(count), np.zeros(count)
    grown = np.exp(TRUE_GROWTH * PERIOD)
    for i in range(count):
        pushed[i] = -4.0 * x[i] + np.sin(2.0 * np.pi * 0.7 * i * PERIOD)
        if i + 1 < count:
            x[i + 1] = grown * x[i] + (grown - 1.0) / TRUE_GROWTH * pushed[i]
    return DrivenLog((x + NOISE * rng.normal(size=count))[:, None], pushed)


def test_windows_find_what_the_free_run_cannot() -> None:
    problem = Problem(Plant(), (record(6.0),))
    start = problem.start(Candidate(), None, ())
    lost = fit(problem, Candidate(), start, iterations=15)
    assert free_run_failed(problem, lost)
    found = fit_from_windows(problem, Candidate(), start, 8)
    assert found is not None and problem.gap(found.residual) < 0.02 < 1.0 < problem.gap(lost.residual)
    assert problem.nuisance(found.x)[0] == pytest.approx(TRUE_GROWTH, abs=0.06)


@pytest.mark.filterwarnings("ignore:overflow")
def test_the_competition_says_so_when_nothing_holds_the_model() -> None:
    wild = Plant(parameters=(Parameter("growth", "1/s", 400.0, 1.0),))
    with pytest.raises(InputError, match="runs away"):
        compete(Problem(wild, (record(6.0),)), Effort(), False, lambda share, what: None)
