# SPDX-License-Identifier: Apache-2.0
"""An effect that does harm on the held-out log is taken out of the structure; the others are judged without it."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.own_logs import drawn, log

from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit
from pneumo_ros.diagnosis.half_car.where import held_equations
from pneumo_ros.diagnosis.judge.equations import EXPLAINED, SHOWN
from pneumo_ros.diagnosis.judge.pruning import HARM, harm, harmful
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.rig import load_rig

DAMPING, OFFSET = ("viscous_damping", "both"), ("lvdt_offset", "sprung_front")
DAMPED, METRES = (40.0, 0.0), 4e-3


@pytest.fixture(scope="module")
def model() -> RigModel:
    return RigModel(load_rig())


def both(problem: Problem) -> Fit:
    """Damping and the offset as the fitted log has them, the rig's own parameters as they are."""
    candidate = Candidate((DAMPING, OFFSET))
    x = problem.start(candidate, np.zeros(problem.fixed), [*DAMPED, METRES])
    return fit(problem, candidate, x, rows=np.ones(len(problem.measured), dtype=bool), iterations=0)


@pytest.mark.parametrize("zero", [0.0, METRES], ids=["the offset stayed", "the offset was the fitted log's"])
def test_what_only_the_fitted_log_had_is_taken_away(model: RigModel, zero: float) -> None:
    """A zero that wandered between two logs: damping stays, whichever of the two is asked about first."""
    nuisance = np.array([p.nominal for p in model.parameters])
    damped, off = Active(*DAMPING, DAMPED), Active(*OFFSET, (METRES,))
    fit_log = log(model, 1, nuisance, (damped, off))
    held = log(model, 2, nuisance, (damped, off) if zero == 0.0 else (damped,))
    problem = Problem(model, (fit_log,))
    equations = held_equations(model, (fit_log,), held)
    assert harmful(problem, both(problem), held, equations) == (() if zero == 0.0 else (OFFSET,))


def test_a_lone_effect_stays_for_the_verdict(model: RigModel) -> None:
    nuisance = drawn(model, 3)
    fit_log, held = log(model, 1, nuisance, (Active(*OFFSET, (METRES,)),)), log(model, 2, nuisance)
    problem = Problem(model, (fit_log,))
    candidate = Candidate((OFFSET,))
    x = problem.start(candidate, np.zeros(problem.fixed), [METRES])
    assert harmful(problem, fit(problem, candidate, x, iterations=2), held) == ()


def test_harm_is_the_larger_of_run_and_equations_and_these_count_where_they_show_a_gap() -> None:
    seen = EXPLAINED + SHOWN + 1.0
    assert harm((0.03, seen), (0.02, seen)) == pytest.approx(1.5) and HARM < 1.5
    assert harm((0.02, 4.0 * seen), (0.02, seen)) == pytest.approx(2.0)
    assert harm((0.02, EXPLAINED + 1.0), (0.02, 0.2)) == pytest.approx(1.0)


def test_what_the_equations_miss_is_kept_whatever_the_run_says() -> None:
    """Another effect's law has gone astray: the run is better without this one by chance, the equations are not."""
    seen = EXPLAINED + SHOWN + 1.0
    assert harm((0.037, seen), (0.029, 1.01 * 2.0 * seen)) < 1.0
    assert harm((0.037, seen), (0.029, 0.99 * 2.0 * seen)) > HARM
    assert harm((0.037, 0.1), (0.029, 0.99 * 2.0 * EXPLAINED)) > HARM
