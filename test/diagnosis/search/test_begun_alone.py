# SPDX-License-Identifier: Apache-2.0
"""A slow part that is slow one way: its law ends far away, and its shape is fitted from where it does all of it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers.own_logs import driven
from helpers.rig_logs import excitation, signals_of

from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import fit
from pneumo_ros.diagnosis.search.parts import with_shapes
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig

SECONDS = 6.0


@pytest.mark.parametrize(("family", "site"), [("valve_lag", "front"), ("exciter_lag", "both")])
def test_a_part_that_is_slow_one_way_is_found_by_its_shape(family: str, site: str) -> None:
    """The shape that starts at nothing beside the law ends with more than the one that begins alone."""
    model = RigModel(load_rig())
    name = f"{family}.shape"
    shape = model.library[name]
    uneven = {"follower": 1.0, "slew": 1e9, "rising lag": 0.07, "falling lag": 0.012}
    truth = tuple(min(uneven.get(p.name, 0.0), p.high) for p in shape.parameters)
    road, commands = excitation(SECONDS, 4)
    clean = model.simulate(driven(road, commands), None, trim(model.rig).state, (Active(name, site, truth),))
    record = signals_of(clean, road, commands, 4, "steps")

    def left(problem: Problem) -> float:
        law = Candidate(((family, site),))
        typical = [p.typical for p in problem.effect_parameters(law)]
        return with_shapes(problem, fit(problem, law, problem.start(law, None, typical), iterations=10), 10).cost

    without = RigModel(load_rig(), library={**model.library, name: replace(shape, begins=())})
    assert left(Problem(model, (record,))) < 0.35 * left(Problem(without, (record,)))  # 0.19 and 0.28
