# SPDX-License-Identifier: Apache-2.0
"""The next experiment of one's own rig: inside what the log has seen, the best of its courses, none without a mark."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.own_rigs import CART_YAML, cart_log, written

from pneumo_ros.diagnosis.experiment import SEPARATES, separation
from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit
from pneumo_ros.diagnosis.report.steps import Asked, next_steps
from pneumo_ros.own_rig.experiment import FILE, SHAPES, OwnExperiment, courses, design_own, driven
from pneumo_ros.own_rig.from_files import OwnTask, prepared

DRIVEN = CART_YAML.replace("force: {unit: N}", "force: {unit: kN, field: force_kn, drive: true}")


def task(folder: Path, names: str = DRIVEN) -> OwnTask:
    log = cart_log(folder / "log.csv", friction=0.05, seconds=8.0)
    table = np.loadtxt(log, delimiter=",", skiprows=1)
    np.savetxt(log, np.column_stack([table, 1e-3 * table[:, 2]]), "%.9f", ",", header="t,x,force,force_kn", comments="")
    return prepared(written(folder, names=names), [log])


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[OwnTask, Problem, Fit, Fit]:
    """Friction, which the log has a little of, and viscous damping."""
    one = task(tmp_path_factory.mktemp("cart"))
    problem = Problem(one.model, one.fit)
    fits = []
    for name, value in (("coulomb_friction", 0.05), ("viscous_damping", 0.1)):
        candidate = Candidate(((name, "rail"),))
        fits.append(fit(problem, candidate, problem.start(candidate, None, [value]), iterations=4,
                        rows=np.ones(len(problem.measured), bool)))  # fmt: skip
    return one, problem, *fits


def test_the_best_course_is_offered(made: tuple[OwnTask, Problem, Fit, Fit], tmp_path: Path) -> None:
    one, problem, best, rival = made
    found = design_own(problem, best, rival)
    assert isinstance(found, OwnExperiment) and found.chosen_from == len(SHAPES)
    tried = {name: separation(problem, best, rival, record) for name, _, record in courses(one.model, one.fit[0])}
    assert found.separation == max(tried.values()) == tried[found.name] and found.separation > found.separation_now
    assert found.tells == (found.separation >= SEPARATES) and "force" in found.description
    (file,) = found.write(tmp_path)
    assert file.name == FILE and file.read_text().splitlines()[0] == "time_s,force_kn (kN)"
    table = np.loadtxt(file, delimiter=",", skiprows=1)
    own = one.fit[0].inputs[:, 0]
    assert 1e3 * table[:, 1].min() >= own.min() - 1e-6 and 1e3 * table[:, 1].max() <= own.max() + 1e-6
    assert np.abs(np.diff(1e3 * table[:, 1])).max() <= np.abs(np.diff(own)).max() + 1e-6


def test_the_report_says_what_to_drive(made: tuple[OwnTask, Problem, Fit, Fit], tmp_path: Path) -> None:
    found = design_own(*made[1:])
    assert found is not None
    summary = {"rig_model": True, "verdict": "coulomb_friction", "probability": 0.5, "location": [],
               "next_experiment": found.to_json()}  # fmt: skip
    first = next_steps(summary, Asked((Path("log.csv"),), None, tmp_path))[0]
    assert "Split the rivals: Drive force" in first.text and FILE in first.text


def test_nothing_is_offered_for_inputs_that_nobody_commands(tmp_path: Path) -> None:
    one = task(tmp_path, CART_YAML)
    problem = Problem(one.model, one.fit)
    nominal = fit(problem, Candidate(), problem.start(Candidate(), None, []), iterations=1,
                  rows=np.ones(len(problem.measured), bool))  # fmt: skip
    assert design_own(problem, nominal, nominal) is None


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.name)
@pytest.mark.parametrize("held", [False, True])
def test_a_course_stays_inside_range_and_rate(held: bool, shape: object, made: object) -> None:
    t = np.arange(0.0, 12.0, 0.01)
    own = 3.0 + 2.0 * np.sin(2.0 * np.pi * 0.8 * t)
    course = driven(own, 0.01, 1.25, shape, held)  # type: ignore[arg-type]
    assert own.min() - 1e-9 <= course.min() and course.max() <= own.max() + 1e-9
    assert held or np.abs(np.diff(course)).max() <= np.abs(np.diff(own)).max() + 1e-12
    assert np.ptp(course) > 0.1 * np.ptp(own) * (0.9 if shape.name == "small" else 5.0)  # type: ignore[attr-defined]
