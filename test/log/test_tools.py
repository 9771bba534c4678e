# SPDX-License-Identifier: Apache-2.0
"""info, validate, recover, export and compare find what is planted in a log, and say so."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from helpers.practice import OTHER_WRITER, labels
from helpers.small_logs import (
    NAMES,
    PERIOD,
    STORE,
    T0,
    VALVES,
    Message,
    assert_accepted_by_other_readers,
    contract_log,
    joint,
    pressure,
    split_bag,
    text,
    write,
)
from typer.testing import CliRunner

from pneumo_ros.cli.log import app
from pneumo_ros.errors import InputError
from pneumo_ros.log.comparison import compare
from pneumo_ros.log.conformance import breaks_contract, check_conformance
from pneumo_ros.log.decoded import STRING
from pneumo_ros.log.inspection import inspect_log
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.repair import recover
from pneumo_ros.log.tables import export
from pneumo_ros.rig import load_rig

run = CliRunner().invoke


def replaced(messages: Sequence[Message], topic: str, at: int, message: object) -> list[Message]:
    rows = [i for i, m in enumerate(messages) if m[0] == topic]
    out = list(messages)
    out[rows[at]] = (topic, out[rows[at]][1], out[rows[at]][2], message)
    return out


def without(messages: Sequence[Message], topic: str, which: set[int]) -> list[Message]:
    rows = [i for i, m in enumerate(messages) if m[0] == topic]
    dropped = {rows[i] for i in which}
    return [m for i, m in enumerate(messages) if i not in dropped]


def found(path: Path, level: str) -> list[str]:
    return [f"{f.about}: {f.text}" for f in check_conformance(read_log(path)) if f.level == level]


def test_a_good_log_keeps_the_contract(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap", contract_log())
    assert not found(path, "error") and not found(path, "warning")
    result = run(app, ["validate", str(path)])
    assert result.exit_code == 0 and "0 error, 0 warning" in result.output


def test_the_practice_logs_keep_the_contract(practice: Callable[[str], Path]) -> None:
    paths = [OTHER_WRITER, *(practice(f"{label['name']}-{part}") for label in labels() for part in ("fit", "holdout"))]
    for path in paths:
        assert not breaks_contract(check_conformance(read_log(path))), path.name


BROKEN = {
    "gauge pressure in psi": (("/rig/front/pressure", 7, pressure(T0 + 7 * PERIOD, 25.4)), "wrong unit"),
    "height in inch": (("/rig/displacement", 7, joint(T0 + 7 * PERIOD, [1.8, 0, 0, 0])), "wrong unit"),
    "not a number": (("/rig/displacement", 7, joint(T0 + 7 * PERIOD, [np.nan, 0, 0, 0])), "not finite"),
    "negative area": (("/valve/command", 7, joint(T0 + 7 * PERIOD, [-1e-6] * 4, VALVES)), "outside 0 to"),
    "channel missing": (("/rig/displacement", 7, joint(T0 + 7 * PERIOD, [0.0] * 3, NAMES[:3])), "not finite"),
    "clock back": (("/road/profile", 7, joint(T0 - 10**9, [0, 0], ("front", "rear"), (0, 0))), "backwards"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_each_breach_is_an_error(tmp_path: Path, name: str) -> None:
    (topic, at, message), word = BROKEN[name]
    path = write(tmp_path / "a.mcap", replaced(contract_log(), topic, at, message))
    assert any(topic in line and word in line for line in found(path, "error"))
    assert run(app, ["validate", str(path)]).exit_code == 1


def test_a_little_out_of_order_is_a_warning(tmp_path: Path) -> None:
    late = ("/valve/command", 7, joint(T0, np.full(4, 1e-6), VALVES))
    path = write(tmp_path / "a.mcap", replaced(contract_log(), *late))
    assert any("backwards, by 0.012 s" in line for line in found(path, "warning")) and not found(path, "error")


def test_a_missing_topic_and_a_broken_config_are_errors(tmp_path: Path) -> None:
    messages = [m for m in contract_log() if m[0] != "/rig/rear/pressure"]
    messages[0] = ("/rig/config", STRING, T0, text("rig: {sprung_mass: {value: -3}}"))
    errors = found(write(tmp_path / "a.mcap", messages), "error")
    assert any("/rig/rear/pressure: the topic is missing" in e for e in errors)
    assert any("/rig/config" in e and "sprung_mass" in e for e in errors)


def test_gaps_are_counted(tmp_path: Path) -> None:
    log = read_log(write(tmp_path / "a.mcap", without(contract_log(), "/rig/front/pressure", {50, 51, 52, 120})))
    topics = {t.name: t for t in inspect_log(log).topics}
    timing = topics["/rig/front/pressure"].timing
    assert timing.missing == 4 and [round(g.length / 2e-3) for g in timing.gaps] == [4, 2]
    assert timing.gaps_in_words == "4 samples missing in 2 gaps, the longest 0.008 s"
    one = replace(timing, missing=1, gaps=timing.gaps[1:])
    assert one.gaps_in_words == "1 sample missing in 1 gap, the longest 0.004 s"
    assert replace(timing, missing=0, gaps=()).gaps_in_words == ""
    assert timing.gaps[0].start_ns == T0 + 49 * PERIOD and timing.rate_hz == pytest.approx(500.0)
    whole = topics["/rig/rear/pressure"].timing
    assert whole is not None and whole.missing == 0 and whole.delay_p50 == pytest.approx(1e-3) and whole.jumps == 0


def test_a_set_clock_is_seen(tmp_path: Path) -> None:
    messages = [(a, b, t + (3 * 10**9 if t > 1.3e9 else 0), m) for a, b, t, m in contract_log()]
    timing = {t.name: t.timing for t in inspect_log(read_log(write(tmp_path / "a.mcap", messages))).topics}
    road = timing["/road/profile"]
    assert road is not None and road.jumps == 1


def test_info_shows_what_explains_the_run(tmp_path: Path) -> None:
    kinds = STORE.types
    event = kinds["diagnostic_msgs/msg/DiagnosticStatus"](
        2, "plant", "pressure too high", "rig", [kinds["diagnostic_msgs/msg/KeyValue"]("code", "trip_pressure")]
    )
    message = kinds["diagnostic_msgs/msg/DiagnosticArray"](joint(T0, []).header, [event])  # type: ignore[attr-defined]
    rig = load_rig().with_values(sprung_mass=51.5)
    messages = [
        *contract_log(),
        ("/rig/config", STRING, T0 + 1, text(rig.to_yaml())),
        ("/rig/calibration", STRING, T0, text("sprung_front: {slope: -0.0270281}\n")),
        ("/rig/setup", STRING, T0, text("node: road_profile\ntime_ns: 1\nparameters: {seed: 11, road_class: D}\n")),
        ("/rig/setup", STRING, T0 + 10**8, text("node: controller\nparameters: {lambda: 20.0}\n")),
        ("/rig/events", "diagnostic_msgs/msg/DiagnosticArray", T0 + 5, message),
    ]
    path = write(tmp_path / "a.mcap", messages)
    result = run(app, ["info", str(path)], env={"COLUMNS": "150"})
    assert result.exit_code == 0, result.output
    for word in (
        "trip_pressure",
        "pressure too high",
        "seed",
        "11",
        "lambda",
        "20.0",
        "51.5 (nominal 50.33)",
        "-0.0270281",
    ):
        assert word in result.output, word
    assert '"code": "trip_pressure"' in run(app, ["info", str(path), "--json"]).output


def test_a_bag_of_ros2_can_be_inspected_and_validated(tmp_path: Path) -> None:
    bag = split_bag(tmp_path / "bag")
    assert "/rosout_like" in run(app, ["info", str(bag)]).output
    result = run(app, ["validate", str(bag)])
    assert result.exit_code == 1 and "/valve/command: the topic is missing" in result.output


def test_recover_keeps_what_is_sound_and_says_what_is_lost(tmp_path: Path) -> None:
    source = write(tmp_path / "a.mcap", contract_log(), chunk_size=16384)
    data = bytearray(source.read_bytes())
    data[len(data) // 2] ^= 4
    source.write_bytes(bytes(data))
    result = recover(source, tmp_path / "b.mcap")
    assert source.read_bytes() == bytes(data)
    assert not result.whole and len(result.salvaged.losses) == 1
    assert result.kept + (result.salvaged.lost or 0) == 1501
    assert_accepted_by_other_readers(result.output, result.kept)
    record = {m.name: m.metadata for m in read_log(result.output).metadata}["recovery"]
    assert record["messages_lost"] == str(result.salvaged.lost) and "log times" in record["loss_0"]


def test_recover_of_a_killed_recorders_file(tmp_path: Path) -> None:
    """Cut in the last third: everything before the cut's chunk is there, in order."""
    source = write(tmp_path / "a.mcap", contract_log(), chunk_size=4096)
    whole = read_log(source)
    (tmp_path / "a.mcap.part").write_bytes(source.read_bytes()[: int(source.stat().st_size * 0.6)])
    result = run(app, ["recover", str(tmp_path / "a.mcap.part"), "--output", str(tmp_path / "b.mcap")])
    assert result.exit_code == 0 and "without its footer" in result.output
    part = read_log(tmp_path / "b.mcap")
    ours, all_of_it = part.joint("/rig/displacement").position, whole.joint("/rig/displacement").position
    assert 100 < len(ours) < len(all_of_it) and np.array_equal(ours, all_of_it[: len(ours)])


def test_recover_refuses_to_overwrite(tmp_path: Path) -> None:
    source = write(tmp_path / "a.mcap", contract_log(5))
    with pytest.raises(InputError, match="input itself"):
        recover(source, source, overwrite=True)
    with pytest.raises(InputError, match="exists already"):
        recover(source, write(tmp_path / "b.mcap", contract_log(3)))
    (tmp_path / "c.mcap").write_bytes(b"no log at all")
    with pytest.raises(InputError, match="not an MCAP"):
        recover(tmp_path / "c.mcap", tmp_path / "d.mcap")
    assert not (tmp_path / "d.mcap").exists()


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_tables_read_back_to_the_same_numbers(tmp_path: Path, kind: str) -> None:
    log = read_log(write(tmp_path / "a.mcap", contract_log(50)))
    paths = export(log, tmp_path / "out", kind)
    assert {p.name for p in paths} >= {f"rig_displacement.{kind}", f"rig_config.{kind}"}
    path = tmp_path / "out" / f"rig_displacement.{kind}"
    frame = pd.read_csv(path, float_precision="round_trip") if kind == "csv" else pd.read_parquet(path)
    joint_state = log.joint("/rig/displacement")
    assert list(frame.columns) == ["log_time_ns", "stamp_ns", *NAMES]
    assert np.array_equal(frame[list(NAMES)].to_numpy(), joint_state.position)
    assert np.array_equal(frame["stamp_ns"].to_numpy(), joint_state.stamp_ns)
    with pytest.raises(InputError, match="exists already"):
        export(log, tmp_path / "out", kind)
    with pytest.raises(InputError, match="allowed: csv, parquet"):
        export(log, tmp_path / "other", "xls")


def test_compare_finds_settings_and_signals(tmp_path: Path) -> None:
    first = write(
        tmp_path / "a.mcap", [*contract_log(), ("/rig/setup", STRING, T0, text("node: c\nparameters: {g: 1}"))]
    )
    other = [*contract_log(gain=2.0), ("/rig/setup", STRING, T0, text("node: c\nparameters: {g: 2}"))]
    other[0] = ("/rig/config", STRING, T0, text(load_rig().with_values(sprung_mass=52.0).to_yaml()))
    second = write(tmp_path / "b.mcap", [m for m in other if m[0] != "/valve/command"])
    result = compare(read_log(first), read_log(second))
    assert result.only_first == ("/valve/command",) and not result.only_second
    settings = {(d.where, d.key): (d.first, d.second) for d in result.settings}
    assert settings == {("rig", "sprung_mass"): (50.33, 52.0), ("c", "g"): (1, 2)}
    assert set(result.identical) == {"/road/profile", "/rig/front/pressure", "/rig/rear/pressure"}
    signals = {(s.topic, s.column): s for s in result.signals}
    moved, same = signals["/rig/displacement", "sprung_front"], signals["/road/profile", "front"]
    assert moved.common == 300 and moved.rms == pytest.approx(1e-3, rel=0.2) and same.largest == 0.0
    assert run(app, ["compare", str(first), str(second)]).exit_code == 0


def test_a_damaged_log_ends_with_one_line(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap", contract_log(5))
    path.write_bytes(path.read_bytes()[:-9])
    result = run(app, ["info", str(path)])
    assert isinstance(result.exception, InputError) and "pneumo log recover" in str(result.exception)
