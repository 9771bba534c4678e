# SPDX-License-Identifier: Apache-2.0
"""Bad input is one line that names what, where, value, allowed range and remedy, with exit code 2; nothing starts."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

pytest.importorskip("rclpy")
from helpers import sessions

from pneumo_ros.cli.main import main

RIG = "rig:\n  sprung_mass: {{value: {mass}, std: 0.2, unit: {unit}}}\n"


def refused(tmp_path: Path, *options: str) -> str:
    """What the command says before it ends; in this process, as nothing is started."""
    words = ["pneumo", "run", "--domain", str(sessions.own_domain()), "--output", str(tmp_path / "session.mcap")]
    out = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(out):
        for name in ("NUMBA_CACHE_DIR", "PYTHONSAFEPATH"):  # the program sets them where they are not
            patch.setenv(name, os.environ.get(name, ""))
        patch.setattr(sys, "argv", [*words, *options])
        with pytest.raises(SystemExit) as ended:
            main()
    said = out.getvalue()
    assert ended.value.code == 2, said
    assert len(said.strip().splitlines()) == 1 and said.startswith("error: "), said
    assert list(tmp_path.glob("session*")) == []
    return said


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("plant:\n  ros__parameters: {durashun: 5.0}\n", ["durashun", "duration"]),
        ("plant:\n  ros__parameters: {duration: -5.0}\n", ["duration", "-5", "0 to 86400 s"]),
        ("plant:\n  ros__parameters: {duration: .nan}\n", ["duration", "nan"]),
        ("plant:\n  ros__parameters: {duration: long}\n", ["duration", "long"]),
        ("pump:\n  ros__parameters: {duration: 5.0}\n", ["pump", "controller"]),
        ("plant: 3\n", ["ros__parameters"]),
        ("plant: [\n", ["broken YAML", "line"]),
        ("just text", ["config/session.yaml"]),
    ],
)
def test_bad_config_file(tmp_path: Path, text: str, words: list[str]) -> None:
    config = tmp_path / "bad.yaml"
    config.write_text(text)
    said = refused(tmp_path, "--config", str(config))
    assert str(config) in said
    for word in words:
        assert word in said


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--config", "no_such_file.yaml"], ["no_such_file.yaml"]),
        (["--rig", "no_such_rig.yaml"], ["no_such_rig.yaml"]),
        (["--road", "Q"], ["Q", "sweep"]),
        (["--road", "no_such_road.csv"], ["no_such_road.csv"]),
        (["--controller", "pid"], ["pid", "first_order_smflc"]),
        (["--speed", "0"], ["speed_kmh", "1 to 300 km/h"]),
        (["--rate", "1e9"], ["rate_hz", "50 to 2000 Hz"]),
        (["--set", "controller.pole"], ["--set", "node.parameter=value"]),
        (["--set", "controller.pole=fast"], ["pole", "fast"]),
        (["--set", "controller.poll=3"], ["poll", "pole"]),
    ],
)
def test_bad_option(tmp_path: Path, options: list[str], words: list[str]) -> None:
    said = refused(tmp_path, *options)
    for word in words:
        assert word in said


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (RIG.format(mass=-1.0, unit="kg"), ["sprung_mass", "-1", "1 to 1000 kg"]),
        (RIG.format(mass=50.0, unit="lb"), ["sprung_mass.unit", "lb", "kg"]),
        (RIG.format(mass=".inf", unit="kg"), ["sprung_mass", "inf"]),
        (RIG.format(mass=900.0, unit="kg"), ["impossible trim", "supply_pressure"]),
        ("rig:\n  sprung_weight: {value: 1.0}\n", ["sprung_weight", "sprung_mass"]),
        ("body: 3\n", ["rig:"]),
    ],
)
def test_bad_rig(tmp_path: Path, text: str, words: list[str]) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text(text)
    said = refused(tmp_path, "--rig", str(rig))
    for word in words:
        assert word in said


def test_existing_log_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "taken.mcap"
    path.write_bytes(b"precious")
    code, said = sessions.run("--output", str(path))
    assert code == 2 and "exists" in said and said.startswith("error: ") and len(said.strip().splitlines()) == 1
    assert path.read_bytes() == b"precious"


@pytest.mark.parametrize("node", ["plant", "controller"])
def test_a_node_refuses_a_bad_parameter_on_its_own(node: str) -> None:
    result = subprocess.run(
        [sys.executable, "-m", f"pneumo_ros.nodes.{node}", "--ros-args", "-p", "rate_hz:=1.0e6"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert result.returncode == 2
    assert "rate_hz" in result.stderr and len(result.stderr.strip().splitlines()) == 1


def test_every_preset_is_made_of_parameters_the_nodes_have() -> None:
    from pneumo_ros.cli.session_plan import node_tables
    from pneumo_ros.control.presets import PRESETS, controller_settings
    from pneumo_ros.session.plan import assign

    tables = node_tables()
    for name in PRESETS:
        values = {node: {} for node in tables}
        for node, key, raw in controller_settings(name):
            assign(values, tables, node, key, raw, name)
        assert "controller" in values["controller"]
    assert values["estimator"]["known_surface"] is True, "the last preset uses the known surface"
