# SPDX-License-Identifier: Apache-2.0
"""A law is another than the library's only where the shape beside it does something."""

from __future__ import annotations

import pytest
from helpers.own_logs import log

from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import fit
from pneumo_ros.diagnosis.judge.idle_shapes import with_own_laws
from pneumo_ros.diagnosis.result import DIFFERS, BudgetEntry
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.rig import load_rig

LATE = (("transport_delay", "both"), ("transport_delay.shape", "both"))
AIR = ("front_air", "rear_air")


# What the fit of a session with a pure delay of 15 ms ended at; the same with a fifth of the command 16 ms later still.
@pytest.mark.parametrize(("share", "law"), [(5.9e-6, "transport_delay"), (0.2, DIFFERS)])
def test_a_shape_that_does_nothing_leaves_the_librarys_law(share: float, law: str) -> None:
    model = RigModel(load_rig())
    problem = Problem(model, (log(model, 1, None, (Active("transport_delay", "both", (0.015,)),)),))
    candidate = Candidate(LATE)
    start = problem.start(candidate, None, [0.015, 0.0, 0.0, share, 0.0, 0.0, 0.0, 0.05, 0.5])
    found = fit(problem, candidate, start, iterations=0)
    entry = BudgetEntry(("transport_delay",), "both", AIR, 0.4, (0.3, 0.5), DIFFERS, 0.93)
    assert [one.law for one in with_own_laws(problem, found, [entry])] == [law]
