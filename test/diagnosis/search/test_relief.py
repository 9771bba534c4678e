# SPDX-License-Identifier: Apache-2.0
"""A load that tolerances answer for leaves nothing to be seen by; they come back once it is in the structure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.own_logs import driven
from helpers.rig_logs import excitation, signals_of

from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.solver import fit
from pneumo_ros.diagnosis.search import growth
from pneumo_ros.diagnosis.search.selection import SAME, Scored, Thresholds, relieved, score, select
from pneumo_ros.diagnosis.search.state import Effort, Search
from pneumo_ros.diagnosis.traits import ChangesNumbers
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig

MODEL = RigModel(load_rig())
LIMITS = Thresholds()
SLOW = Active("valve_lag", "rear", (0.036, 0.8))
LOAD = 1.5  # kg, six standard deviations of the mass of the body, which is 50.3 kg


def search_of(*active: Active) -> tuple[Search, Scored]:
    """What a search knows of a rig once it has found the slow valve, and that structure."""
    road, commands = excitation(8.0, 4)
    clean = MODEL.simulate(driven(road, commands), None, trim(MODEL.rig).state, active)
    problem = Problem(MODEL, (signals_of(clean, road, commands, 4, "loaded"),))
    refit = fit(problem, Candidate(), problem.start(Candidate(), None, ()), iterations=20)
    known = Candidate(((SLOW.effect, SLOW.site),))
    found = fit(problem, known, problem.start(known, refit.x, SLOW.values), iterations=20)
    search = Search(problem, problem, refit, Effort(), lambda share, what: None, structures=[found])
    return search, score(problem, found)


def test_a_load_that_tolerances_answer_for_is_found() -> None:
    search, before = search_of(SLOW, Active("payload", "", (LOAD,)))
    asked: set[frozenset[Part]] = set()
    assert growth._relief(search, before, LIMITS, asked)
    assert not growth._relief(search, before, LIMITS, asked)  # the same again would find the same
    problem = search.problem
    chosen = select(score(problem, search.refit), [score(problem, one) for one in search.finalists], LIMITS)
    assert {law for law, _ in chosen.fit.candidate.laws} == {"valve_lag", "payload"}
    assert chosen.level == pytest.approx(before.level, rel=SAME)  # or it would be found by what it leaves
    values = problem.values(chosen.fit.candidate, chosen.fit.x)
    parameters = problem.effect_parameters(chosen.fit.candidate)
    assert values[[p.name for p in parameters].index("payload")] == pytest.approx(LOAD, rel=0.4)


def test_a_load_that_stood_in_for_a_shift_goes_once_the_shift_is_there() -> None:
    search, _ = search_of(SLOW, Active("cg_shift", "", (0.006,)))
    problem = search.problem
    wrong = Candidate(((SLOW.effect, SLOW.site), ("payload", "")))
    stood_in = fit(problem, wrong, problem.start(wrong, search.refit.x, (*SLOW.values, 0.5)), iterations=20)
    search.structures = [stood_in]
    before = score(problem, stood_in)
    assert before.stretch > LIMITS.relief
    assert growth._relief(search, before, LIMITS, set())
    chosen = select(score(problem, search.refit), [score(problem, one) for one in search.finalists], LIMITS)
    assert {law for law, _ in chosen.fit.candidate.laws} == {"valve_lag", "cg_shift"}


@pytest.mark.parametrize("relief", [LIMITS.relief, np.inf], ids=["asked", "not asked"])
def test_growth_asks_what_tolerances_answer_for(relief: float) -> None:
    search, _ = search_of(SLOW, Active("payload", "", (LOAD,)))
    limits = replace(LIMITS, relief=relief)
    growth.grow(search, limits)
    assert ("payload", "") in growth._selected(search, limits).fit.candidate.laws or relief > LIMITS.relief
    assert growth._selected(search, limits).size == 1 + (relief == LIMITS.relief)


def test_where_nothing_is_hidden_tolerances_tell_nothing() -> None:
    search, before = search_of(SLOW)
    assert not growth._relief(search, before, LIMITS, set())
    assert growth._selected(search, LIMITS).size == 1


def test_relief_is_weighed_against_what_it_costs() -> None:
    _, before = search_of(SLOW)
    poorer = replace(before, stretch=30.0)
    cheaper = replace(before.fit, cost=before.fit.cost - 12.0)
    assert relieved(poorer, replace(poorer, fit=cheaper, stretch=18.0, unknowns=before.unknowns + 1.0), LIMITS)
    assert not relieved(poorer, replace(poorer, fit=cheaper, stretch=22.0), LIMITS)  # the gain is another's
    assert not relieved(poorer, replace(poorer, stretch=18.0), LIMITS)  # what it relieves it costs elsewhere
    many = replace(poorer, fit=cheaper, stretch=18.0, unknowns=before.unknowns + 3.0)
    assert not relieved(poorer, many, LIMITS)
    worse = replace(poorer, fit=cheaper, stretch=18.0, level=before.level * (1.0 + 2.0 * SAME))
    assert not relieved(poorer, worse, LIMITS)


def test_effects_that_change_numbers_are_those_of_the_body_and_of_a_volume() -> None:
    numbers = {e.id for e in MODEL.effects.values() if isinstance(e, ChangesNumbers) and e.changes_numbers}
    assert numbers == {"payload", "cg_shift", "dead_volume"}
