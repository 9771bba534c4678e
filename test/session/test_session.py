# SPDX-License-Identifier: Apache-2.0
"""Whole sessions over real DDS: complete, repeatable, readable, and honest when something dies."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy")
import yaml
from helpers import sessions
from mcap_ros2.reader import read_ros2_messages
from rosbags.highlevel import AnyReader

from pneumo_ros.log import topics
from pneumo_ros.log.reading import read_log

DURATION = 3.0
SAMPLES = 1501
PERIOD_NS = 2_000_000
ONE_CHUNK = 100_000  # bytes that a log exceeds once a chunk of it is on the disk: 200 kB, a second of driving
LOG_ALONE = ("--no-summary", "--no-picture", "--no-report")  # of sessions that are looked at for how they end


@pytest.fixture(scope="module")
def processes_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("processes") / "session.mcap"
    code, said = sessions.run("--duration", str(DURATION), "--seed", "5", "--output", str(path), *LOG_ALONE[1:])
    assert code == 0, said
    assert "heave accel." in said
    return path


@pytest.fixture(scope="module")
def single_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("single") / "session.mcap"
    code, said = sessions.run(
        "--duration", str(DURATION), "--seed", "5", "--output", str(path), "--single-process", *LOG_ALONE
    )
    assert code == 0, said
    return path


@pytest.mark.slow
@pytest.mark.parametrize("which", ["processes_log", "single_log"])
def test_no_message_is_lost_and_stamps_increase(which: str, request: pytest.FixtureRequest) -> None:
    log = read_log(request.getfixturevalue(which))
    for topic in topics.EVERY_PERIOD:
        records = log.pressure(topic.name) if topic.type == topics.PRESSURE else log.joint(topic.name)
        steps = np.diff(records.stamp_ns)
        assert len(steps) >= SAMPLES - 1, topic.name
        assert np.all(steps == PERIOD_NS), topic.name
    assert log.config is not None and log.config.name == "half-car-2m2a"
    assert log.topics["/rig/setup"].count >= 5


@pytest.mark.slow
def test_other_readers_take_the_log(processes_log: Path) -> None:
    with AnyReader([processes_log]) as reader:
        counts = {c.topic: c.msgcount for c in reader.connections}
        assert counts["/rig/displacement"] == SAMPLES
        assert sum(1 for _ in reader.messages()) == reader.message_count
    with AnyReader([processes_log.parent]) as bag:  # through metadata.yaml
        assert bag.message_count == sum(counts.values())
    theirs = sum(1 for m in read_ros2_messages(str(processes_log)) if m.channel.topic == "/valve/command")
    assert theirs == SAMPLES


@pytest.mark.slow
def test_channels_carry_qos_and_type_hash(processes_log: Path) -> None:
    info = read_log(processes_log).topics["/rig/displacement"]
    assert info.type_hash.startswith("RIHS01_")
    assert yaml.safe_load(info.qos)[0]["reliability"] == "reliable"


@pytest.mark.slow
def test_metadata_explains_the_run(processes_log: Path) -> None:
    records = {m.name: m.metadata for m in read_log(processes_log).metadata}
    assert records["session"]["complete"] == "true"
    assert records["pneumo_ros"]["seed"] == "5" and "numpy" in records["versions"]
    assert "rosbag2" in records
    setups = [yaml.safe_load(text) for text in read_log(processes_log).texts("/rig/setup")]
    assert any(s.get("road", {}).get("seed") == 5 for s in setups)


@pytest.mark.slow
def test_same_seed_gives_equal_bytes_whatever_the_processes(processes_log: Path, single_log: Path) -> None:
    one, two = read_log(processes_log), read_log(single_log)
    for topic in (*topics.MEASUREMENTS, topics.COMMAND, topics.ESTIMATE, topics.TRUTH):
        np.testing.assert_array_equal(one.records(topic.name).data, two.records(topic.name).data, topic.name)


@pytest.mark.slow
@pytest.mark.parametrize("victim", ["controller", "plant"])
def test_killing_a_node_leaves_a_readable_log(tmp_path: Path, victim: str) -> None:
    path = tmp_path / "session.mcap"
    process = sessions.start("--duration", "0", "--output", str(path), *LOG_ALONE)
    sessions.wait_for(process, path.with_name("session.mcap.part"), ONE_CHUNK)
    sessions.kill(sessions.children(process.pid)[victim])
    said, _ = process.communicate(timeout=60)
    assert process.returncode != 0
    assert victim in said and "SIGKILL" in said
    log = read_log(path)
    assert log.topics["/rig/displacement"].count > 100
    records = {m.name: m.metadata for m in log.metadata}
    assert records["session"]["complete"] == "false" and victim in records["session"]["reason"]


@pytest.mark.slow
def test_killing_the_recorder_leaves_a_readable_log_that_says_so(tmp_path: Path) -> None:
    path = tmp_path / "session.mcap"
    process = sessions.start("--duration", "0", "--output", str(path), *LOG_ALONE)
    part = path.with_name("session.mcap.part")
    sessions.wait_for(process, part, ONE_CHUNK)
    sessions.kill(sessions.children(process.pid)["session_recorder"])
    said, _ = process.communicate(timeout=60)
    assert process.returncode != 0 and "session_recorder" in said
    assert not path.exists(), "a log that was cut off must not look complete"
    recovered = path.with_name("session.recovered.mcap")
    assert str(recovered) in "".join(said.split())
    assert read_log(recovered).topics["/rig/displacement"].count > 100


@pytest.mark.slow
def test_an_impatient_user_ends_it_as_well_as_a_patient_one(tmp_path: Path) -> None:
    """Ctrl-C a hundred times a second, from the first to the last moment: one of them meets every stage of the end."""
    path = tmp_path / "session.mcap"
    process = sessions.start("--duration", "0", "--output", str(path))
    sessions.wait_for(process, path.with_name("session.mcap.part"), ONE_CHUNK)
    end = time.monotonic() + 60.0
    while process.poll() is None and time.monotonic() < end:
        process.send_signal(signal.SIGINT)
        time.sleep(0.01)
    said, _ = process.communicate(timeout=5)
    assert process.returncode == 0 and "Traceback" not in said, said
    assert "the log is finished" in said and "no report was made" in said, said
    assert read_log(path).topics["/rig/displacement"].count > 100


@pytest.mark.slow
def test_a_rig_that_somebody_stops_is_told(tmp_path: Path) -> None:
    """The node that is the rig ends the session when it is asked to; a timed one is cut short, see below."""
    path = tmp_path / "session.mcap"
    process = sessions.start("--duration", "0", "--output", str(path), *LOG_ALONE)
    sessions.wait_for(process, path.with_name("session.mcap.part"), ONE_CHUNK)
    os.kill(sessions.children(process.pid)["plant"], signal.SIGINT)
    said, _ = process.communicate(timeout=60)
    assert process.returncode == 0 and "ended node plant" in " ".join(said.split()), said
    assert read_log(path).topics["/rig/displacement"].count > 100


@pytest.mark.slow
def test_a_session_that_was_cut_short_stays_so_without_its_report(tmp_path: Path) -> None:
    path = tmp_path / "session.mcap"
    process = sessions.start("--duration", "60", "--output", str(path))
    sessions.wait_for(process, path.with_name("session.mcap.part"), ONE_CHUNK)
    os.kill(sessions.children(process.pid)["plant"], signal.SIGINT)
    assert process.stdout is not None
    said = next(line for line in process.stdout if "cut short" in line)
    while process.poll() is None:
        process.send_signal(signal.SIGINT)
        time.sleep(0.01)
    said += process.stdout.read()
    assert process.returncode == 1 and "no report was made" in said and "Traceback" not in said, said
    assert "cut short after" in " ".join(said.split()), said
    assert read_log(path).topics["/rig/displacement"].count > 100


@pytest.mark.slow
def test_nodes_and_dashboard_end_when_their_supervisor_is_killed(tmp_path: Path) -> None:
    pytest.importorskip("bokeh")
    path = tmp_path / "session.mcap"
    process = sessions.start("--duration", "0", "--output", str(path), *LOG_ALONE, "--view")
    sessions.wait_for(process, path.with_name("session.mcap.part"), ONE_CHUNK)
    started = sessions.children(process.pid)
    assert len(started) == 6 and "view" in started
    sessions.kill(process.pid)
    process.communicate(timeout=60)
    end = time.monotonic() + 30.0
    while left := [name for name, pid in started.items() if Path(f"/proc/{pid}").exists()]:
        assert time.monotonic() < end, f"{left} live on without their supervisor"
        time.sleep(0.1)
    assert read_log(path).topics["/rig/displacement"].count > 100


@pytest.mark.slow
@pytest.mark.realtime
def test_real_time_session_keeps_the_clock_and_takes_live_gains(tmp_path: Path) -> None:
    """Gains change while it runs and the change is logged; a bad one is refused; missed periods are counted."""
    path = tmp_path / "session.mcap"
    domain = sessions.own_domain()
    process = sessions.start("--realtime", "--duration", "6", "--output", str(path), *LOG_ALONE, domain=domain)
    sessions.wait_for(process, path.with_name("session.mcap.part"), ONE_CHUNK)
    with sessions.parameters_of(domain, "controller") as ask:
        assert ask("pole", 14.0) == ""
        assert "out of range" in ask("pole", 1e9)
        assert ask("controller", "passive") != "", "read-only"
    said, _ = process.communicate(timeout=60)
    assert process.returncode == 0, said
    log = read_log(path)
    setups = [yaml.safe_load(text) for text in log.texts("/rig/setup")]
    poles = [s["parameters"]["pole"] for s in setups if s["node"] == "controller"]
    assert poles == [10.0, 14.0]
    stamps = log.joint("/rig/displacement").stamp_ns
    assert np.all(np.diff(stamps) > 0) and np.all(np.diff(stamps) % PERIOD_NS == 0), "skipped whole periods only"
    assert (stamps[-1] - stamps[0]) * 1e-9 == pytest.approx(6.0, abs=0.5)
    last = [s for _, m in log.messages("/diagnostics") for s in m.status if s.name == "plant: loop"][-1]
    values = {v.key: v.value for v in last.values}
    assert int(values["missed periods"]) >= 0 and float(values["period p50 (us)"]) > 1000.0
