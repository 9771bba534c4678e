# SPDX-License-Identifier: Apache-2.0
"""What speaks for an effect on the held-out log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.own_logs import log

from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import fit
from pneumo_ros.diagnosis.judge.closable import ENOUGH, _runs_away_without, closable, followed, worth_asking
from pneumo_ros.diagnosis.judge.held_out import total_floor
from pneumo_ros.effects.parameters import STILL_FOLLOWS, Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.rig import load_rig

RNG = np.random.default_rng(5)
THERE = 4e5 + 4e4 * np.sin(np.linspace(0.0, 60.0, 4000)) + RNG.normal(0.0, 8e3, 4000)  # Pa


@pytest.mark.parametrize("share", [1.0, 0.5, -0.3])
def test_a_scale_is_followed_by_its_sensitivity(share: float) -> None:
    reading = 4e5 + share * (THERE - 4e5) + RNG.normal(0.0, 150.0, 4000)
    assert followed(reading, THERE) == pytest.approx(share, abs=0.01)


@pytest.mark.parametrize("upper", [True, False])
def test_a_gauge_that_clips_follows_no_longer(upper: bool) -> None:
    """A tenth of its readings stand at its limit, with the sensor's noise on them."""
    limit = np.quantile(THERE, 0.9 if upper else 0.1)
    clipped = (np.minimum if upper else np.maximum)(THERE, limit) + RNG.normal(0.0, 150.0, 4000)
    assert abs(followed(clipped, THERE)) < 0.02 < STILL_FOLLOWS


def test_a_curved_scale_still_follows() -> None:
    """A cubic error that takes 0.7 of the sensitivity at the ends of the range."""
    z = (THERE - 4e5) / np.max(np.abs(THERE - 4e5))
    assert followed(4e5 + 5e4 * (z - 0.7 / 3.0 * z**3), 4e5 + 5e4 * z) > 2.0 * STILL_FOLLOWS


def test_too_few_samples_and_a_run_that_failed_say_nothing() -> None:
    assert followed(np.zeros(2 * ENOUGH - 1), np.arange(2.0 * ENOUGH - 1)) == 1.0
    assert followed(THERE, np.where(THERE > 4.2e5, np.nan, THERE)) == 1.0


def test_a_structure_that_leaves_nothing_is_asked_for_nothing_else() -> None:
    floor = 0.003
    assert worth_asking(1e-5, 1e-4, floor)
    assert not worth_asking(8e-5, 1e-4, floor)  # hardly less
    assert not worth_asking(0.0, 0.06 * floor**2, floor)  # all of it is the floor's own uncertainty


@pytest.mark.parametrize("clips, follows", [(False, True), (True, False)])
def test_a_gauge_that_clips_in_the_fitted_log_alone_is_no_scale(clips: bool, follows: bool) -> None:
    """The held-out session never comes to where it clips; a scale that is off is followed in both."""
    model = RigModel(load_rig())
    scale = () if clips else (Active("pressure_scale", "front_pressure", (-0.2, 0.0)),)
    fitted, held = log(model, 1, None, scale), log(model, 2, None, scale)
    front = model.channels.index("front_pressure")
    if clips:
        reading = fitted.measured.copy()
        reading[:, front] = np.minimum(reading[:, front], np.quantile(reading[:, front], 0.9))
        fitted = replace(fitted, measured=reading)
    problem = Problem(model, (fitted,))
    law = Candidate((("pressure_scale", "front_pressure"),))
    best = fit(problem, law, problem.start(law, None, (-0.05, 0.0)), iterations=4)
    base = fit(problem, Candidate(), problem.start(Candidate(), None, ()), iterations=4)
    told = closable(problem, base, best, held, total_floor(held), 0.5, ())
    assert (told.effects[0].follows > 1.0) is follows


def test_a_structure_is_driven_where_the_rest_of_it_runs_away_as_it_is() -> None:
    """A force that pushes with the rate, held by a damper: without the damper it runs away, without the push nothing
    does."""
    model = RigModel(load_rig())
    fitted, held = log(model, 1, None, ()), log(model, 2, None, ())
    problem = Problem(model, (fitted,))
    push, damper = ("anything.force", "front"), ("viscous_damping", "front")
    structure = Candidate((damper, push))
    names = [p.name for p in problem.effect_parameters(structure)]
    values = np.zeros(len(names))
    values[names.index("added_damping")] = 300.0
    for name in ("damping_out", "damping_in"):
        values[names.index(name)] = -250.0  # N s/m, beyond the bushing's 50
    best = fit(problem, structure, problem.start(structure, None, tuple(values)), iterations=0)
    assert not best.diverged
    assert _runs_away_without(problem, best, held, damper)
    assert not _runs_away_without(problem, best, held, push)
