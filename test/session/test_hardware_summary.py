# SPDX-License-Identifier: Apache-2.0
"""A session without truth is judged from its sensors, says so, and warns of what a reader must know."""

from __future__ import annotations

import dataclasses
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from helpers.small_logs import STORE, contract_log, write
from rich.console import Console

from pneumo_ros.cli.passive import passive_run
from pneumo_ros.cli.tables import summary_table, timing_table
from pneumo_ros.control.half_car import build_controller
from pneumo_ros.control.loop import close_loop
from pneumo_ros.estimation.half_car import build_estimator
from pneumo_ros.log.decoded import Log
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.topics import DIAGNOSTICS
from pneumo_ros.plant.sensors import truth
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig
from pneumo_ros.road import build_road
from pneumo_ros.session.picture import draw_session
from pneumo_ros.session.report.contents import loop_rows
from pneumo_ros.session.summary import (
    Recorded,
    change,
    counts_missed,
    figures,
    load_session,
    pace,
    summarise,
)
from pneumo_ros.session.warnings import warnings_of

PERIOD = 2e-3


@pytest.fixture(scope="module")
def simulated() -> Recorded:
    """5 s in closed loop on a class D road, with truth."""
    rig = load_rig()
    car, _ = nominal_half_car(rig)
    times = np.arange(2501) * PERIOD
    road = build_road({"kind": "iso", "iso_class": "D"}, wheelbase=rig.wheelbase).sample(times)[0]
    run = close_loop(car, rig, build_estimator(rig, PERIOD), build_controller(rig, PERIOD), road, seed=1)
    known = np.array([truth(car, x, u, z) for x, u, z in zip(run.states, run.commands, road, strict=False)])
    t = times[:-1]
    return Recorded(rig, t, run.commands, t, run.estimates, t, known, t, road[:-1], t, run.measurements, "realtime")


@pytest.fixture
def hardware(simulated: Recorded) -> Recorded:
    return dataclasses.replace(simulated, truth_time=np.empty(0), truth=np.empty((0, 16)))


def said(table: object, width: int = 80) -> str:
    out = StringIO()
    Console(file=out, width=width).print(table)
    return out.getvalue()


def test_sensors_tell_nearly_what_the_truth_does(simulated: Recorded, hardware: Recorded) -> None:
    known, seen = summarise(simulated).ride, summarise(hardware)
    assert known is not None and seen.ride is not None and seen.judged_by == "sensors"
    assert seen.ride.heave_rms == pytest.approx(known.heave_rms, rel=0.1)
    assert seen.ride.pitch_rms == pytest.approx(known.pitch_rms, rel=0.1)
    np.testing.assert_allclose(seen.ride.tyre_load_variation, known.tyre_load_variation, rtol=0.01)
    np.testing.assert_allclose(seen.ride.workspace, known.workspace, rtol=0.02)


@pytest.mark.parametrize("width", [80, 120])
def test_the_table_of_hardware_says_what_it_is_from(hardware: Recorded, width: int) -> None:
    text = said(summary_table(summarise(hardware), None), width)
    assert "from the LVDTs, without truth" in text and "tyre load variation" in text and "…" not in text
    assert "full scale (x 5)" in text


@pytest.mark.parametrize("width", [80, 120])
def test_the_table_beside_passive_valves_is_whole(simulated: Recorded, width: int) -> None:
    """Both ratings have left their scale: the widest row there is."""
    ours = summarise(simulated)
    assert ours.ride is not None and not ours.ride.rated
    theirs = dataclasses.replace(ours.ride, tyre_load_variation=tuple(0.45 * v for v in ours.ride.tyre_load_variation))
    text = said(summary_table(ours, dataclasses.replace(ours, ride=theirs)), width)
    assert "+122 % / +122 %" in text
    assert "…" not in text and text.count("out of its range") == 2 and max(map(len, text.splitlines())) <= width


def test_hardware_is_held_against_passive_valves_and_drawn(hardware: Recorded, tmp_path: Path) -> None:
    other = passive_run(hardware)
    assert other is not None and len(other.truth) > 100
    draw_session(hardware, tmp_path / "hardware.png", other)
    assert (tmp_path / "hardware.png").stat().st_size > 50_000


def test_full_scale_is_the_rig_files(simulated: Recorded) -> None:
    small = dataclasses.replace(simulated, rig=simulated.rig.with_values(length_scale=4.0))
    ours, theirs = summarise(small).ride, summarise(simulated).ride
    assert ours is not None and theirs is not None
    assert ours.full_scale_heave_rms == pytest.approx(0.8 * theirs.full_scale_heave_rms)
    assert "full scale (x 4)" in said(summary_table(summarise(small), None))


def test_of_a_long_session_the_last_stretch_is_read_and_said(tmp_path: Path) -> None:
    log = write(tmp_path / "long.mcap", contract_log(2000))
    whole, late = load_session(log), load_session(log, longest=3.0)
    assert not whole.left_out and late.left_out == pytest.approx(whole.time[-1] - 3.0, abs=0.01)
    rows = len(late.time)
    assert rows == pytest.approx(3.0 / PERIOD, abs=2)
    for name in ("command", "measured", "road"):
        np.testing.assert_array_equal(getattr(late, name), getattr(whole, name)[-rows:])
    two_hours = dataclasses.replace(late, left_out=7200.0 - 3.0)
    assert "The last 0 min of 2.0 h" in said(summary_table(summarise(two_hours), None))
    assert summarise(two_hours, wall=7200.0).speed == pytest.approx(1.0, abs=1e-3)


def test_a_rating_that_left_its_scale_is_no_zero(simulated: Recorded) -> None:
    ride = summarise(simulated).ride
    assert ride is not None and not ride.rated and ride.full_scale_heave_rms > 0.136 * 9.81
    assert "out of its range" in said(summary_table(summarise(simulated), None))


def test_a_large_change_is_a_factor() -> None:
    assert change([55.97], [1.0]) == "x 56" and change([0.5, 1.2], [1.0, 1.0]) == "-50 % / +20 %"
    assert change([0.36, 1.0], [1e-15, 2e-15]) == ""  # a flat road: nothing moves by itself
    assert figures([float("nan")], "%.2f") == "out of its range"


@pytest.mark.parametrize(
    ("mode", "speed", "missed", "told"),
    [
        ("realtime", 1.0, "0", "in real time (factor 1.00)"),
        ("realtime", 0.9, "31", "in real time (factor 0.90): periods were missed"),
        ("realtime", 0.9, "0", "in real time (factor 0.90): samples are missing at the start or end of the log"),
        ("realtime", float("nan"), "0", "in real time; stopped before its end, so without a factor"),
        ("lockstep", 4.2, "0", "at 4.2 x real time"),
    ],
)
def test_the_pace_says_why(simulated: Recorded, mode: str, speed: float, missed: str, told: str) -> None:
    loop = {"plant": {"steps": "100", "missed periods": missed}}
    summary = dataclasses.replace(summarise(simulated, loop), mode=mode, speed=speed)
    assert pace(summary).endswith(told)
    shown = said(timing_table(summary), 120)
    assert ("missed" in shown.replace("were missed", "")) == (mode == "realtime")
    assert "steps: up to each node's last report" in shown  # why the nodes' counts differ


def test_a_board_that_samples_has_no_column_of_missed_periods(simulated: Recorded) -> None:
    """Its nodes answer to samples and have no periods of their own; an empty column would read as none missed."""
    summary = dataclasses.replace(summarise(simulated, {"daq": {"steps": "100"}}), mode="realtime", speed=1.0)
    assert "missed" not in said(timing_table(summary), 120) and not counts_missed(summary)
    assert all(len(row) == 8 for row in loop_rows(summary))


def test_estimates_that_end_with_the_session_are_no_warning(tmp_path: Path) -> None:
    late = (1, "estimate_stale", "no estimate for 24 ms: safe command")
    log = log_of_events(tmp_path / "e.mcap", (0, "session_complete", "the session's duration has passed"), late)
    assert warnings_of(log, {}, "realtime") == ()
    other = log_of_events(tmp_path / "f.mcap", late, (0, "session_complete", "the session's duration has passed"))
    assert len(warnings_of(other, {}, "realtime")) == 1


def log_of_events(path: Path, *events: tuple[int, str, str]) -> Log:
    """A log that holds nothing but events: (level, code, message)."""
    kinds = STORE.types
    stamp = kinds["builtin_interfaces/msg/Time"](1, 0)
    out = []
    for number, (level, code, message) in enumerate(events):
        values = [kinds["diagnostic_msgs/msg/KeyValue"]("code", code)]
        status = kinds["diagnostic_msgs/msg/DiagnosticStatus"](level, "daq", message, "", values)
        array = kinds[DIAGNOSTICS](kinds["std_msgs/msg/Header"](stamp, ""), [status])
        out.append(("/rig/events", DIAGNOSTICS, 10**9 + number, array))
    return read_log(write(path, out))


def test_warnings_count_what_went_wrong(tmp_path: Path) -> None:
    log = log_of_events(tmp_path / "e.mcap", (1, "estimate_stale", "late"), (2, "command_stale", "no fresh command"))
    loop = {"plant": {"steps": "990", "missed periods": "10"}, "daq": {"refused commands": "7"}}
    told = warnings_of(log, loop, "realtime")
    assert told[0].startswith("plant missed 10 of 1000 periods (1.0%)")
    assert told[1].startswith("once no estimate") and told[2].startswith("7 commands were refused by the driver")
    assert told[3] == "error: no fresh command"
    one = warnings_of(log, {"daq": {"commands the board refused": "1"}}, "realtime")
    assert "1 command was refused by the board" in one
    assert not any("missed" in line for line in warnings_of(log, loop, "lockstep"))
