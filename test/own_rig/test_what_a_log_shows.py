# SPDX-License-Identifier: Apache-2.0
"""What a log cannot show is not named: how a force changes with a rate that was always the same; heat without end."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.folders import ROOT
from helpers.own_rigs import chamber_log, cylinder_log

from pneumo_ros.diagnosis.judge.verdict import Calibration
from pneumo_ros.diagnosis.report.facts import why_not
from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.own_rig.from_files import prepared
from pneumo_ros.own_rig.measures import varied

EXAMPLES = ROOT / "examples"


def diagnosed(folder: Path, friction: float, damping: float, *speeds: float) -> Diagnosis:
    log = cylinder_log(folder / "log.csv", friction, damping, speeds)
    return prepared(EXAMPLES / "cylinder" / "rig.py", [log]).diagnose()


def test_one_speed_each_way_shows_no_law_over_the_rate() -> None:
    turns = 2.0 * np.pi * (np.arange(1000) + 0.5) / 1000
    random = np.random.default_rng(1).normal(size=100_000)
    assert varied(np.repeat([0.01, -0.02], 50)) == pytest.approx(0.0, abs=1e-12)
    assert varied(np.sin(turns)) == pytest.approx(1.0 - 8.0 / np.pi**2, abs=1e-4)
    assert varied(random) == pytest.approx(1.0 - 2.0 / np.pi, abs=0.01)
    twice = varied(np.repeat([0.01, 0.02, -0.01, -0.02], 50))
    assert twice == pytest.approx(0.1) and twice > Calibration().varied
    assert varied(np.zeros(9)) == 1.0


@pytest.mark.slow
def test_damping_is_named_only_where_the_rate_varied(tmp_path: Path) -> None:
    """At one speed it draws the picture of dry friction; the report says what to do."""
    told = diagnosed(tmp_path, 0.0, 1000.0, 0.013)
    assert told.verdict == "unknown" and told.gap.best < 0.05 * told.gap.refit
    assert "one speed each way" in why_not(told.to_json())
    assert diagnosed(tmp_path, 0.0, 1000.0, 0.006, 0.013, 0.026).verdict == "viscous_damping"


@pytest.mark.slow
def test_dry_friction_claims_no_more_than_one_speed_shows(tmp_path: Path) -> None:
    assert diagnosed(tmp_path, 15.0, 0.0, 0.013).verdict == "coulomb_friction"


def test_air_that_cools_from_its_filling_keeps_five_sevenths_of_its_pressure(tmp_path: Path) -> None:
    """Filled with no heat lost it is 1.4 times as warm as what was let in, not warmer: 8 bar fall to 5.7 at most."""
    task = prepared(EXAMPLES / "chamber" / "rig.py", [chamber_log(tmp_path / "log.csv", 1, 5e-3)])
    law, shape, anything = (task.model.effects[name].parameters for name in ("heat", "heat.shape", "anything.flow"))
    high = 8.0e5  # 7 bar above the ambient pressure
    assert law[0].high == pytest.approx((1.0 - 1.0 / 1.4) * high, rel=0.01)
    assert law[0].low < -3.0 * law[0].high  # what emptying has cooled
    assert all(atom.high == pytest.approx(law[0].high) and atom.typical <= atom.high for atom in shape)
    assert max(atom.high for atom in anything if atom.name.startswith("settling")) > 3.0 * law[0].high
