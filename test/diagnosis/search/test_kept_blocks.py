# SPDX-License-Identifier: Apache-2.0
"""A stop that is hit once: whichever blocks the hit lies in, it is fitted, and it is accepted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest
from helpers.driven_log import NOISE, PERIOD, DrivenLog

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.pace import HALF_CAR
from pneumo_ros.diagnosis.fit.problem import SELECT_EVERY, Problem
from pneumo_ros.diagnosis.model import EffectLike, PlainEffect
from pneumo_ros.diagnosis.search.competition import compete
from pneumo_ros.diagnosis.search.selection import Thresholds, score, select
from pneumo_ros.diagnosis.search.state import Effort
from pneumo_ros.effects.parameters import Active, EffectParameter, Parameter

RATE, STOP, BELOW = 8.0, 30.0, 1.5
SECONDS = 7.5  # six blocks


EFFECTS = {
    "stop": PlainEffect("stop", ("",), (EffectParameter("stiffness", "1/s", 0.0, 200.0, 10.0, size=True),)),
    "drift": PlainEffect("drift", ("",), (EffectParameter("rate", "1/s", -1.0, 1.0, 0.01, size=True),)),
}


@dataclass(frozen=True)
class Lag:
    """x' = rate (u - x), with a stop above BELOW and a drift as effects."""

    channels: tuple[str, ...] = ("x",)
    parameters: tuple[Parameter, ...] = (Parameter("rate", "1/s", RATE, 0.1),)
    effects: Mapping[str, EffectLike] = field(default_factory=lambda: EFFECTS)

    def initial(self, record: DrivenLog, active: Sequence[Active] = ()) -> tuple[Array, Array]:
        return record.measured[:25].mean(axis=0), np.array([NOISE])

    def predict(
        self, record: DrivenLog, nuisance: Array, initial: Array, active: Sequence[Active], rows: int | None = None
    ) -> Array:
        sizes = {one.effect: one.values[0] for one in active}
        x, out = float(initial[0]), np.empty((len(record.drive), 1))
        for i, u in enumerate(record.drive):
            out[i] = x
            push = sizes.get("stop", 0.0) * max(0.0, x - BELOW)
            x += PERIOD * (float(nuisance[0]) * (u - x) - push + sizes.get("drift", 0.0))
        return out

    def places(self, active: Active) -> tuple[str, ...]:
        return (active.effect,)

    def side(self, active: Active) -> str | None:
        return None


def record(hit: int) -> DrivenLog:
    """A small wave, and one blow that reaches the stop in block ``hit``."""
    t = PERIOD * np.arange(round(SECONDS / PERIOD))
    drive = np.sin(2.0 * np.pi * 0.9 * t)
    drive[(t > HALF_CAR.block * hit + 0.2) & (t < HALF_CAR.block * hit + 0.5)] += 3.0
    clean = Lag().predict(DrivenLog(t, drive), np.array([RATE]), np.zeros(1), [Active("stop", "", (STOP,))])
    return DrivenLog(clean + NOISE * np.random.default_rng(hit).normal(size=clean.shape), drive)


@pytest.mark.parametrize("hit", [2, 3, 4])
def test_a_stop_that_is_hit_once_is_found(hit: int) -> None:
    problem = Problem(Lag(), (record(hit),))
    search = compete(problem, Effort(), False, lambda share, what: None)
    assert hit % SELECT_EVERY != search.problem.fold  # the fit sees the hit
    refit, *finalists = (score(search.problem, f) for f in (search.refit, *search.finalists))
    chosen = select(refit, finalists, Thresholds())
    assert chosen.fit.candidate.parts == (("stop", ""),)
    assert search.problem.values(chosen.fit.candidate, chosen.fit.x)[0] == pytest.approx(STOP, rel=0.1)
