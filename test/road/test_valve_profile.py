# SPDX-License-Identifier: Apache-2.0
"""A valve profile: read with one-line errors, looked up by time, played by a session and replayed byte by byte."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.sessions import run
from typer.testing import CliRunner

from pneumo_ros.cli.main import app
from pneumo_ros.control.half_car import CONTROLLERS, build_controller
from pneumo_ros.control.profile import ProfilePlayer, build_commander
from pneumo_ros.diagnosis.half_car.experiment import ROAD_FILE, VALVE_FILE, Experiment
from pneumo_ros.errors import InputError
from pneumo_ros.log.inspection import read_setups
from pneumo_ros.log.reading import read_log
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig
from pneumo_ros.road import build_road
from pneumo_ros.road.valve_profile import ValveProfile, read_profile
from pneumo_ros.session.replay import replay

RIG = load_rig()
REST, LARGEST = trim(RIG).command, RIG.inlet_area_max.value
HELD = "time_s,front_inlet_mm2,rear_inlet_m2\n0.5,1.0,2e-6\n1.0,3.0,4e-6\n"


def profile(folder: Path, text: str) -> ValveProfile:
    path = folder / "valves.csv"
    path.write_text(text)
    return read_profile(path, REST, LARGEST)


def test_rows_are_held_and_valves_without_a_column_stay_at_trim(tmp_path: Path) -> None:
    played = profile(tmp_path, HELD)
    for time, front, rear in (
        (0.0, 1e-6, 2e-6),
        (0.5, 1e-6, 2e-6),
        (0.999, 1e-6, 2e-6),
        (1.0, 3e-6, 4e-6),
        (9, 3e-6, 4e-6),
    ):
        np.testing.assert_allclose(played.at(time), [front, rear, *REST[2:]], rtol=1e-12)


def test_a_linear_profile_runs_straight_between_its_rows(tmp_path: Path) -> None:
    played = profile(tmp_path, "# interpolation: linear\n" + HELD)
    assert played.at(0.75)[0] == pytest.approx(2e-6) and played.at(0.75)[1] == pytest.approx(3e-6)
    assert played.at(0.2)[0] == pytest.approx(1e-6) and played.at(1.2)[0] == pytest.approx(3e-6)


def test_units_are_read_from_the_header(tmp_path: Path) -> None:
    played = profile(tmp_path, "time_s,rear_outlet_in2\n0,0.003\n")
    assert played.at(0.0)[3] == pytest.approx(0.003 * 0.0254**2) and played.at(0.0)[0] == REST[0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "needs a header"),
        ("0,1e-6\n1,2e-6\n", "no header"),
        ("time_s,front_inlet\n0,1e-6\n", "without a unit"),
        ("time_s,front_inlet_psi\n0,1e-6\n", "front_inlet_psi"),
        ("time_s,front_inlet_m2,front_inlet_mm2\n0,1e-6,1\n", "twice"),
        ("time_s,front_inlet_m2\n0,much\n", "line 2.*not a number"),
        ("time_s,front_inlet_m2\n0,nan\n", "line 2.*finite"),
        ("time_s,front_inlet_m2\n0,1e-6\n1\n", "line 3.*needs 2"),
        ("time_s,front_inlet_m2\n0,1e-6\n1,1e-6\n1,1e-6\n", "line 4.*increase"),
        ("time_s,front_inlet_m2\n0,1e-6\n1,-1e-9\n", "line 3.*cannot open so far.*front_inlet"),
        ("# a note\ntime_s,front_inlet_m2\n0,25.0\n", "line 3.*allowed: 0 to 1.6129e-05 m2"),
        ("# interpolation: cubic\ntime_s,front_inlet_m2\n0,1e-6\n", "cubic.*held or linear"),
    ],
)
def test_what_cannot_be_played_is_said_on_one_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        profile(tmp_path, text)
    assert "\n" not in str(caught.value) and "valves.csv" in str(caught.value)


def test_the_player_counts_samples_and_looks_at_no_estimate(tmp_path: Path) -> None:
    (tmp_path / "valves.csv").write_text(HELD)
    values = {"controller": "profile", "valve_profile": str(tmp_path / "valves.csv")}
    player = build_commander(RIG, 0.002, values)
    assert isinstance(player, ProfilePlayer)
    state, opened = player.init(np.ones(16)), []
    for k in range(600):
        state, command, _ = player.step(state, np.full(16, np.nan if k else 1.0))
        opened.append(command[0])
    assert opened[499] == pytest.approx(1e-6) and opened[500] == pytest.approx(3e-6)
    late = player.step(player.placed(player.init(), 500), np.zeros(16))
    assert late[1][0] == pytest.approx(3e-6)
    with pytest.raises(InputError, match="open loop"):
        build_controller(RIG, 0.002, values)
    assert "profile" not in CONTROLLERS
    with pytest.raises(InputError, match="--valves"):
        build_commander(RIG, 0.002, {"controller": "profile"})


def test_both_tables_of_the_next_experiment_can_be_read(tmp_path: Path) -> None:
    time = np.arange(6000) * 2e-3
    road = 0.004 * np.sin(np.outer(time, [3.0, 4.0]))
    valves = np.tile(REST, (6000, 1))
    valves[::3, 0] = LARGEST  # written with nine digits, still the largest opening
    wanted = Experiment("steps", "inlet steps", 30.0, 2.0, time, road, valves)
    assert {path.name for path in wanted.write(tmp_path)} == {ROAD_FILE, VALVE_FILE}
    played = read_profile(tmp_path / VALVE_FILE, REST, LARGEST)
    heights, _ = build_road({"kind": "file", "path": str(tmp_path / ROAD_FILE)}, wheelbase=0.5).sample(time)
    np.testing.assert_allclose(heights, road, atol=1e-9)
    np.testing.assert_allclose([played.at(t) for t in time], valves, rtol=1e-8)
    command = wanted.to_json()["command"]
    assert command == f"pneumo run --road {ROAD_FILE} --valves {VALVE_FILE} --duration 12"
    assert command in wanted.to_json()["text"]


@pytest.mark.slow
def test_a_session_plays_it_logs_it_and_replays_it(tmp_path: Path) -> None:
    valves, target = tmp_path / "valves.csv", tmp_path / "played.mcap"
    valves.write_text(HELD)
    options = ("--valves", str(valves), "--duration", "2", "--single-process", "--no-picture", "--no-report")
    code, said = run(*options, "--output", str(target))
    assert code == 0, said
    log = read_log(target)
    commands = log.select("/valve/command", ["front_inlet", "rear_inlet", "front_outlet", "rear_outlet"])
    time = (commands.stamp_ns - commands.stamp_ns[0]) * 1e-9
    played = read_profile(valves, REST, LARGEST)
    np.testing.assert_array_equal(commands.position, [played.at(t) for t in time])
    stated = [s.parameters["valves"] for s in read_setups(log) if "valves" in s.parameters]
    assert stated[0]["sha256"] == played.digest and stated[0]["interpolation"] == "held"
    assert all(a.identical for a in replay(log, valves=valves).agreements)


def test_what_cannot_be_played_is_refused_before_anything_starts(tmp_path: Path) -> None:
    good, wide = tmp_path / "valves.csv", tmp_path / "wide.csv"
    good.write_text(HELD)
    wide.write_text("time_s,front_inlet_mm2\n0,17\n")
    target = ("--output", str(tmp_path / "x.mcap"))
    for options, words in (
        (("--valves", str(good), "--controller", "passive"), "either a controller or a valve profile"),
        (("--valves", str(wide)), "cannot open so far"),
        (("--set", "controller.controller=profile"), "--valves"),
    ):
        result = CliRunner().invoke(app, ["run", *options, *target])
        assert isinstance(result.exception, InputError) and words in str(result.exception)
    assert not list(tmp_path.glob("x.*"))
