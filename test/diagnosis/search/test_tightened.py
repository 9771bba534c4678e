# SPDX-License-Identifier: Apache-2.0
"""The search with tight tolerances, on a load that hides in the gains of four signals: what is found is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from helpers.driven_log import DrivenLog

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.judge.closable import closable
from pneumo_ros.diagnosis.model import PlainEffect
from pneumo_ros.diagnosis.search.competition import compete
from pneumo_ros.diagnosis.search.selection import Thresholds, score, select
from pneumo_ros.diagnosis.search.state import Effort, Search
from pneumo_ros.diagnosis.search.tightened import TIGHTNESS, search_tightened
from pneumo_ros.effects.parameters import Active, EffectParameter, Parameter

ROWS, PERIOD, NOISE, STD = 4000, 5e-3, 0.02, 0.1
RNG = np.random.default_rng(5)
TIME = np.arange(ROWS) * PERIOD
CARRIED = [np.sin(2.0 * np.pi * f * TIME + RNG.uniform(0.0, 6.0)) for f in (0.4, 0.9, 1.7, 2.6)]
OTHER = np.sin(2.0 * np.pi * 3.8 * TIME)
SIGNALS = {"load": sum(CARRIED), "decoy": sum(CARRIED[:2]) + 0.2 * OTHER, "other": OTHER}
SIZE = (EffectParameter("size", "1", -5.0, 5.0, 0.3, size=True),)


@dataclass(frozen=True)
class Gains:
    """Output: four signals with a gain each, and the active signals."""

    channels: tuple[str, ...] = ("y",)
    parameters: tuple[Parameter, ...] = tuple(Parameter(f"gain_{k}", "1", 1.0, STD) for k in range(4))
    effects: dict[str, PlainEffect] = field(default_factory=lambda: {k: PlainEffect(k, ("",), SIZE) for k in SIGNALS})

    def initial(self, record: DrivenLog, active: Sequence[Active] = ()) -> tuple[Array, Array]:
        return np.zeros(1), np.full(1, 1e-3)

    def predict(
        self, record: DrivenLog, nuisance: Array, initial: Array, active: Sequence[Active], rows: int | None = None
    ) -> Array:
        out = sum(gain * one for gain, one in zip(nuisance, CARRIED, strict=True)) + initial[0]
        out = out + sum(one.values[0] * SIGNALS[one.effect] for one in active)
        return np.asarray(out[:rows, None])

    def places(self, active: Active) -> tuple[str, ...]:
        return (f"place_{active.effect}",)

    def side(self, active: Active) -> str | None:
        return None


def searched(name: str, size: float) -> Search:
    noise = np.random.default_rng(3).normal(0.0, NOISE, ROWS)
    y = sum(CARRIED) + size * SIGNALS[name] + noise
    problem = Problem(Gains(), (DrivenLog(y[:, None], CARRIED[0], "made", PERIOD, NOISE),))
    return compete(problem, Effort(), True, lambda share, what: None)


@pytest.mark.parametrize("name, strained", [("load", True), ("other", False)])
def test_what_the_first_search_missed_is_found_with_tolerances_held_tightly(name: str, strained: bool) -> None:
    search = searched(name, 0.8)
    for kept in ("singles", "pairs", "structures"):  # as if the effect had never been tried beside such gains
        setattr(search, kept, [one for one in getattr(search, kept) if (name, "") not in one.candidate.laws])
    left = min([search.refit, *search.finalists], key=lambda one: one.cost)
    assert search.problem.strains(left.x) == strained
    search_tightened(search, Thresholds())
    refit, *others = (score(search.problem, one) for one in (search.refit, *search.finalists))
    chosen = select(refit, others, Thresholds())
    assert chosen.fit.candidate.laws == ((name, ""),) and chosen.stretch < 1.0
    (size,) = search.problem.values(chosen.fit.candidate, chosen.fit.x)
    assert abs(size - 0.8) < 0.03
    assert all(one.candidate.laws for one in search.structures)


def test_tolerances_at_rest_need_no_second_search() -> None:
    search = searched("other", 0.5)
    before = list(search.structures)
    search_tightened(search, Thresholds())
    assert search.structures == before


def test_tightness_weighs_the_tolerances_and_nothing_else() -> None:
    problem = searched("other", 0.5).problem
    candidate = Candidate((("other", ""),))
    told, tight = problem.prior(candidate), replace(problem, tightness=TIGHTNESS).prior(candidate)
    assert np.array_equal(tight[:4], TIGHTNESS * told[:4]) and np.array_equal(tight[4:], told[4:])


class Unmoved:
    """Two equations that no effect moves."""

    def left(self, nuisance: np.ndarray, active: Sequence[Active]) -> np.ndarray:
        return np.array([5.0, 5.0])

    def of(self, places: Sequence[str]) -> np.ndarray:
        return np.array([True, False])


@pytest.mark.parametrize("name, asked", [("load", False), ("other", True)])
def test_equations_are_not_asked_for_what_the_tolerances_answer(name: str, asked: bool) -> None:
    search = searched(name, 0.8)
    problem = search.problem
    best = next(one for one in search.finalists if one.candidate.laws == ((name, ""),))
    told = closable(problem, search.refit, best, problem.records[0], 0.02, 0.5, (), Unmoved())
    (evidence,) = told.effects
    assert evidence.missing == ((5.0, 5.0) if asked else None)
