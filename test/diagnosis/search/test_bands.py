# SPDX-License-Identifier: Apache-2.0
"""A spool that sticks and jumps: its band is found though no gradient leads to it."""

from __future__ import annotations

import pytest
from helpers.own_logs import driven
from helpers.rig_logs import excitation, signals_of

from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit, refreshed
from pneumo_ros.diagnosis.search.bands import RATIO, sharpened_bands, with_bands
from pneumo_ros.diagnosis.search.competition import compete
from pneumo_ros.diagnosis.search.state import Effort
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig

MODEL = RigModel(load_rig())
SHAPE: Part = ("valve_deadband.shape", "front")
NAMES = [p.name for p in MODEL.library[SHAPE[0]].parameters]
BAND = 5.4e-8  # m2, between the bands that the library's screening tries by itself
STUCK = Active(*SHAPE, tuple({"sticking": 1.0, "band": BAND}.get(name, 0.0) for name in NAMES))
SLOW = Active("valve_lag", "rear", (0.036, 0.8))


def problem_of(*active: Active) -> Problem:
    road, commands = excitation(8.0, 4)
    clean = MODEL.simulate(driven(road, commands), None, trim(MODEL.rig).state, active)
    return Problem(MODEL, (signals_of(clean, road, commands, 4, "sticks"),))


def fitted(problem: Problem, candidate: Candidate, *values: float) -> Fit:
    return fit(problem, candidate, problem.start(candidate, None, values), iterations=20)


def band_of(values: tuple[float, ...]) -> float:
    return values[NAMES.index("band")]


@pytest.mark.parametrize("beside", [(), (SLOW,)])
def test_the_band_is_found_beside_what_is_known(beside: tuple[Active, ...]) -> None:
    problem = problem_of(STUCK, *beside)
    known = Candidate(tuple((one.effect, one.site) for one in beside))
    base = fitted(problem, known, *(value for one in beside for value in one.values))
    found = with_bands(problem, refreshed(problem, base)).scanned
    assert band_of(found[SHAPE]) == pytest.approx(BAND, rel=RATIO - 1.0)


@pytest.mark.parametrize("site", ["front", "both"])
def test_both_ends_are_scanned_together_where_each_may_stick(site: str) -> None:
    problem = problem_of(Active(SHAPE[0], site, STUCK.values))
    found = with_bands(problem, refreshed(problem, fitted(problem, Candidate()))).scanned
    assert ((SHAPE[0], "both") in found) == (site == "both")
    assert band_of(found[SHAPE[0], site]) == pytest.approx(BAND, rel=RATIO - 1.0)


def test_a_spool_whose_band_nobody_tries_is_named() -> None:
    search = compete(problem_of(STUCK), Effort(singles=4, finalists=2), False, lambda share, what: None)
    best = search.best
    assert best.candidate.laws == (("valve_deadband", "front"),) and best.cost < 0.3 * search.refit.cost


def test_what_is_there_is_not_looked_for_again() -> None:
    problem = problem_of(STUCK)
    found = fitted(problem, Candidate((("valve_deadband", "both"),)), 3e-8, 2e-8)
    assert with_bands(problem, refreshed(problem, found)) is problem


def test_a_band_is_sharpened_where_no_step_leads() -> None:
    problem = problem_of(STUCK)
    law = fitted(problem, Candidate((("valve_deadband", SHAPE[1]),)), 0.0, 0.0)
    values = [1.0 if name == "sticking" else 0.95 * BAND if name == "band" else 0.0 for name in NAMES]
    both = Candidate((*law.candidate.parts, SHAPE))
    start = fit(problem, both, problem.start(both, law.x[: problem.fixed], (0.0, 0.0, *values)), iterations=3)
    assert problem.values(both, start.x)[-1] != pytest.approx(BAND, rel=0.015)  # or there would be nothing to show
    found = sharpened_bands(problem, start, 10)
    assert found.cost < start.cost - 500.0
    assert problem.values(both, found.x)[-1] == pytest.approx(BAND, rel=0.01)
