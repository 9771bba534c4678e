# SPDX-License-Identifier: Apache-2.0
"""What was found at one end is tried at both, as its shape has become since."""

from __future__ import annotations

from helpers.own_logs import driven
from helpers.rig_logs import excitation, signals_of

from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit
from pneumo_ros.diagnosis.search.exchange import widened
from pneumo_ros.diagnosis.search.state import Effort, Search
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig

SECONDS = 6.0
AREA = ("effective_area_error.shape", {"area wave even": 0.02, "area waves": 130.0})
FRICTION = ("coulomb_friction", {"friction_force": 8.0, "bristle_length": 3e-4})


def search_of(site: str) -> Search:
    """A rig whose area waves at a site, and that rubs in front; the refit done."""
    model = RigModel(load_rig())

    def acting(what: tuple[str, dict[str, float]], where: str) -> Active:
        name, values = what
        return Active(name, where, tuple(values.get(p.name, 0.0) for p in model.library[name].parameters))

    road, commands = excitation(SECONDS, 4)
    both = (acting(AREA, site), acting(FRICTION, "front"))
    clean = model.simulate(driven(road, commands), None, trim(model.rig).state, both)
    problem = Problem(model, (signals_of(clean, road, commands, 4, "steps"),))
    nominal = Candidate()
    refit = fit(problem, nominal, problem.start(nominal, None, ()))
    return Search(problem, problem, refit, Effort(), lambda *_: None)


def found_at(search: Search, site: str) -> Fit:
    problem = search.problem
    parts: tuple[Part, ...] = (("effective_area_error", site), (AREA[0], site), ("coulomb_friction", "front"))
    candidate = Candidate(parts)
    start = [AREA[1].get(p.name, 0.0 if p.size else p.typical) for p in problem.effect_parameters(candidate)]
    return fit(problem, candidate, problem.start(candidate, None, start), iterations=10)


def test_waves_of_one_end_are_tried_at_both() -> None:
    """The law alone does nothing like them: no screening of laws shows the other end's."""
    search = search_of("both")
    found = found_at(search, "front")
    wide = widened(search, found)
    assert wide is not None
    assert wide.candidate.laws == (("effective_area_error", "both"), ("coulomb_friction", "front"))
    assert set(wide.candidate.shapes) == {(AREA[0], "both")}
    assert found.cost - wide.cost > 1000.0  # 1464


def test_what_acts_at_one_end_stays_there() -> None:
    search = search_of("front")
    found = found_at(search, "front")
    wide = widened(search, found)
    assert wide is None or wide.cost > found.cost


def test_of_what_acts_at_both_ends_only_the_rest_is_tried() -> None:
    search = search_of("both")
    wide = widened(search, found_at(search, "both"))
    assert wide is None or wide.candidate.laws == (("effective_area_error", "both"), ("coulomb_friction", "both"))


def test_where_nothing_may_act_at_both_ends_there_is_nothing_to_try() -> None:
    search = search_of("both")
    problem, load = search.problem, Candidate((("payload", ""),))
    assert widened(search, fit(problem, load, problem.start(load, None, [0.0]), iterations=1)) is None
