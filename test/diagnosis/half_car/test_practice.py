# SPDX-License-Identifier: Apache-2.0
"""Two of the reference logs, made by other software with other laws, end to end."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from pneumo_ros.cli.main import app
from pneumo_ros.diagnosis.diagnose import Options
from pneumo_ros.diagnosis.half_car.from_logs import diagnose_files, prepared
from pneumo_ros.diagnosis.judge.held_out import noise_floor, total_floor
from pneumo_ros.diagnosis.judge.held_out_runs import held_out
from pneumo_ros.rig import load_rig

NOT_BELOW = 0.98  # of the noise alone: what the noise of 7500 samples is itself known to


def test_no_gap_of_a_known_rig_lies_below_the_noise_alone(practice: Callable[[str], Path]) -> None:
    """The rig that made the log: channel by channel nothing but noise is left, and a floor above it is an error."""
    task = prepared([practice("nominal-exact-fit")], practice("nominal-exact-holdout"))
    nominal = np.array([p.nominal for p in task.model.parameters])
    left = held_out(task.model, task.holdout, nominal, ())
    assert np.all(left.channels > NOT_BELOW * noise_floor(task.holdout))
    assert left.total > NOT_BELOW * total_floor(task.holdout)


@pytest.mark.slow
def test_lag_of_the_rear_valve_is_named_and_its_gap_closed(practice: Callable[[str], Path]) -> None:
    found = diagnose_files(
        [practice("valve-lag-rear-fit")], practice("valve-lag-rear-holdout"), options=Options(pairs=False)
    )
    best = found.ranking[0]
    assert found.verdict == "valve_lag" and best.side == "rear" and found.location[0][0] == "rear_air"
    assert best.shrink > 0.9 and found.gap.best < 2.5 * found.gap.noise_floor
    assert found.gap.best > NOT_BELOW * found.gap.noise_floor
    # labels.json: natural frequency 67.0 rad/s, damping ratio 0.86
    assert best.parameters["valve_lag"].value == pytest.approx(1.0 / 66.997, rel=0.03)
    assert best.parameters["valve_damping_ratio"].value == pytest.approx(0.862, rel=0.05)


@pytest.mark.slow
def test_the_command_line_writes_all_files_and_finds_no_effect_where_there_is_none(
    practice: Callable[[str], Path], tmp_path: Path
) -> None:
    arguments = [
        "diagnose", str(practice("nominal-within-tolerance-fit")), "--output", str(tmp_path),
        "--holdout", str(practice("nominal-within-tolerance-holdout")), "--no-pairs",
        "--save-rig", str(tmp_path / "rig.yaml"),
    ]  # fmt: skip
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    found = json.loads((tmp_path / "diagnosis.json").read_text())
    assert found["verdict"] == "none" and found["probability"] > 0.8 and found["ambiguity_group"] == []
    assert found["gap"]["best"] > NOT_BELOW * found["gap"]["noise_floor"]
    assert found["gap"]["best"] == found["gap"]["refit"] < 0.02 < 0.5 < found["gap"]["nominal"]
    assert sum(entry["probability"] for entry in found["ranking"]) == pytest.approx(1.0, abs=1e-3)
    assert {"report.html", "residual.mcap"} <= {path.name for path in tmp_path.iterdir()}
    saved = load_rig(tmp_path / "rig.yaml")
    assert saved.tyre_stiffness_front.value != load_rig().tyre_stiffness_front.value
    # The saved rig's own nominal is what the refit was, but for the shift of all commands, which is not the rig's.
    saved_again = prepared(
        [practice("nominal-within-tolerance-fit")], practice("nominal-within-tolerance-holdout"), saved
    )
    values = np.array([p.nominal for p in saved_again.model.parameters])
    assert held_out(saved_again.model, saved_again.holdout, values, ()).total == pytest.approx(
        found["gap"]["refit"], rel=0.1
    )
