# SPDX-License-Identifier: Apache-2.0
"""A rig whose two ends are less alike than its rig file says is told so, and one with an effect is not."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.own_logs import driven
from helpers.rig_logs import excitation, signals_of

from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import fit
from pneumo_ros.diagnosis.judge.stated_otherwise import stated_otherwise
from pneumo_ros.diagnosis.search.selection import Scored, score
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig, parse_rig

UNLIKE = {"effective_area_scale_split": 0.012, "discharge_coefficient_split": -0.05}
LEAK = Active("leak", "front", (1.5e-7, 0.6))


def fitted(
    model: RigModel, splits: dict[str, float], active: tuple[Active, ...], part: str
) -> tuple[Problem, Scored, Scored]:
    """The refit and a structure of one effect at the front, of a log whose ends differ by ``splits``."""
    road, commands = excitation(8.0, 3)
    values = np.array([splits.get(p.name, p.nominal) for p in model.parameters])
    clean = model.simulate(driven(road, commands), values, trim(model.rig).state, active)
    problem = Problem(model, (signals_of(clean, road, commands, 3, "steps"),))
    nominal, one = Candidate(), Candidate(((part, "front"),))
    refit = fit(problem, nominal, problem.start(nominal, None, ()), iterations=20)
    typical = [p.typical for p in problem.effect_parameters(one)]
    chosen = fit(problem, one, problem.start(one, refit.x[: problem.fixed], typical), iterations=20)
    return problem, score(problem, refit), score(problem, chosen)


def test_ends_that_are_not_alike_are_told() -> None:
    (told,) = stated_otherwise(*fitted(RigModel(load_rig()), UNLIKE, (), "orifice_coefficient"))
    assert told.endswith("state end_difference: {value: 1, unit: '1'} in the rig file")
    assert "discharge_coefficient_split -0.0" in told and "effective_area_scale_split 0.012" in told


@pytest.mark.parametrize("active", [(LEAK,), ()], ids=["a leak", "nothing"])
def test_what_an_effect_makes_is_not_put_down_to_the_ends(active: tuple[Active, ...]) -> None:
    assert stated_otherwise(*fitted(RigModel(load_rig()), {}, active, "leak")) == []


def test_a_rig_file_that_says_so_already_is_not_told_again() -> None:
    apart = RigModel(parse_rig("rig: {end_difference: {value: 1}}\n"))
    assert stated_otherwise(*fitted(apart, UNLIKE, (), "orifice_coefficient")) == []
