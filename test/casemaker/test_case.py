# SPDX-License-Identifier: Apache-2.0
"""Cases: sized to their grade, the same for the same seed, written as the contract's log says."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumo_ros.casemaker.bench import bench
from pneumo_ros.casemaker.case import made, simulated
from pneumo_ros.casemaker.draw import WIDEST, drawn_rig, scenes
from pneumo_ros.casemaker.excitation import ROADS
from pneumo_ros.casemaker.log_file import write_log
from pneumo_ros.casemaker.plan import plan
from pneumo_ros.casemaker.planned import Planned
from pneumo_ros.casemaker.scene import PERIOD, SAMPLES
from pneumo_ros.log.reading import read_log

ON = bench()
FRICTION = Planned("x", "single", (("coulomb_friction", "front"),), 5.0, (), 11, False)


@pytest.mark.slow
def test_size_is_searched_until_the_gap_meets_the_grade() -> None:
    label, sessions, _ = simulated(FRICTION, ON)
    assert label["ratio"]["fit"] == pytest.approx(5.0, rel=0.06)
    assert label["ratio"]["holdout"] > 1.9
    noise = [1e-5] * 4 + [150.0] * 2
    floor = np.sqrt(np.mean((noise / sessions[0].run.measured.std(axis=0)) ** 2))
    assert floor < label["gap"]["floor_fit"] < 1.2 * floor  # the traces of imperfection stay below the sensors' noise
    assert set(label["truth"][0]["places"]) == {"front_force"}


def test_the_same_seed_makes_the_same_case() -> None:
    fixed = replace(plan("ci")[1], seed=99)
    (one, first, _), (two, second, _) = simulated(fixed, ON), simulated(fixed, ON)
    assert json.dumps(one) == json.dumps(two)
    assert np.array_equal(first[1].run.measured, second[1].run.measured)


def test_log_holds_what_was_simulated(tmp_path: Path) -> None:
    case = replace(plan("ci")[0], imperfect=True)
    label, sessions, configs = simulated(case, ON)
    path = tmp_path / "edit.mcap"
    write_log(path, sessions[2], configs[2], 1_000_000_000_000)
    log, session = read_log(path), sessions[2]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["edit.mcap"]
    moved = log.joint("/rig/displacement")
    kept = session.kept[:, 0]
    assert np.array_equal(moved.position, session.sensors[kept, :4])
    assert np.allclose((moved.stamp_ns - 1_000_000_000_000) * 1e-9, session.stamps[kept, 0], atol=1e-9)
    assert np.array_equal(log.pressure("/rig/rear/pressure").value, session.sensors[session.kept[:, 1], 5])
    assert np.array_equal(log.joint("/valve/command").position[:, :2], session.run.inlets)
    assert log.joint("/road/profile").velocity.shape == log.joint("/road/profile").position.shape
    scene = label["scenes"][2]
    assert log.config.sprung_mass.value == pytest.approx(50.33 + scene["added_mass"])
    assert log.config.supply_pressure.value == pytest.approx(790800.7293168 + scene["supply_change"])
    assert scene["added_mass"] > 0.0 or scene["supply_change"] < 0.0


def test_a_half_made_case_is_made_again_and_a_whole_one_kept(tmp_path: Path) -> None:
    case = plan("ci")[0]
    (tmp_path / "cases" / f"{case.name}.part").mkdir(parents=True)
    (tmp_path / "cases" / f"{case.name}.part" / "fit.mcap.part").write_text("torn")
    done = made(case, tmp_path / "cases", tmp_path / "labels")
    assert sorted(p.name for p in done.iterdir()) == ["edit.mcap", "fit.mcap", "holdout.mcap"]
    assert json.loads((tmp_path / "labels" / f"{case.name}.json").read_text())["kind"] == "none"
    for log in map(read_log, done.iterdir()):
        assert log.config is not None and log.topics["/road/profile"].count == SAMPLES
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.*")}
    assert made(case, tmp_path / "cases", tmp_path / "labels") == done
    assert before == {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.*")}


def test_tolerances_are_those_of_the_rig_file() -> None:
    rng = np.random.default_rng(3)
    sigmas = [drawn_rig(ON.nominal, rng)[1] for _ in range(400)]
    assert set(sigmas[0]) == {
        "sprung_mass", "pitch_inertia", "unsprung_mass_front", "unsprung_mass_rear", "tyre_stiffness_front",
        "tyre_stiffness_rear", "bushing_damping", "supply_pressure", "outlet_area_front", "outlet_area_rear",
        "effective_area_scale", "volume_scale", "discharge_coefficient",
    }  # fmt: skip
    values = np.array([list(s.values()) for s in sigmas])
    assert np.abs(values).max() <= WIDEST
    assert np.all(np.abs(values.mean(axis=0)) < 0.2)
    assert np.all(np.abs(values.std(axis=0) - 0.96) < 0.12)


def test_held_out_session_is_of_another_class_and_amplitude() -> None:
    rng = np.random.default_rng(4)
    for imperfect in (False, True):
        for _ in range(50):
            fit, held, edit = scenes(rng, imperfect)
            assert held.road != fit.road
            assert not (held.road.startswith("iso") and fit.road.startswith("iso"))
            assert abs(held.gain / fit.gain - 1.0) > 0.04
            assert (edit.added_mass > 0.0) != (edit.supply_change < 0.0)
            assert (fit.jitter > 0.0) == imperfect
            assert {fit.road, held.road, edit.road} <= set(ROADS)
    assert pytest.approx(15.0) == PERIOD * SAMPLES
