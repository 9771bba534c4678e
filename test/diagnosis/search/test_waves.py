# SPDX-License-Identifier: Apache-2.0
"""Bellows whose area waves over height: how long the waves are is scanned for, for no gradient leads there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.own_logs import driven
from helpers.rig_logs import excitation, signals_of

from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit
from pneumo_ros.diagnosis.search.parts import with_shapes
from pneumo_ros.diagnosis.search.selection import score
from pneumo_ros.diagnosis.search.waves import begun_waves
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig

SECONDS = 6.0
SIZE = 0.045  # of the area


@pytest.mark.parametrize(("length", "phase"), [(6e-3, 0.4), (9e-3, 1.9), (12e-3, -0.8)])
def test_waves_of_any_length_and_phase_are_found(length: float, phase: float) -> None:
    """In m and rad. Without the scan the shape ends elsewhere, and leaves more than noise."""
    model = RigModel(load_rig())
    shape = model.library["effective_area_error.shape"]
    sizes = {"area wave even": SIZE * np.cos(phase), "area wave odd": SIZE * np.sin(phase), "area waves": 1.0 / length}
    truth = tuple(float(sizes.get(p.name, 0.0)) for p in shape.parameters)
    road, commands = excitation(SECONDS, 4)
    acting = (Active("effective_area_error.shape", "rear", truth),)
    clean = model.simulate(driven(road, commands), None, trim(model.rig).state, acting)
    record = signals_of(clean, road, commands, 4, "steps")
    law = Candidate((("effective_area_error", "rear"),))

    def found(library: dict[str, object]) -> tuple[Problem, Fit]:
        problem = Problem(RigModel(load_rig(), library=library), (record,))
        typical = [p.typical for p in problem.effect_parameters(law)]
        return problem, with_shapes(problem, fit(problem, law, problem.start(law, None, typical), iterations=10), 10)

    problem, scanned = found(dict(model.library))
    even, odd, waves = problem.values(scanned.candidate, scanned.x)[-3:]
    assert 1.0 / waves == pytest.approx(length, rel=0.02)
    assert np.hypot(even, odd) == pytest.approx(SIZE, rel=0.05)
    other, without = found({**model.library, "effective_area_error.shape": replace(shape, waves=())})
    assert without.cost - scanned.cost > 300.0  # 554, 880 and 819
    assert score(problem, scanned).level < 0.5 < score(other, without).level  # sigma squared: noise, and 2 to 7


def test_a_part_without_waves_is_not_scanned() -> None:
    model = RigModel(load_rig())
    road, commands = excitation(SECONDS, 4)
    clean = model.simulate(driven(road, commands), None, trim(model.rig).state)
    problem = Problem(model, (signals_of(clean, road, commands, 4, "steps"),))
    refit = fit(problem, Candidate(), problem.start(Candidate(), None, ()))
    assert begun_waves(problem, refit, ("bump_stop.shape", "rear")) == []
    assert begun_waves(problem, refit, ("effective_area_error", "rear")) == []
    start = begun_waves(problem, refit, ("effective_area_error.shape", "rear"))
    assert np.hypot(*start[5:7]) < 0.01  # nothing waves here
