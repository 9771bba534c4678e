# SPDX-License-Identifier: Apache-2.0
"""A resonance looks alike wherever it comes from: the name of the bellows is held against body and ground."""

from __future__ import annotations

import math

import numpy as np
import pytest
from helpers.own_logs import drawn, log

from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import fit
from pneumo_ros.diagnosis.judge.closable import Closable, closable
from pneumo_ros.diagnosis.judge.held_out import total_floor
from pneumo_ros.diagnosis.judge.verdict import Calibration, HeldOutGaps, credit
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.rig import load_rig

BELLOWS = ("bellows_mode", "both")
FREQUENCY = 5.9  # Hz, of all three


@pytest.fixture(scope="module")
def model() -> RigModel:
    return RigModel(load_rig())


def called_the_bellows(model: RigModel, truth: Active) -> Closable:
    """What is closable beside and instead of a resonance of the bellows, fitted to a rig that has ``truth``."""
    nuisance = drawn(model, 8)
    records = [log(model, seed, nuisance, (truth,)) for seed in (1, 2)]
    problem = Problem(model, (records[0],))
    candidate = Candidate((BELLOWS,))
    start = problem.start(candidate, np.zeros(problem.fixed), [0.15, FREQUENCY, 0.08, 0.5])
    best = fit(problem, candidate, start, rows=np.ones(len(problem.measured), dtype=bool), iterations=20)
    return closable(problem, best, records[1], total_floor(records[1]), [])


def likely(found: Closable) -> float:
    (one,) = found.effects
    return credit(one, HeldOutGaps(10.0, max(1.0, math.sqrt(found.own))), Calibration())


@pytest.mark.slow
@pytest.mark.parametrize(
    "truth, place",
    [
        (Active("anything.body", "", (5.5, FREQUENCY, 0.05, 0.4, 0.0, 5.5)), "body_heave"),
        (Active("anything.ground", "", (0.03, FREQUENCY, 0.08, 1500.0)), "road_input"),
    ],
    ids=["body", "ground"],
)
def test_what_rings_elsewhere_takes_the_name(model: RigModel, truth: Active, place: str) -> None:
    found = called_the_bellows(model, truth)
    assert found.remainders[0].places == (place,)
    assert found.effects[0].instead < 0.5 and found.effects[0].beside < 0.2
    assert likely(found) < 0.05
    rest = found.remainders[0]
    assert rest.fit.candidate.parts == rest.parts  # in its place, not beside it


@pytest.mark.slow
def test_a_resonance_of_the_bellows_keeps_its_name(model: RigModel) -> None:
    found = called_the_bellows(model, Active("bellows_mode", "both", (0.4, FREQUENCY, 0.08, 0.5)))
    assert likely(found) > 0.9
