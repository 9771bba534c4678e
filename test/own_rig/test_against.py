# SPDX-License-Identifier: Apache-2.0
"""`--against`: what changed between two logs of one rig, and nothing where nothing did."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from helpers.folders import ROOT
from helpers.own_rigs import chamber_log
from typer.testing import CliRunner

from pneumo_ros.cli import diagnose
from pneumo_ros.errors import InputError

CHAMBER = ROOT / "examples" / "chamber" / "rig.py"


def diagnosed(folder: Path, after: Path, before: Path) -> dict[str, object]:
    words = [after, "--rig-model", CHAMBER, "--against", before, "-o", folder / "out", "--overwrite"]
    done = CliRunner().invoke(diagnose.app, [str(word) for word in words])
    assert done.exit_code == 0, done.output
    assert f"{before.name} had: " in done.output
    return dict(json.loads((folder / "out" / "diagnosis.json").read_text()))


@pytest.mark.slow
def test_a_leak_that_came_between_two_logs_is_what_changed(tmp_path: Path) -> None:
    before, after = chamber_log(tmp_path / "a.csv", 1, 1e-5), chamber_log(tmp_path / "b.csv", 2, 3e-4)
    assert diagnosed(tmp_path, after, before)["verdict"] == "leak"


@pytest.mark.slow
def test_a_leak_that_both_logs_have_is_no_change(tmp_path: Path) -> None:
    before, after = (chamber_log(tmp_path / f"{seed}.csv", seed, 3e-4) for seed in (1, 2))
    assert diagnosed(tmp_path, after, before)["verdict"] == "none"


def test_an_earlier_log_that_is_not_there_is_told(tmp_path: Path) -> None:
    words = [tmp_path / "b.csv", "--rig-model", CHAMBER, "--against", tmp_path / "a.csv", "-o", tmp_path / "out"]
    done = CliRunner().invoke(diagnose.app, [str(word) for word in words])
    assert isinstance(done.exception, InputError) and "a.csv: no such file, key '--against'" in str(done.exception)
