# SPDX-License-Identifier: Apache-2.0
"""What launch/rig.launch.py describes, launched: five processes, their session and its end.

ROS 2's launch has no wheels, so that helpers/launcher.py carries the description out; the nodes are real.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from helpers.folders import ROOT
from helpers.sessions import environment, own_domain

from pneumo_ros.log.reading import read_log

LAUNCHER = ROOT / "test" / "helpers" / "launcher.py"


def launched(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, str(LAUNCHER), "source:=sim", f"log_folder:={folder}", *arguments]
    place = {**environment(), "ROS_DOMAIN_ID": str(own_domain())}
    return subprocess.Popen(command, env=place, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def ended(launch: subprocess.Popen[str]) -> tuple[int, str]:
    try:
        said, _ = launch.communicate(timeout=120.0)
    except subprocess.TimeoutExpired:
        launch.send_signal(signal.SIGINT)
        said, _ = launch.communicate(timeout=30.0)
        raise AssertionError(f"it did not end by itself:\n{said}") from None
    return launch.returncode, said


def metadata(path: Path, name: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for record in read_log(path).metadata:
        found |= record.metadata if record.name == name else {}
    return found


@pytest.mark.slow
def test_a_launched_session_runs_its_time_and_leaves_a_whole_log(tmp_path: Path) -> None:
    code, said = ended(launched(tmp_path, "duration:=2", "controller:=passive", "namespace:=rig1"))
    assert code == 0, said
    assert "shutdown: session ended" in said and f"log: {tmp_path / 'session.mcap'}" in said
    log = read_log(tmp_path / "session.mcap")
    assert log.topics["/rig/displacement"].count == 1001, "2 s at 500 Hz, by names without the namespace"
    assert metadata(tmp_path / "session.mcap", "session")["complete"] == "true"
    told = json.dumps([record.metadata for record in log.metadata])
    assert "passive" in told and "rig1" in told


@pytest.mark.slow
def test_a_node_that_dies_ends_the_launch_with_its_name_and_a_finished_log(tmp_path: Path) -> None:
    launch = launched(tmp_path, "duration:=0", "mode:=realtime")
    part = tmp_path / "session.mcap.part"
    end = time.monotonic() + 60.0
    while not (part.exists() and part.stat().st_size > 200_000) and time.monotonic() < end:
        time.sleep(0.1)
    os.kill(estimator_of(launch.pid), signal.SIGKILL)
    code, said = ended(launch)
    assert code == 1 and "session failed: node estimator was killed by SIGKILL" in said
    session = metadata(tmp_path / "session.mcap", "session")
    assert session["complete"] == "false" and "estimator" in session["reason"], session


def estimator_of(launcher: int) -> int:
    """Process of the estimator among the launcher's children."""
    children = Path(f"/proc/{launcher}/task/{launcher}/children").read_text(encoding="ascii").split()
    named = {int(pid): Path(f"/proc/{pid}/cmdline").read_bytes() for pid in children}
    return next(pid for pid, command in named.items() if b"pneumo_ros.nodes.estimator" in command)
