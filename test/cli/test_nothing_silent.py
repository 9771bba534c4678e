# SPDX-License-Identifier: Apache-2.0
"""Nothing is written over, assumed or left standing in silence; Ctrl-C says one true thing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from io import StringIO
from pathlib import Path

import pytest
from helpers.rig_logs import simulated, write_log
from rich.console import Console
from typer.testing import CliRunner

from pneumo_ros.cli import calibrate, diagnose, run
from pneumo_ros.cli.rig_notes import tell_assumed
from pneumo_ros.errors import InputError
from pneumo_ros.rig import LIMITS, NamedEffect, load_rig, parse_rig
from pneumo_ros.rig.parameters import OPTIONAL
from pneumo_ros.session.supervisor import NodeProcess, Supervisor

POINTS = "channel,reference,unit,volts\n" + "".join(f"sprung_front,{k * 0.01},m,{k * 0.5}\n" for k in range(6))


def refused(app: object, *words: object) -> str:
    """The one line a verb ends with."""
    done = CliRunner().invoke(app, [str(word) for word in words])  # type: ignore[arg-type]
    assert isinstance(done.exception, InputError), done.output
    return str(done.exception)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_log(tmp_path_factory.mktemp("logs") / "fit.mcap", *simulated(3.0, 1), [load_rig().to_yaml()])


def test_a_diagnosis_is_not_written_over(tmp_path: Path, log: Path) -> None:
    (tmp_path / "report.html").write_text("mine", encoding="utf-8")
    said = refused(diagnose.app, log, "-o", tmp_path)
    assert "report.html: exists already" in said and "--overwrite" in said
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == "mine"


def test_the_rig_of_an_older_diagnosis_does_not_stay_beside_a_new_verdict(tmp_path: Path, log: Path) -> None:
    (tmp_path / "diagnosis.json").write_text("{}", encoding="utf-8")
    found = NamedEffect("leak", "front", (("area", 1e-7),))
    from dataclasses import replace

    (tmp_path / "rig.yaml").write_text(replace(load_rig(), effects=(found,)).to_yaml(), encoding="utf-8")
    (tmp_path / "nominal.yaml").write_text(load_rig().to_yaml(), encoding="utf-8")
    said = refused(diagnose.app, log, "-o", tmp_path, "--overwrite")
    assert "rig.yaml: the rig of an older diagnosis would stay" in said and "--save-rig" in said


def test_a_calibration_is_not_written_over(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text(POINTS, encoding="utf-8")
    words = [tmp_path / "points.csv", "--output", tmp_path / "mine.yaml"]
    assert CliRunner().invoke(calibrate.app, [str(word) for word in words]).exit_code == 0
    first = (tmp_path / "mine.yaml").read_text(encoding="utf-8")
    assert "mine.yaml: exists already" in refused(calibrate.app, *words)
    assert (tmp_path / "mine.yaml").read_text(encoding="utf-8") == first
    assert CliRunner().invoke(calibrate.app, [*map(str, words), "--overwrite"]).exit_code == 0


def test_a_partial_rig_says_what_is_the_thesis_rigs() -> None:
    rig = parse_rig("rig: {sprung_mass: {value: 60.0, std: 0.1, unit: kg}}")
    out = StringIO()
    tell_assumed(Console(file=out, width=80), rig, Path("mine.yaml"))
    told = " ".join(out.getvalue().split())
    assert "mine.yaml leaves these out" in told and " sprung_mass," not in told
    assert all(f" {name}" in told for name in LIMITS if name != "sprung_mass" and name not in OPTIONAL)
    whole = StringIO()
    tell_assumed(Console(file=whole), load_rig(), Path("whole.yaml"))
    assert whole.getvalue() == ""


def test_hardware_names_its_calibration(tmp_path: Path) -> None:
    said = refused(run.app, "--source", "serial", "--port", "/dev/null", "--output", tmp_path / "x.mcap")
    assert "hardware needs its own calibration" in said and "appendix_c_corrected" in said


def cpu_time(pid: int) -> float:
    """s that a process has used of the processor: how far it has come, however busy the computer is."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@pytest.mark.realtime
@pytest.mark.parametrize("after", [0.15, 0.6])
def test_early_ctrl_c_is_one_line(tmp_path: Path, after: float) -> None:
    command = [sys.executable, "-m", "pneumo_ros.cli.main", "run", "--output", str(tmp_path / "x.mcap")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    while cpu_time(process.pid) < after and process.poll() is None:
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=60)
    assert said.strip().count("\n") == 0 and said.strip().startswith("stopped by the user"), said
    assert process.returncode in (130, -signal.SIGINT) and not (tmp_path / "x.mcap").exists()


@pytest.mark.realtime  # the batch's processes must be up
@pytest.mark.parametrize("workers", ["1", "2"])
def test_ctrl_c_of_a_batch_is_told_once(tmp_path: Path, workers: str) -> None:
    """The terminal sends it to every process of the batch."""
    command = [sys.executable, "-m", "pneumo_ros.cli.main", "blind", "make", str(tmp_path / "set"), "--set", "ci",
               "--workers", workers]  # fmt: skip
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )
    time.sleep(6.0)
    os.killpg(process.pid, signal.SIGINT)
    said, _ = process.communicate(timeout=60)
    assert said.count("stopped by the user") == 1 and "Traceback" not in said and "failed" not in said, said
    assert process.returncode == 130


@pytest.mark.parametrize(("begun", "told"), [(False, ""), (True, "node plant was killed by SIGINT")])
def test_a_node_that_still_begins_may_die_of_the_end_that_was_asked_for(begun: bool, told: str) -> None:
    """Its death was told as what came before the user's Ctrl-C, with exit code 1."""
    supervisor = Supervisor([NodeProcess("plant", "")], {}, "plant")
    with subprocess.Popen(["sleep", "60"]) as process:
        supervisor.lead.process = process  # type: ignore[assignment]  # nobody reads what it says
        supervisor._progress = 0.5 if begun else -1.0
        supervisor.stop()
    assert supervisor.failure_of_lead() == told
