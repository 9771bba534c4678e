# SPDX-License-Identifier: Apache-2.0
"""A part that is slow one way, or has a limit: its law ends far away; its shape is fitted from where it does it all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pytest
from helpers.own_logs import driven
from helpers.rig_logs import excitation, signals_of

from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit
from pneumo_ros.diagnosis.search.growth import _begun_anew
from pneumo_ros.diagnosis.search.parts import begun, with_shapes
from pneumo_ros.diagnosis.search.state import Effort, Search
from pneumo_ros.effects.contract import Effect
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig

SECONDS = 6.0


UNEVEN = {"rising lag": 0.07, "falling lag": 0.012, "slew": 1e9}  # s, s, none
LIMITED = {"rising lag": 0.002, "falling lag": 0.002, "slew": 0.03}  # s, s, m/s


@pytest.mark.parametrize(
    ("family", "site", "law"),
    [("valve_lag", "front", UNEVEN), ("exciter_lag", "both", UNEVEN), ("exciter_lag", "rear", LIMITED)],
)
def test_a_slow_part_is_found_by_its_shape(family: str, site: str, law: Mapping[str, float]) -> None:
    """The shape that starts at nothing beside the law ends with more than the one that begins alone, whether it is
    added to the law or came with it.
    """
    model = RigModel(load_rig())
    name = f"{family}.shape"
    shape = model.library[name]
    truth = tuple(min({"follower": 1.0, **law}.get(p.name, 0.0), p.high) for p in shape.parameters)
    road, commands = excitation(SECONDS, 4)
    clean = model.simulate(driven(road, commands), None, trim(model.rig).state, (Active(name, site, truth),))
    record = signals_of(clean, road, commands, 4, "steps")

    def left(problem: Problem) -> float:
        one = Candidate(((family, site),))
        typical = [p.typical for p in problem.effect_parameters(one)]
        return with_shapes(problem, fit(problem, one, problem.start(one, None, typical), iterations=10), 10).cost

    without = RigModel(load_rig(), library={**model.library, name: replace(shape, begins=())})
    problem = Problem(model, (record,))
    assert left(Problem(without, (record,))) - left(problem) > 400.0  # 501, 1378 and 1043
    both = Candidate(((family, site), (name, site)))
    at_nothing = [0.0 if p.size else p.typical for p in problem.effect_parameters(both)]
    came = fit(problem, both, problem.start(both, None, at_nothing), iterations=10)
    assert came.cost - begun(problem, came, (family, site), 10).cost > 400.0


def test_a_slow_part_is_begun_anew_beside_what_has_come_since() -> None:
    model = RigModel(load_rig())
    shape = model.library["exciter_lag.shape"]
    truth = tuple(min({"follower": 1.0, **LIMITED}.get(p.name, 0.0), p.high) for p in shape.parameters)
    road, commands = excitation(SECONDS, 4)
    acting = (Active("exciter_lag.shape", "rear", truth), Active("coulomb_friction", "front", (8.0, 3e-4, 0.0)))
    clean = model.simulate(driven(road, commands), None, trim(model.rig).state, acting)
    problem = Problem(model, (signals_of(clean, road, commands, 4, "steps"),))
    nominal = Candidate()
    search = Search(
        problem, problem, fit(problem, nominal, problem.start(nominal, None, ())), Effort(), lambda *_: None
    )
    grown = Candidate((("exciter_lag", "rear"), ("exciter_lag.shape", "rear"), ("coulomb_friction", "front")))
    at_nothing = [0.0 if p.size else p.typical for p in problem.effect_parameters(grown)]
    found = fit(problem, grown, problem.start(grown, None, at_nothing), iterations=10)
    anew = _begun_anew(search, found)
    assert search.structures == [anew] and found.cost - anew.cost > 400.0
    slew = [p.name for p in problem.effect_parameters(grown)].index("slew")
    assert problem.values(grown, anew.x)[slew] == pytest.approx(LIMITED["slew"], rel=0.1)


@pytest.mark.parametrize("area", [6e-8, 3e-7])
def test_a_leak_through_a_fitting_is_begun_as_large_as_the_hole_that_stands_for_it(area: float) -> None:
    """Its outlet's tolerance and the law's two numbers make a long valley of which few steps see the end."""
    model = RigModel(load_rig())
    shape = model.library["leak.shape"]
    truth = tuple({"leak over gauge pressure": area}.get(p.name, 0.0) for p in shape.parameters)
    road, commands = excitation(SECONDS, 4)
    clean = model.simulate(driven(road, commands), None, trim(model.rig).state, (Active("leak.shape", "front", truth),))
    record = signals_of(clean, road, commands, 4, "steps")
    law = Candidate((("leak", "front"),))

    def left(shape: Effect) -> Fit:
        problem = Problem(RigModel(load_rig(), library={**model.library, "leak.shape": shape}), (record,))
        typical = [p.typical for p in problem.effect_parameters(law)]
        found = fit(problem, law, problem.start(law, None, typical), iterations=10)
        return with_shapes(problem, found)

    begun_alone = left(shape)
    assert Problem(model, (record,)).values(begun_alone.candidate, begun_alone.x)[-1] == pytest.approx(area, rel=0.12)
    assert begun_alone.cost < left(replace(shape, begins=())).cost - 25.0  # 288 and 33
