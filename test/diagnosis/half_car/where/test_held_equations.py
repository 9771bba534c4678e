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
from pneumo_ros.diagnosis.judge.equations import SHOWN, kept
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
        return equations.left(problem.nuisance(one.x), active)

    refit, named = fitted(problem, (), ()), fitted(problem, (OFFSET,), (2e3,))
    right = fitted(problem, (("anything.air", "rear"),), icing(model))
    assert left(refit) > 3.0
    assert kept(left(named), left(refit)) > 0.9
    assert kept(left(right), left(refit)) < 0.1


def test_it_is_what_the_search_for_places_calls_the_refit(model: RigModel) -> None:
    damped = Active("viscous_damping", "both", (40.0, 0.0))
    fit_log, held = rig_with(model, damped)
    nuisance = np.array([p.nominal for p in model.parameters])
    there = held_equations(model, (fit_log,), held).left(nuisance, ())
    assert there == pytest.approx(locate(model, (fit_log,), held).level["refit"] ** 2, rel=0.02)
    assert there > 2.0
    assert held_equations(model, (fit_log,), held).left(nuisance, (damped,)) < 1.2


def test_a_gap_that_the_equations_hardly_show_is_no_reference() -> None:
    assert kept(left=1.5, before=1.2) == pytest.approx(0.5 / SHOWN)
    assert kept(left=0.8, before=9.0) == 0.0
    assert kept(left=17.0, before=9.0) == pytest.approx(2.0)
