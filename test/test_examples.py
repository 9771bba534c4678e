# SPDX-License-Identifier: Apache-2.0
"""Rigs of others: their published measurements where they are there, and simulations by other means than ours."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.folders import ROOT
from helpers.other_makers import gearbox, quarter_car

from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.own_rig.from_files import prepared

EXAMPLES = ROOT / "examples"
RIGS = sorted(path.parent.name for path in EXAMPLES.glob("*/rig.py"))


@pytest.fixture(scope="module")
def real(shared: Path) -> Path:
    folder = shared / "data" / "real"
    if not folder.is_dir():
        pytest.skip(f"reference data not found at {folder}")
    return folder


def diagnosed(rig: str, log: Path) -> Diagnosis:
    return prepared(EXAMPLES / rig / "rig.py", [log]).diagnose()


@pytest.mark.parametrize("rig", RIGS)
def test_a_rig_is_one_page_of_physics_and_one_of_names(rig: str) -> None:
    """At most 40 lines of physics and 30 of names, 25 for the rigs that others measured."""
    physics, names = ((EXAMPLES / rig / file).read_text(encoding="utf-8") for file in ("rig.py", "rig.yaml"))
    assert sum(bool(line.strip()) for line in physics.splitlines()) <= 40
    assert len(names.splitlines()) <= (30 if rig == "gearbox" else 25)


@pytest.mark.slow
def test_a_chamber_that_leaks_is_told_from_one_that_is_tight(real: Path) -> None:
    found = {name: diagnosed("chamber", real / f"chamber_{name}.csv") for name in ("Aluminium", "Ultimaker_010")}
    assert found["Aluminium"].verdict == "none"
    assert found["Ultimaker_010"].verdict == "leak" and found["Ultimaker_010"].location[0][0] == "wall"


@pytest.mark.slow
def test_what_a_log_holds_before_its_valve_shuts_is_left_out(real: Path) -> None:
    found = diagnosed("chamber", real / "chamber_Ultimaker_015.csv")
    assert found.verdict == "leak" and found.gap.best < 0.1 * found.gap.refit
    assert len(found.trajectories["time"]) == pytest.approx(0.35 * 1366, abs=6)  # 143.9 s, of which 7.3 s before


@pytest.mark.slow
def test_the_seals_of_a_cylinder_rub(real: Path) -> None:
    found = diagnosed("cylinder", real / "cylinders" / "Circle_2bar.csv")
    assert "coulomb_friction" in found.verdict.split("+") and found.location[0][0] == "seal"
    assert found.gap.best < 0.2 * found.gap.refit


@pytest.mark.slow
def test_the_frame_rubs_against_the_ground_not_against_its_base(real: Path) -> None:
    found = diagnosed("frame", real / "frame_450g_x.mat")
    assert found.verdict == "coulomb_friction" and found.location[0][0] == "floor_to_ground"
    assert found.gap.best < 0.1 * found.gap.refit


@pytest.mark.slow
def test_without_friction_among_the_families_the_frame_is_unknown(real: Path) -> None:
    """What is named then drives the frame, and a damper keeps that from running away: a gap without end without it."""
    without = prepared(EXAMPLES / "frame" / "rig.py", [real / "frame_450g_x.mat"], without=["coulomb_friction"])
    assert without.diagnose().verdict == "unknown"


@pytest.mark.slow
def test_play_between_teeth_of_another_maker_is_named(tmp_path: Path) -> None:
    gearbox(tmp_path / "log.csv", 3)
    found = diagnosed("gearbox", tmp_path / "log.csv")
    assert "backlash" in found.verdict.split("+") and found.location[0][0] == "teeth"
    assert found.gap.best < 0.15 * found.gap.refit
    (play,) = (named for named in found.active if named.effect == "backlash")
    assert play.values[1] == pytest.approx(0.1, rel=0.1)  # half the gap, rad


@pytest.mark.slow
def test_a_strut_that_sticks_and_slips_is_named(tmp_path: Path) -> None:
    quarter_car(tmp_path / "log.csv", 3)
    found = diagnosed("quarter_car", tmp_path / "log.csv")
    assert "coulomb_friction" in found.verdict.split("+") and found.location[0][0] == "strut"
