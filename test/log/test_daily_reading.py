# SPDX-License-Identifier: Apache-2.0
"""What a person reads of logs day by day: info and compare at 80 and 120 columns, merged tables, a replay of valves."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from helpers.rig_logs import noisy, simulated, write_log
from helpers.small_logs import STORE, STRING, T0, contract_log, header, text, write
from scipy.io import loadmat
from typer.testing import CliRunner

from pneumo_ros.cli.log import app
from pneumo_ros.cli.replay import app as replay_app
from pneumo_ros.errors import InputError
from pneumo_ros.log.comparison import align, compare
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.tables import merged
from pneumo_ros.log.topics import DIAGNOSTICS
from pneumo_ros.rig import load_rig


def said(*words: object, width: int = 80) -> str:
    done = CliRunner().invoke(app, [str(word) for word in words], env={"COLUMNS": str(width)})
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    """The same road twice, the second time a second later on a heavier rig; and another road."""
    folder = tmp_path_factory.mktemp("logs")
    clean, road, commands = simulated(6.0, 1)
    first = write_log(folder / "first.mcap", noisy(clean, 1), road, commands, [load_rig().to_yaml()])
    heavier = load_rig().with_values(sprung_mass=55.0).to_yaml()
    wait = [np.vstack([np.repeat(part[:1], 500, axis=0), part]) for part in (noisy(clean, 2), road, commands)]
    second = write_log(folder / "second.mcap", *wait, [heavier])
    other, its_road, its_commands = simulated(6.0, 2)
    third = write_log(folder / "third.mcap", noisy(other, 3), its_road, its_commands, [load_rig().to_yaml()])
    return first, second, third


@pytest.mark.parametrize("width", [80, 120])
def test_info_fits_the_terminal_and_tells_events_first(tmp_path: Path, width: int) -> None:
    text = said("info", write(tmp_path / "run.mcap", contract_log(300)), width=width)
    assert "…" not in text and max(map(len, text.splitlines())) <= width
    assert text.index("events") < text.index("Topics") < text.index("What explains the run")
    assert "/rig/displacement" in text and "500" in text


def test_what_every_node_began_with_is_said_once(tmp_path: Path) -> None:
    """Five nodes of a session, one of them with the session's metadata among its parameters; a change is the node's."""
    shared = "mode: lockstep, rate_hz: 500.0, session_id: 764b16"
    own = {"plant": "seed: 2", "controller": "pole: 10.0", "session_recorder": 'session: \'{"seed": "2"}\''}
    setups = [f"node: {node}\nparameters: {{{shared}, {one}}}\n" for node, one in own.items()]
    setups.append(f"node: controller\nparameters: {{{shared}, pole: 12.0}}\n")
    setups.append("node: controller\nparameters: {rate_hz: 250.0}\n")
    told = [("/rig/setup", STRING, T0 + i * 10**9, text(setup)) for i, setup in enumerate(setups)]
    lines = said("info", write(tmp_path / "run.mcap", [*contract_log(300), *told]), width=120).splitlines()
    words = [line for line in lines if "at the start" in line or "changed at" in line]
    assert [line.split(":")[0] for line in words] == [
        "every node at the start", "plant at the start", "controller at the start", "controller changed at 3.000 s",
        "controller changed at 4.000 s",
    ]  # fmt: skip
    assert "mode lockstep, rate_hz 500.0, session_id 764b16" in words[0]
    assert [line.split(": ")[1] for line in words[1:]] == ["seed 2", "pole 10.0", "pole 12.0", "rate_hz 250.0"]
    assert str(lines).count("764b16") == 1


def test_info_of_a_slow_line_fits_the_terminal_too(tmp_path: Path) -> None:
    """Messages that took from a hundredth to four tenths of a second: no column is cut."""
    late = [10**7 + 37 * 10**7 * (i // 40 % 2) for i in range(10_000)]
    messages = [
        (topic, kind, time + late[i], message) for i, (topic, kind, time, message) in enumerate(contract_log(300))
    ]
    metadata = {"session": {"complete": "true", "reason": ""}, "rosbag2": {"serialized_metadata": "a\nb"}}
    text = said("info", write(tmp_path / "run.mcap", sorted(messages, key=lambda one: one[2]), metadata))
    assert "…" not in text and max(map(len, text.splitlines())) <= 80
    assert ", 381" in text and "e+02" not in text and "serialized_metadata" not in text
    assert "session: complete true\n" in text


def test_logs_are_laid_over_each_other_by_their_road(logs: tuple[Path, Path, Path]) -> None:
    first, second, third = map(read_log, logs)
    assert align(first, second) == ("same", pytest.approx(1.0, abs=2e-3))
    assert align(first, third) == ("two", 0.0)
    gap = {s.column: s for s in compare(first, second).signals if s.topic == "/rig/displacement"}["sprung_front"]
    assert gap.unit == "m" and gap.rms < 3e-5  # two draws of 10 um


@pytest.mark.parametrize("width", [80, 120])
def test_compare_says_units_roads_and_rigs(logs: tuple[Path, Path, Path], width: int) -> None:
    text = said("compare", logs[0], logs[1], width=width)
    assert "two rigs: sprung_mass differ" in text and "same road; the second log is moved by -1.000 s" in text
    assert "kPa" in text and "mm2" in text and "nan" not in text and "…" not in text.split("Signals")[1]
    rows = [line.split() for line in text.split("Messages")[1].split("Signals")[0].splitlines()]
    assert ["/rig/displacement"] in [row[:1] for row in rows]
    assert all(row[1:3] != ["0", "0"] for row in rows), "a topic that neither log has is not equal byte by byte"
    other = said("compare", logs[0], logs[2], width=width)
    assert "two roads" in other and "session_id" not in other and "…" not in other.split("Signals")[1]


def test_one_merged_table_in_every_format(tmp_path: Path, logs: tuple[Path, Path, Path]) -> None:
    log = read_log(logs[0])
    content = merged(log)
    assert len(content["time"]) == 3000 and content["time"][1] == pytest.approx(2e-3)
    assert np.array_equal(content["/valve/command/front_inlet"], log.joint("/valve/command").position[:, 0])
    for kind in ("csv", "parquet", "mat"):
        said("export", logs[0], "-o", tmp_path, "-f", kind, "--merged")
    table = pyarrow.parquet.read_table(tmp_path / "first.parquet")
    pressure = content["/rig/front/pressure/fluid_pressure"]
    assert np.array_equal(table["/rig/front/pressure/fluid_pressure"].to_numpy(), pressure)
    matrix = loadmat(tmp_path / "first.mat")
    assert np.array_equal(matrix["rig_front_pressure_fluid_pressure"][:, 0], pressure)
    with (tmp_path / "first.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["/rig/front/pressure/fluid_pressure"]) for row in rows] == pressure.tolist()
    error = CliRunner().invoke(app, ["export", str(logs[0]), "-o", str(tmp_path), "-f", "csv", "--merged"]).exception
    assert isinstance(error, InputError) and "exists already" in str(error)


def test_messages_of_different_lengths_go_to_matlab(tmp_path: Path) -> None:
    """A session's events carry one value or several: cells that a message does not have were an error."""
    kinds = STORE.types
    values = [kinds["diagnostic_msgs/msg/KeyValue"]("code", code) for code in ("armed", "2")]
    messages = []
    for number, own in enumerate((values[:1], values)):
        status = kinds["diagnostic_msgs/msg/DiagnosticStatus"](1, "daq", f"message {number}", "", own)
        array = kinds[DIAGNOSTICS](header(10**9 + number), [status] * (number + 1))
        messages.append(("/rig/events", DIAGNOSTICS, 10**9 + number, array))
    write(tmp_path / "e.mcap", messages)
    said("export", tmp_path / "e.mcap", "-o", tmp_path, "-f", "mat")
    found = loadmat(tmp_path / "rig_events.mat", simplify_cells=True)
    assert list(found["status_0__message"]) == ["message 0", "message 1"]
    assert found["status_1__message"][1] == "message 1" and len(found["status_1__message"][0]) == 0
    assert np.isnan(found["status_1__level"][0]) and found["status_1__level"][1] == 1.0


def test_recorded_valves_play_through_any_rig(tmp_path: Path, logs: tuple[Path, Path, Path]) -> None:
    """The rig the log was made on gives the log again, to its noise; a heavier one does not."""
    same = CliRunner().invoke(replay_app, [str(logs[0]), "--open-loop"], env={"COLUMNS": "100"})
    assert same.exit_code == 0, same.output
    rows = [line.split() for line in same.output.splitlines() if line.strip().startswith(("sprung", "unsprung"))]
    assert len(rows) == 4 and all(float(row[-1]) < 0.02 for row in rows)
    assert all(row[1] == "mm" and 0.1 < float(row[2]) < 100.0 for row in rows)
    assert "kPa" in same.output and "e+0" not in same.output and "off by: rms difference" in same.output
    narrow = CliRunner().invoke(replay_app, [str(logs[0]), "--open-loop"], env={"COLUMNS": "80"}).output
    assert max(map(len, narrow.splitlines())) <= 80 and "off by, of std" in narrow
    (tmp_path / "heavy.yaml").write_text("rig: {sprung_mass: {value: 60.0, std: 0.1, unit: kg}}", encoding="utf-8")
    words = [str(logs[0]), "--open-loop", "--rig", str(tmp_path / "heavy.yaml")]
    heavy = CliRunner().invoke(replay_app, words, env={"COLUMNS": "100"})
    assert "leaves these out" in heavy.output
    other = [line.split() for line in heavy.output.splitlines() if line.strip().startswith("sprung_front")]
    assert float(other[0][-1]) > 0.3
    clash = CliRunner().invoke(replay_app, [str(logs[0]), "--open-loop", "--stepped"]).exception
    assert isinstance(clash, InputError) and "--open-loop" in str(clash)
