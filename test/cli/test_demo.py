# SPDX-License-Identifier: Apache-2.0
"""`pneumo demo` as a new user types it, and the session it stands on: a rig that is another than the stated one."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers import sessions
from typer.testing import CliRunner

from pneumo_ros.casemaker.seal import opened
from pneumo_ros.cli.demo import ANSWER, _seal, answer_rows
from pneumo_ros.cli.main import app
from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.log.reading import read_log
from pneumo_ros.rig import NamedEffect, load_rig


def test_the_answer_is_sealed_before_anything_runs(tmp_path: Path) -> None:
    digest = _seal(tmp_path / "sealed", 3)
    rig, answer = load_rig(tmp_path / "sealed" / "rig.yaml"), tmp_path / "sealed" / ANSWER
    label = opened(answer, {"demo": digest})["demo"]
    assert label["effect"] == rig.effects[0].effect and label["seed"] == 3
    answer.write_text(answer.read_text().replace(label["effect"], "payload"))
    with pytest.raises(InputError, match="differs from the one that was sealed"):
        opened(answer, {"demo": digest})


@pytest.mark.parametrize("seed", ["-1", str(2**30)])
def test_a_seed_that_no_session_takes_is_refused_before_anything_is_written(tmp_path: Path, seed: str) -> None:
    done = CliRunner().invoke(app, ["demo", "--seed", seed, "--output", str(tmp_path / "x")])
    assert done.exit_code == 2 and "--seed" in done.output and not any(tmp_path.iterdir())


def test_a_folder_that_is_there_is_not_touched(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["demo", "--output", str(tmp_path)])
    assert isinstance(done.exception, InputError) and "exists already" in str(done.exception)
    assert not any(tmp_path.iterdir())


def test_answer_and_verdict_stand_side_by_side() -> None:
    hidden = NamedEffect("leak", "front", (("leak_area", 2e-7), ("leak_law", 0.6)))
    entry = {"effects": ["leak"], "sites": ["front"], "parameters": {
        "leak_area": {"value": 2.1e-7, "std": 1e-8, "unit": "m2"}, "leak_law": {"value": 0.5, "std": 0.1, "unit": "1"},
    }}  # fmt: skip
    rows = answer_rows(hidden, {"verdict": "leak", "ranking": [entry]})
    assert rows[:3] == [
        ("effect", "leak", "leak"), ("place", "front", "front"), ("leak area", "0.2 mm²", "0.210 ± 0.010 mm²"),
    ]  # fmt: skip
    other = answer_rows(hidden, {"verdict": "valve_lag", "ranking": [{**entry, "effects": ["valve_lag"]}]})
    assert other[0] == ("effect", "leak", "valve_lag") and other[2][2] == ""


def test_a_session_states_one_rig_and_simulates_another(tmp_path: Path) -> None:
    """The log knows nothing of the effect: neither rig, nor events, nor any other text."""
    real = tmp_path / "real.yaml"
    hidden = NamedEffect("viscous_damping", "rear", (("added_damping", 50.0), ("growth_with_speed", 0.5)))
    real.write_text(load_rig().__class__(**{**load_rig().__dict__, "effects": (hidden,)}).to_yaml(), encoding="utf-8")
    runs = []
    for name, options in (("plain", ()), ("hidden", ("--set", f"plant.simulated_rig={real}"))):
        log = tmp_path / f"{name}.mcap"
        code, said = sessions.run("--duration", "2", "--single-process", "--no-summary", "--no-picture", "--no-report",
                                  "--output", str(log), *options)  # fmt: skip
        assert code == 0, said
        assert said.strip().endswith(f"{name}.mcap") and "viscous_damping" not in said
        runs.append(read_log(log))
    plain, other = runs
    assert other.config == plain.config == load_rig()
    assert b"viscous_damping" not in (tmp_path / "hidden.mcap").read_bytes()
    heights = [log.select(topics.DISPLACEMENT.name, list(topics.DISPLACEMENT.names)).position for log in runs]
    assert np.std(heights[0] - heights[1]) > 5 * load_rig().displacement_noise.value


def test_a_simulated_rig_that_cannot_be_is_refused_before_anything_starts(tmp_path: Path) -> None:
    code, said = sessions.run("--set", "plant.simulated_rig=nowhere.yaml", "--output", str(tmp_path / "a.mcap"))
    assert code == 2 and "nowhere.yaml" in said and not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_demo_ends_with_the_answer_beside_the_verdict(tmp_path: Path) -> None:
    """Seed 3, a delayed valve: as long as a new user waits, at 80 columns."""
    done = subprocess.run(
        [sys.executable, "-m", "pneumo_ros.cli.main", "demo", "--seed", "3", "-o", "demo", "--duration", "8"],
        cwd=tmp_path, capture_output=True, text=True, timeout=900, env=sessions.environment(),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    said = done.stdout
    for number in range(1, 5):
        assert f"{number} of 4:" in said
    answer = said.rpartition("the answer")[2]
    assert re.search(r"effect +transport_delay +transport_delay", answer) and "the verdict names it" in answer
    assert "pneumo run --rig demo/report/rig.yaml" in said and "report   demo/report/report.html" in answer
    assert max(map(len, answer.splitlines())) <= 80
    found = json.loads((tmp_path / "demo" / "report" / "diagnosis.json").read_text())
    assert found["verdict"] == "transport_delay" and found["gap"]["best"] < 2 * found["gap"]["noise_floor"]
