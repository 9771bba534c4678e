# SPDX-License-Identifier: Apache-2.0
"""What a wrong word costs and says: one line, the whole list, the nearest name, and nothing heavy imported for it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from pneumo_ros.cli.app import program
from pneumo_ros.cli.existing import DIAGNOSIS_FILES
from pneumo_ros.cli.main import VERBS
from pneumo_ros.diagnosis.report.outputs import FILES
from pneumo_ros.diagnosis.report.steps import Asked

# What takes longest to import, each a few tenths of a second or more.
HEAVY = ("rclpy", "scipy.stats", "scipy.signal", "scipy.optimize", "matplotlib", "bokeh.models", "pandas", "dask")
NUMERIC = (*HEAVY, "numpy", "numba", "scipy")
WATCHED = """
import json, sys
from pneumo_ros.cli.main import main
sys.argv = ["pneumo", *sys.argv[1:]]
try:
    main()
except SystemExit as end:
    code = end.code
loaded = [name for name in %r if name in sys.modules]
print("LOADED " + json.dumps([code, loaded]), file=sys.stderr)
"""


def pneumo(*words: str, cwd: Path) -> tuple[int, str, set[str]]:
    """(exit code, what it said, heavy modules it imported)."""
    code = WATCHED % (NUMERIC,)
    done = subprocess.run([sys.executable, "-c", code, *words], cwd=cwd, capture_output=True, text=True, timeout=60)
    said, _, last = (done.stdout + done.stderr).rpartition("LOADED ")
    exit_code, loaded = json.loads(last)
    return int(exit_code or 0), said, set(loaded)


def test_the_list_of_verbs_needs_nothing(tmp_path: Path) -> None:
    code, said, loaded = pneumo("--help", cwd=tmp_path)
    assert code == 0 and not loaded
    assert all(verb in said for verb in VERBS)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["diagnos"], ["no such verb", "did you mean 'diagnose'?", *VERBS]),
        (["run", "--controller", "smfcl"], ["did you mean 'smflc'?", "two_valve", "passive", "third_order_smc"]),
        (["run", "--road", "swep"], ["did you mean 'sweep'?", "A, B, C, D", "flat", ".csv"]),
        (["run", "--source", "serail"], ["did you mean 'serial'?"]),
        (["emulate", "--road", "bmp"], ["did you mean 'bump'?"]),
        (["emulate", "--fault", "stuk@1"], ["did you mean 'stuck'?", "converter"]),
        (["emulate", "--fault", "stuck@-1"], ["before the first arming", "stuck@-1"]),
        (
            ["log", "inf"],
            ["no such verb", "did you mean 'info'?", "validate", "recover", "export", "compare", "report"],
        ),
        (["run", "--controller", "smfcl", "-o", "x.mcap"], ["did you mean 'smflc'?"]),
        (["thesis", "9"], ["no such chapter", "beyond"]),
        (["blind", "score", "nowhere"], ["nowhere"]),
        (["calibrate", "nowhere.csv"], ["nowhere.csv"]),
        (["view", "nowhere.mcap"], ["nowhere.mcap"]),
        (["log", "info", "nowhere.mcap"], ["nowhere.mcap"]),
        (["replay", "nowhere.mcap"], ["nowhere.mcap"]),
        (["diagnose", "nowhere.mcap", "-o", "out"], ["nowhere.mcap"]),
        (["diagnose", "text.mcap", "-o", "out"], ["text.mcap", "not an MCAP file"]),
    ],
)
def test_a_mistake_is_told_at_once(tmp_path: Path, words: list[str], told: list[str]) -> None:
    (tmp_path / "text.mcap").write_text("no log", encoding="utf-8")
    code, said, loaded = pneumo(*words, cwd=tmp_path)
    assert code == 2 and not loaded & set(HEAVY), loaded
    assert said.count("\n") == 1 and all(word in said for word in told), said
    assert not (tmp_path / "out").exists()


def test_help_fills_the_lines_of_the_terminal(tmp_path: Path) -> None:
    """A paragraph of help breaks where the terminal ends, not where the source did."""
    command = [sys.executable, "-m", "pneumo_ros.cli.main", "diagnose", "--help"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env={**os.environ, "COLUMNS": "80"})
    lines = [line.strip() for line in done.stdout.partition("About 20 s")[2].partition("╭")[0].splitlines()]
    told = [line for line in lines if line]
    assert len(told) >= 4 and all(50 < len(line) <= 80 for line in told[:-1]), told


def test_what_refuses_to_overwrite_knows_what_is_written() -> None:
    assert DIAGNOSIS_FILES == FILES


def test_a_command_to_copy_is_one_that_the_shell_finds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """After `make demo` nobody has .venv/bin on the path."""
    script = tmp_path / "bin" / "pneumo"
    script.parent.mkdir()
    script.write_text("#!/bin/sh\n")
    script.chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["bin/pneumo"])
    monkeypatch.setenv("PATH", "/usr/bin:/bin")
    assert program() == "bin/pneumo"
    assert Asked(program=program()).session("--road", "E", output=Path("x.mcap")).startswith("bin/pneumo run --road E")
    monkeypatch.setenv("PATH", str(script.parent))
    assert program() == "pneumo"
    monkeypatch.setattr(sys, "argv", ["-m"])
    assert program() == "pneumo"
