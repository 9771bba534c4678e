# SPDX-License-Identifier: Apache-2.0
"""docs/your-rig.md as a new user follows it: its files, its two commands, its answer."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.folders import ROOT

from pneumo_ros.own_rig.from_files import prepared
from pneumo_ros.own_rig.outputs import save_rig


@pytest.fixture(scope="module")
def followed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder after the page's blocks were written to their files and its commands were given."""
    folder = tmp_path_factory.mktemp("my_rig")
    page = (ROOT / "docs/your-rig.md").read_text(encoding="utf-8")
    for block in re.findall(r"```(?:python|yaml)\n# (\S+)\n(.*?)```", page, re.DOTALL):
        (folder / block[0]).write_text(block[1], encoding="utf-8")
    commands = re.findall(r"```sh\n(.*?)```", page, re.DOTALL)[0].strip().splitlines()
    for command in commands:
        program, *words = command.split()
        run = [sys.executable, *(["-m", "pneumo_ros.cli.main"] if program == "pneumo" else []), *words]
        done = subprocess.run(run, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.slow
def test_the_page_names_the_friction_of_its_rail(followed: Path) -> None:
    found = json.loads((followed / "found" / "diagnosis.json").read_text())
    assert found["verdict"] == "coulomb_friction" and found["probability"] > 0.8
    assert found["location"][0]["place"] == "rail"
    assert found["gap"]["best"] < 0.2 * found["gap"]["refit"]
    shares = sum(e["share"] for e in found["budget"]) + found["refit_share"] + found["floor_share"]
    assert 0.99 < shares + (found["remainder"] or {"share": 0.0})["share"] < 1.05  # nothing is left below the floor
    curve = np.array(found["budget"][0]["curve"]["points"])
    fast = curve[np.abs(curve[:, 0]) > 0.3 * np.abs(curve[:, 0]).max()]
    assert np.allclose(np.abs(fast[:, 1]), 1.5, atol=0.3) and np.all(fast[:, 1] * fast[:, 0] < 0.0)
    told = re.search(r"friction force ([\d.]+) ± ([\d.]+) N", (ROOT / "docs/your-rig.md").read_text(encoding="utf-8"))
    size = found["ranking"][0]["parameters"]["friction_force"]
    assert told is not None and abs(size["value"] - float(told[1])) < float(told[2]), "what the page shows"
    page = (followed / "found" / "report.html").read_text()
    assert (
        "cart on a spring" in page and "rail" in page and (followed / "found" / "residual.mcap").stat().st_size > 1000
    )


@pytest.mark.slow
def test_the_rig_as_found_is_the_one_that_was_fitted_and_lacks_nothing(followed: Path) -> None:
    rig, log = followed / "found" / "rig.yaml", followed / "log.csv"
    first = json.loads((followed / "found" / "diagnosis.json").read_text())
    task = prepared(followed / "rig.py", [log], rig=rig)
    found = task.diagnose()
    assert found.verdict == "none"
    assert found.gap.nominal == pytest.approx(first["gap"]["best"], rel=0.02)
    again = save_rig(found, task.model, followed / "again.yaml")
    assert prepared(followed / "rig.py", [log], rig=again).model.configured == task.model.configured
