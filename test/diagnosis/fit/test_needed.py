# SPDX-License-Identifier: Apache-2.0
"""Unknowns that a fit needs: what came along and moves nothing is no claim."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.own_logs import log

from pneumo_ros.diagnosis.fit.needed import needed_unknowns
from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit, normal_equations
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.rig import load_rig

PRICE = 4.0
LAW, SHAPE = ("valve_lag", "rear"), ("valve_lag.shape", "rear")


@pytest.fixture(scope="module")
def problem() -> Problem:
    """A log of a rig whose rear valve is slow as the library's law says."""
    model = RigModel(load_rig())
    return Problem(model, (log(model, 1, None, (Active("valve_lag", "rear", (0.02, 0.8)),)),))


@pytest.fixture(scope="module")
def lawful(problem: Problem) -> Fit:
    law = Candidate((LAW,))
    return fit(problem, law, problem.start(law, None, (0.02, 0.8)), iterations=6)


def shaped(problem: Problem, lawful: Fit, size: float) -> Fit:
    """The law, with every atom of its family's shape at some size, where it ended."""
    both = Candidate((LAW, SHAPE))
    values = [size * p.typical if p.size else p.typical for p in problem.parameters_of[SHAPE]]
    start = problem.start(both, lawful.x[: problem.fixed], (*problem.values(lawful.candidate, lawful.x), *values))
    return replace(fit(problem, both, start, iterations=1), x=start)  # its jacobian is taken there


def test_a_law_needs_all_that_it_says(problem: Problem, lawful: Fit) -> None:
    assert needed_unknowns(problem, lawful, PRICE) == 2.0
    assert needed_unknowns(problem, replace(lawful, jacobian=None), PRICE) == 2.0


def test_atoms_that_came_along_are_no_claim(problem: Problem, lawful: Fit) -> None:
    """Ten and more of them, each with a trace of a size: dropping them costs less than one is worth."""
    with_traces = shaped(problem, lawful, 1e-4)
    assert np.count_nonzero(with_traces.x) > len(lawful.x) + 5
    assert needed_unknowns(problem, with_traces, PRICE) < 2.5
    assert needed_unknowns(problem, replace(with_traces, jacobian=None), PRICE) > 12.0


def test_what_is_there_without_the_law_needs_atoms(problem: Problem) -> None:
    """The same lag by the shape alone: its atoms cannot all be dropped, and each costs its whole price."""
    alone = Candidate((SHAPE,))
    sizes = [0.0 if p.size else p.typical for p in problem.parameters_of[SHAPE]]
    sizes[2] = 1.0  # two poles of 15 ms
    found = fit(problem, alone, problem.start(alone, None, sizes), iterations=8)
    assert 1.0 <= needed_unknowns(problem, found, PRICE) <= np.count_nonzero(found.x[problem.fixed :])


def test_of_two_atoms_that_do_the_same_one_is_needed(problem: Problem, lawful: Fit) -> None:
    """Each could be dropped while the other stays; what both do needs one."""
    found = shaped(problem, lawful, 1e-4)
    H, _ = normal_equations(problem, found, problem.fitted)
    first = problem.fixed + 2
    strong = first + int(np.argmax(np.diag(H)[first : first + 4]))
    twin = first + 4
    assert found.jacobian is not None
    columns = found.jacobian.copy()
    columns[:, :, twin] = columns[:, :, strong]
    size = 300.0 / np.sqrt(H[strong, strong])
    doubled, single = found.x.copy(), found.x.copy()
    doubled[[strong, twin]] = size, size
    single[[strong, twin]] = 2.0 * size, 0.0
    two, one = (needed_unknowns(problem, replace(found, x=x, jacobian=columns), PRICE) for x in (doubled, single))
    assert two == pytest.approx(one, abs=0.1) and one > 2.9


def test_telling_few_of_many_atoms_costs_what_the_choice_says(problem: Problem) -> None:
    """One atom that is needed, of the n that the shape offers: its price, and twice the logarithm of n."""
    alone = Candidate((SHAPE,))
    parameters = problem.parameters_of[SHAPE]
    sizes = [0.0 if p.size else p.typical for p in parameters]
    sizes[2] = 1.0
    start = problem.start(alone, None, sizes)
    found = replace(fit(problem, alone, start, iterations=1), x=start)
    place = len(parameters) - sum(p.size for p in parameters)
    claimed = 1.0 + 2.0 * np.log(sum(p.size for p in parameters)) / PRICE
    assert claimed <= needed_unknowns(problem, found, PRICE) <= claimed + place
