# SPDX-License-Identifier: Apache-2.0
"""The equations along a held-out log know a wrong law that draws the free run towards the log."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.own_logs import drawn, log

from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit
from pneumo_ros.diagnosis.half_car.signals import Signals
from pneumo_ros.diagnosis.half_car.where import held_equations, locate
from pneumo_ros.diagnosis.half_car.where.weak import EQUATIONS
from pneumo_ros.diagnosis.judge.equations import SHOWN, kept, mended_in
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.rig import load_rig

ICED = -0.05  # of an outlet's opening, within some seconds
OFFSET = ("pressure_offset", "rear_pressure")


@pytest.fixture(scope="module")
def model() -> RigModel:
    return RigModel(load_rig())


def rig_with(model: RigModel, *truth: Active) -> tuple[Signals, Signals]:
    nuisance = drawn(model, 8)
    return log(model, 1, nuisance, truth), log(model, 2, nuisance, truth)


def fitted(problem: Problem, parts: tuple[Part, ...], start: tuple[float, ...]) -> Fit:
    candidate = Candidate(parts)
    x = problem.start(candidate, np.zeros(problem.fixed), list(start))
    return fit(problem, candidate, x, rows=np.ones(len(problem.measured), dtype=bool), iterations=20)


def icing(model: RigModel) -> tuple[float, ...]:
    names = [p.name for p in model.effects["anything.air"].parameters]
    return tuple(ICED if name == "later outlet 3 s" else 0.0 for name in names)


def test_a_wrong_name_does_not_act_in_the_equations_and_the_right_one_does(model: RigModel) -> None:
    """An outlet that ices, called an offset of its pressure sensor."""
    truth = Active("anything.air", "rear", icing(model))
    fit_log, held = rig_with(model, truth)
    problem = Problem(model, (fit_log,))
    equations = held_equations(model, (fit_log,), held)

    def left(one: Fit) -> float:
        active = problem.active(one.candidate, problem.values(one.candidate, one.x))
        return float(np.mean(equations.left(problem.nuisance(one.x), active)))

    refit, named = fitted(problem, (), ()), fitted(problem, (OFFSET,), (2e3,))
    right = fitted(problem, (("anything.air", "rear"),), icing(model))
    assert left(refit) > 3.0
    assert kept(left(named), left(refit)) > 0.9
    assert kept(left(right), left(refit)) < 0.15


def test_it_is_what_the_search_for_places_calls_the_refit(model: RigModel) -> None:
    damped = Active("viscous_damping", "both", (40.0, 0.0))
    fit_log, held = rig_with(model, damped)
    nuisance = np.array([p.nominal for p in model.parameters])
    equations = held_equations(model, (fit_log,), held)
    there = float(np.mean(equations.left(nuisance, ())))
    assert there == pytest.approx(locate(model, (fit_log,), held).level["refit"] ** 2, rel=0.02)
    assert there > 2.0
    assert np.mean(equations.left(nuisance, (damped,))) < 1.2


def test_a_late_sensor_hides_no_effect_from_the_equations_that_it_does_not_feed(model: RigModel) -> None:
    """Friction at the front, and a rear pressure that is late: the front axle's equation still tells of it."""
    friction = Active("coulomb_friction", "front", (6.0, 1e-4, 0.0))
    late = Active("pressure_lag", "rear_pressure", (0.02, 1.0))
    fit_log, held = rig_with(model, friction, late)
    equations = held_equations(model, (fit_log,), held)
    nuisance = np.array([p.nominal for p in model.parameters])
    without, own = equations.left(nuisance, ()), equations.left(nuisance, (friction,))
    front = equations.of(("front_force",))
    assert kept(float(np.mean(own)), float(np.mean(without))) > 0.9
    axle = EQUATIONS.index("front_axle")
    # What both ends share is estimated from the late end as well.
    assert front[axle] and kept(float(own[axle]), float(without[axle])) < 0.5


@pytest.mark.parametrize(
    ("places", "acting"),
    [
        (("rear_force",), "heave pitch rear_axle"),
        (("front_tyre",), "front_axle"),
        (("rear_air",), "rear_air"),
        (("body_pitch", "body_heave"), "heave pitch"),
        (("supply",), "front_air rear_air"),
        (("road_input",), "front_axle rear_axle"),
        (("sensor:front_pressure",), "heave pitch front_axle front_air"),
        (("sensor:unsprung_rear",), "heave pitch rear_axle rear_air"),
    ],
)
def test_equations_by_place(model: RigModel, places: tuple[str, ...], acting: str) -> None:
    fit_log, held = rig_with(model)
    mask = held_equations(model, (fit_log,), held).of(places)
    assert " ".join(name for name, on in zip(EQUATIONS, mask, strict=True) if on) == acting


def test_what_is_mended_is_asked_where_something_acts_and_a_gap_shows() -> None:
    left, before = np.array([1.0, 3.0, 90.0]), np.array([1.2, 41.0, 91.0])
    assert mended_in(left, before, np.array([False, True, False])) == pytest.approx(2.0 / 40.0)
    assert mended_in(left, before, np.array([True, False, False])) == np.inf  # hardly any gap there
    assert mended_in(left, before, np.zeros(3, dtype=bool)) > 0.6  # acts in none of them: all are asked


def test_a_gap_that_the_equations_hardly_show_is_no_reference() -> None:
    assert kept(left=1.5, before=1.2) == pytest.approx(0.5 / SHOWN)
    assert kept(left=0.8, before=9.0) == 0.0
    assert kept(left=17.0, before=9.0) == pytest.approx(2.0)
