# SPDX-License-Identifier: Apache-2.0
"""The measured curve of whatever may act at several places at once."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.own_logs import log

from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import fit, sensitivities
from pneumo_ros.diagnosis.fit.uncertainty import covariance
from pneumo_ros.diagnosis.judge.budgeted import measured_curve
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.rig import load_rig

PARTS = (("anything.supply", ""), ("anything.force", "rear"), ("anything.air", "front"))


@pytest.mark.parametrize("most", range(3))
def test_what_acts_at_several_places_is_shown_where_it_is_used_most(most: int) -> None:
    model = RigModel(load_rig())
    record = log(model, 1, None, (Active("supply_droop", "", (3e5, 0.1)),))
    problem = Problem(model, (record,))
    candidate = Candidate(PARTS)
    start = problem.start(candidate, None, _small(problem, candidate, most))
    found = sensitivities(problem, fit(problem, candidate, start, iterations=0))
    cov = covariance(problem, found)
    together = measured_curve(problem, found, record, PARTS, cov, 0.0)
    alone = measured_curve(problem, found, record, (PARTS[most],), cov, 0.0)
    assert together is not None and alone is not None and (together.x, together.y) == (alone.x, alone.y)
    np.testing.assert_array_equal(together.points, alone.points)


def _small(problem: Problem, candidate: Candidate, most: int) -> list[float]:
    """A tenth of the usual size of each parameter, no term is absent; a third of that of one part."""
    shares = [0.3 if k == most else 0.1 for k, part in enumerate(candidate.parts)
              for _ in problem.effect_parameters(Candidate((part,)))]  # fmt: skip
    return [share * p.typical for share, p in zip(shares, problem.effect_parameters(candidate), strict=True)]
