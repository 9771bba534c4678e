# SPDX-License-Identifier: Apache-2.0
"""The next experiment: what it plays can be played, and one that would tell nothing is not offered."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from helpers.own_logs import QUICK, drawn, log

from pneumo_ros.diagnosis.diagnose import Options, _next_experiment, diagnose
from pneumo_ros.diagnosis.experiment import SEPARATES
from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit
from pneumo_ros.diagnosis.half_car.experiment import DURATION, PERIOD, PROFILES, Experiment, design_experiment
from pneumo_ros.diagnosis.half_car.signals import Signals
from pneumo_ros.diagnosis.report.steps import next_steps
from pneumo_ros.diagnosis.search.competition import compete
from pneumo_ros.diagnosis.search.growth import grow
from pneumo_ros.diagnosis.search.state import Search
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.rig import load_rig

KEPT = ("leak", "orifice_coefficient", "valve_lag")


@pytest.fixture(scope="module")
def model() -> RigModel:
    whole = RigModel(load_rig())
    return RigModel(load_rig(), whole.library, frozenset(whole.library) - set(KEPT))


def fitted(problem: Problem, effect: str, *values: float) -> Fit:
    candidate = Candidate(((effect, "front"),))
    return fit(problem, candidate, problem.start(candidate, None, values), iterations=4)


def test_some_profiles_move_the_outlets_and_all_of_them_can_be_played() -> None:
    t = np.arange(round(DURATION / PERIOD)) * PERIOD
    shapes = {profile.name: profile.valves(t) for profile in PROFILES}
    assert all(valves.shape == (len(t), 4) and valves.min() >= 0.0 for valves in shapes.values())
    outlets = {name: set(np.unique(valves[:, 2:]).tolist()) for name, valves in shapes.items()}
    assert outlets["valves-closed"] == {0.0, 1.0} and outlets["valves-half"] == {0.5, 1.0}
    assert outlets["outlet-pulses"] == {0.0, 1.0}
    assert all(profile.road(t).shape == (len(t), 2) for profile in PROFILES)


def test_a_leak_and_an_orifice_are_driven_apart_with_the_valves_closed(model: RigModel) -> None:
    """A leak flows through closed valves as well: no profile with open outlets shows that."""
    problem = Problem(model, (log(model, 1, drawn(model, 4, 0.5), (Active("leak", "front", (4e-7, 0.6)),)),))
    leak, orifice = fitted(problem, "leak", 4e-7, 0.6), fitted(problem, "orifice_coefficient", 0.2, 0.0, 1.0)
    found = design_experiment(problem, leak, orifice)
    assert found is not None and found.tells and found.chosen_from == len(PROFILES)
    assert not np.array_equal(found.valves[:, 2], np.full(len(found.valves), found.valves[0, 2])), found.name


RIVALS = Options(pairs=False, effort=replace(QUICK, finalists=4))


@pytest.fixture(scope="module")
def searched(model: RigModel) -> tuple[Search, list[Signals]]:
    """What is found in the first of two logs; no search asks what experiment will be offered."""
    effect = (Active("leak", "front", (4e-7, 0.6)),)
    logs = [log(model, seed, drawn(model, 4, 0.5), effect) for seed in (1, 2)]
    search = compete(Problem(model, (logs[0],)), RIVALS.effort, RIVALS.pairs, lambda share, what: None)
    grow(search, RIVALS.limits, RIVALS.pairs)
    return search, logs


@pytest.mark.parametrize("separation", [0.02, 1.99, 2.0])
def test_what_would_tell_nothing_is_not_offered(
    searched: tuple[Search, list[Signals]], separation: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rivals are given; the log's own would take minutes."""
    search, (first, second) = searched
    monkeypatch.setattr("pneumo_ros.diagnosis.diagnose.compete", lambda *_: search)
    monkeypatch.setattr("pneumo_ros.diagnosis.diagnose.grow", lambda *_: None)
    monkeypatch.setattr("pneumo_ros.diagnosis.diagnose.ambiguity_group", lambda *_: ("leak", "orifice_coefficient"))
    nothing, time = np.zeros((2, 4)), np.array([0.0, 0.1])
    fake = Experiment("flat", "a flat road", separation, 0.0, time, nothing[:, :2], nothing, chosen_from=10)
    found = diagnose(search.problem.model, [first], second, replace(RIVALS, experiment=lambda *_: fake))
    notes = [note for note in found.notes if "no experiment is offered" in note]
    assert (found.experiment is not None) == (separation >= SEPARATES) == (not notes)
    assert all("of 10 road and valve profiles" in note and "by hand" in note for note in notes)


@pytest.mark.parametrize("second_tells", [True, False])
def test_where_the_strongest_rival_cannot_be_split_off_the_next_one_is(second_tells: bool) -> None:
    """Of three that a log does not tell apart one may be told; what is refused is refused for the strongest."""
    nothing, time, asked = np.zeros((2, 4)), np.array([0.0, 0.1]), []

    def finalist(effect: str, level: float) -> Any:
        return SimpleNamespace(level=level, fit=SimpleNamespace(candidate=Candidate(((effect, "front"),))))

    def design(problem: Any, best: Any, rival: Any) -> Experiment:
        asked.append(rival.candidate.parts[0][0])
        separation = 7.0 if second_tells and len(asked) == 2 else 0.1 * len(asked)
        return Experiment(f"number {len(asked)}", "sweep", separation, 0.0, time, nothing[:, :2], nothing)

    finalists = [finalist("valve_lag", 3.0), finalist("leak", 1.0), finalist("orifice_coefficient", 2.0)]
    outcome: Any = SimpleNamespace(
        finalists=[*finalists, finalist("orifice_coefficient", 2.5)], problem=None, best=None
    )
    found = _next_experiment(outcome, cast("Any", SimpleNamespace(verdict="leak")), KEPT, design)
    assert asked == ["orifice_coefficient", "valve_lag"] and found is not None
    if not second_tells:
        assert (
            found.splits == ("leak", "orifice_coefficient") and "would drive the rivals 0.1 standard" in found.refusal
        )
        return
    assert found.splits == ("leak", "valve_lag")
    step = next_steps({"verdict": "leak", "probability": 0.5, "next_experiment": found.to_json()})[0]
    assert step.text.startswith("Split leak from valve lag: sweep."), step.text
