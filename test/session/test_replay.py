# SPDX-License-Identifier: Apache-2.0
"""Replay gives the recorded bytes again, says what other gains would have done, and plays live in step."""

from __future__ import annotations

import dataclasses
import os
import pty
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from helpers.small_logs import assert_accepted_by_other_readers, contract_log, write
from typer.testing import CliRunner

from pneumo_ros.cli.replay import app
from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.log.comparison import same_payload
from pneumo_ros.log.decoded import Log
from pneumo_ros.log.inspection import read_events
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.records import Records
from pneumo_ros.log.rewriting import write_log
from pneumo_ros.session.replay import replay
from pneumo_ros.session.rerun import compare_channels, rerun
from pneumo_ros.session.transport import SECOND, Transport
from pneumo_ros.session.what_if import CAVEAT

rclpy = pytest.importorskip("rclpy")
from helpers.sessions import own_context, own_domain  # noqa: E402
from rclpy.context import Context  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from std_msgs.msg import Bool  # noqa: E402

from pneumo_ros.nodes.base import StopRequest  # noqa: E402
from pneumo_ros.nodes.controller import ControllerNode  # noqa: E402
from pneumo_ros.nodes.estimator import EstimatorNode  # noqa: E402
from pneumo_ros.nodes.plant import PlantNode  # noqa: E402
from pneumo_ros.nodes.qos import recorded_qos  # noqa: E402
from pneumo_ros.nodes.replay import Player, transport_of  # noqa: E402
from pneumo_ros.nodes.road_profile import RoadProfileNode  # noqa: E402
from pneumo_ros.nodes.session_recorder import SessionRecorderNode  # noqa: E402
from pneumo_ros.nodes.spin import make_executor, spin  # noqa: E402

DURATION = 2.0
NEW_POLE = 14.0
OUTPUTS = (topics.ESTIMATE, topics.COMMAND, topics.SLIDING)
run = CliRunner().invoke


@pytest.fixture(scope="module")
def context() -> Iterator[Context]:
    with own_context() as made:
        yield made


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory, context: Context) -> Log:
    """A real session in lockstep, in which the controller's pole changes once while it runs."""
    path = tmp_path_factory.mktemp("session") / "session.mcap"
    nodes = [
        RoadProfileNode(context, {"seed": 3}),
        PlantNode(context, {"seed": 3, "duration": DURATION}),
        EstimatorNode(context),
        ControllerNode(context),
        SessionRecorderNode(context, {"output": str(path)}),
    ]
    controller = nodes[3]

    def change() -> None:
        if controller.progress is not None and controller.progress.last_ns > 1_600_000_000:
            timer.cancel()
            controller.set_parameters([Parameter("pole", value=NEW_POLE)])

    timer = controller.create_timer(0.001, change)

    assert spin(nodes, StopRequest(), context) == 0
    for node in nodes:
        node.destroy_node()
    return read_log(path)


def test_replay_gives_the_recorded_bytes(recorded: Log) -> None:
    result = replay(recorded)
    assert result.samples == round(DURATION * 500) + 1 and result.skipped == 0 and not result.notes
    assert [a.topic for a in result.agreements] == [t.name for t in OUTPUTS]
    for agreement in result.agreements:
        assert agreement.identical and agreement.compared == recorded.topics[agreement.topic].count, agreement
    assert recorded.topics["/rig/setup"].count > 5  # the change is in it, and took effect at the right sample


def test_an_emergency_stop_in_lockstep_is_in_the_log_and_so_is_the_rest(tmp_path: Path, context: Context) -> None:
    """Its message has no stamp of its own: it goes to the sample that it came with."""
    path = tmp_path / "session.mcap"
    nodes = [
        RoadProfileNode(context, {"seed": 3}),
        PlantNode(context, {"seed": 3, "duration": 2.0}),
        EstimatorNode(context),
        ControllerNode(context),
        SessionRecorderNode(context, {"output": str(path)}),
    ]
    controller = nodes[3]
    panel = controller.create_publisher(Bool, "/rig/estop", 1)

    def press() -> None:
        begun = controller.progress is not None and controller.progress.last_ns > 1_200_000_000
        if begun and panel.get_subscription_count() == 3:  # two of the plant, the recorder
            timer.cancel()
            panel.publish(Bool(data=True))

    timer = controller.create_timer(0.001, press)
    assert spin(nodes, StopRequest(), context) == 0
    for node in nodes:
        node.destroy_node()
    log = read_log(path)
    assert log.topics["/rig/estop"].count == 1 and log.topics["/rig/displacement"].count == 1001
    assert "estop" in [event.code for event in read_events(log)]


def test_a_killed_recorders_log_replays_as_far_as_it_goes(recorded: Log, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(recorded.path.read_bytes()[: int(recorded.path.stat().st_size * 0.7)])
    result = run(app, [str(path), "--stepped"], env={"COLUMNS": "150"})
    assert result.exit_code == 0, result.output
    assert "going on with the" in result.output and result.output.count(" all ") == 3


def test_a_split_bag_replays_like_one_file(recorded: Log, tmp_path: Path) -> None:
    """As `ros2 bag record --max-bag-duration` leaves it: two files, metadata.yaml, and topics of others."""
    names = []
    middle = 2 * SECOND
    for k, (low, high) in enumerate(((0, middle), (middle, 9 * SECOND))):
        part = {name: between(recorded.records(name), low, high) for name in recorded.topics}
        infos = {name: dataclasses.replace(recorded.topics[name], count=len(part[name])) for name in part}
        names.append(f"bag_{k}.mcap")
        write_log(dataclasses.replace(recorded, topics=infos, _records=part, _columns={}), tmp_path / names[-1])
    (tmp_path / "metadata.yaml").write_text(
        f"rosbag2_bagfile_information: {{version: 9, storage_identifier: mcap, relative_file_paths: {names}}}"
    )
    result = replay(read_log(tmp_path))
    assert len(result.agreements) == 3 and all(a.identical for a in result.agreements)


def between(records: Records, low: int, high: int) -> Records:
    rows = np.flatnonzero((records.log_time_ns >= low) & (records.log_time_ns < high))
    begin, end = (int(rows[0]), int(rows[-1]) + 1) if len(rows) else (0, 0)
    offsets = records.offsets[begin : end + 1]
    data = records.data[offsets[0] : offsets[-1]]
    times = (records.log_time_ns, records.publish_time_ns, records.sequence)
    return Records(*(t[begin:end] for t in times), offsets - offsets[0], data)


def test_other_gains_change_the_command_and_nothing_before_it(recorded: Log, tmp_path: Path) -> None:
    plot = tmp_path / "what-if.png"
    result = run(
        app, [str(recorded.path), "--set", "controller.lambda=20", "--plot", str(plot)], env={"COLUMNS": "150"}
    )
    assert result.exit_code == 0, result.output
    assert CAVEAT in result.output and "front_inlet, mean" in result.output and plot.stat().st_size > 20_000
    changed = replay(recorded, {"controller": {"lambda": 20.0}})
    agreement = {a.topic: a for a in changed.agreements}
    assert agreement["/estimate/state"].identical and not agreement["/valve/command"].identical
    # The same code with the change undone is the recording again, so the difference is the gain's alone.
    plain = replay(recorded)
    assert np.any(changed.command.values != plain.command.values)
    other = replay(recorded, {"estimator": {"mass_scale": 1.5}})
    assert not {a.topic: a for a in other.agreements}["/estimate/state"].identical


@pytest.mark.parametrize(
    ("setting", "word"),
    [
        ("controller.pole=9999", "0.5 to 200 1/s"),
        ("controller.gain=1", "unknown parameter"),
        ("plant.seed=1", "estimator, controller"),
        ("pole=1", "node.parameter=value"),
    ],
)
def test_a_wrong_setting_is_named(recorded: Log, setting: str, word: str) -> None:
    error = run(app, [str(recorded.path), "--set", setting]).exception
    assert isinstance(error, InputError) and word in str(error)


def test_the_replayed_log_is_a_log(recorded: Log, tmp_path: Path) -> None:
    output = tmp_path / "again.mcap"
    assert run(app, [str(recorded.path), "--stepped", "--output", str(output)]).exit_code == 0
    again = read_log(output)
    for name in recorded.topics:
        assert same_payload(recorded, again, name), name
    assert {m.name for m in again.metadata} >= {"replay", "versions"}
    other = tmp_path / "other.mcap"
    assert run(
        app, [str(recorded.path), "--set", "controller.pole=20", "-o", str(other), "--plot", str(tmp_path / "p.png")]
    )
    changed = [t.name for t in OUTPUTS if not same_payload(recorded, read_log(other), t.name)]
    assert changed == ["/valve/command", "/controller/sliding"]
    plain = write(tmp_path / "contract.mcap", contract_log(100))
    run(app, [str(plain), "--stepped", "--output", str(tmp_path / "added.mcap")])
    assert_accepted_by_other_readers(tmp_path / "added.mcap", 501 + 200)


def test_a_log_without_parameters_is_replayed_with_defaults_and_says_so(tmp_path: Path) -> None:
    messages = contract_log(100)
    dropped = [m for i, m in enumerate(messages) if not (m[0] == "/rig/front/pressure" and i % 7 == 0)]
    log = read_log(write(tmp_path / "a.mcap", dropped))
    result = replay(log)
    assert result.samples == log.topics["/rig/front/pressure"].count < 100
    assert any("defaults" in note for note in result.notes) and any("500 Hz" in note for note in result.notes)
    assert [a.topic for a in result.agreements] == ["/valve/command"]
    with pytest.raises(InputError, match="no such topic"):
        replay(read_log(write(tmp_path / "b.mcap", [m for m in messages if m[0] != "/rig/displacement"])))


def test_the_road_through_the_model_in_closed_loop(recorded: Log) -> None:
    """The session's own rig, gains, road and seed give the recorded motion; passive valves another one."""
    again = rerun(recorded, {"controller": {"pole": 10.0}})
    before_the_change = again.recorded_time < 0.5
    for name, _, _, _, _ in compare_channels(again)[:4]:
        k = ["sprung_front", "sprung_rear", "unsprung_front", "unsprung_rear"].index(name)
        ours = np.interp(again.recorded_time, again.time, again.channels[:, k])[before_the_change]
        assert np.abs(ours - again.recorded[before_the_change, k]).max() < 1e-4, name
    passive = rerun(recorded, {"controller": {"controller": "passive"}})
    assert passive.channels[:, 0].std() > 1.2 * again.channels[:, 0].std()


def test_transport() -> None:
    tape = Transport(start=100 * SECOND, end=110 * SECOND, rate=2.0)
    tape.begin(0, 100 * SECOND)
    assert tape.now(1 * SECOND) == 102 * SECOND and tape.wall_of(104 * SECOND) == 2 * SECOND
    tape.pause(1 * SECOND)
    assert tape.now(9 * SECOND) == 102 * SECOND and not tape.finished(99 * SECOND)
    tape.pause(10 * SECOND, paused=False)
    tape.set_rate(11 * SECOND, 0.5)
    assert tape.now(11 * SECOND) == 104 * SECOND and tape.now(13 * SECOND) == 105 * SECOND
    tape.step(13 * SECOND, 105 * SECOND + 7)
    assert tape.paused and tape.now(20 * SECOND) == 105 * SECOND + 7 and tape.jumps == 1
    tape.seek(20 * SECOND, 0)
    assert tape.now(21 * SECOND) == 100 * SECOND and tape.jumps == 2
    tape.pause(30 * SECOND, paused=False)
    assert tape.now(99 * SECOND) == 110 * SECOND and tape.finished(99 * SECOND)
    tape.loop = True
    assert tape.now(52 * SECOND) == 101 * SECOND and tape.wraps == 1 and tape.jumps == 3
    assert not tape.finished(99 * SECOND)


def test_recorded_qos_of_other_recorders() -> None:
    words = "- {reliability: best_effort, durability: volatile}"
    numbers = "- {reliability: 2, durability: 1}"
    assert recorded_qos("/x", words).reliability.name == "BEST_EFFORT"
    assert recorded_qos("/x", numbers).durability.name == "TRANSIENT_LOCAL"
    assert recorded_qos("/rig/config", "").durability.name == "TRANSIENT_LOCAL"
    assert recorded_qos("/rig/displacement", "][").reliability.name == "RELIABLE"


class Listener:
    """The real estimator, and what it says."""

    def __init__(self, context: Context) -> None:
        self.node = EstimatorNode(context)
        self.heard: list[bytes] = []
        self.clock: list[int] = []
        self.node.subscribe(topics.ESTIMATE, self.heard.append)
        self.node.subscribe(topics.CLOCK, lambda data: self.clock.append(int.from_bytes(data[4:8], "little")))
        self._executor = make_executor("events", context)  # in order of arrival, as a session does
        self._executor.add_node(self.node)
        self._on = True
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while self._on:
            self._executor.spin_once(timeout_sec=0.02)

    def wait_for(self, count: int, seconds: float = 20.0) -> None:
        end = time.monotonic() + seconds
        while len(self.heard) < count and time.monotonic() < end:
            time.sleep(0.01)
        assert len(self.heard) >= count, f"{len(self.heard)} of {count}"

    def close(self) -> None:
        self._on = False
        self._thread.join()
        self._executor.shutdown()
        self.node.destroy_node()


@pytest.mark.realtime
def test_live_replay_feeds_a_running_estimator(recorded: Log, context: Context) -> None:
    """Play, pause, step, seek back: what the estimator says is what it said when the log was recorded."""
    truth = [recorded.records("/estimate/state").message(i) for i in range(recorded.topics["/estimate/state"].count)]
    listener = Listener(context)
    player = Player(recorded, transport_of(recorded, rate=2.0), context=context)
    try:
        time.sleep(2.0)  # discovery; a machine under load needs more than the usual half second
        player.seek(0.0)
        while player.position < 0.3:
            time.sleep(player.advance())
        player.transport.pause(time.monotonic_ns())
        player.advance()
        player.flush()
        stood = int(player.position * 500 + 1e-6) + 1
        listener.wait_for(stood)
        time.sleep(0.2)
        player.advance()
        assert len(listener.heard) == stood and listener.heard == truth[:stood]
        player.step()
        player.advance()
        listener.wait_for(stood + 1)
        assert listener.heard[-1] == truth[stood]
        player.seek(0.0)  # backwards: the estimator begins again
        player.transport.pause(time.monotonic_ns(), paused=False)
        while player.position < 0.1:
            time.sleep(player.advance())
        player.flush()
        listener.wait_for(stood + 1 + 40)
        again = listener.heard[stood + 1 :]
        assert again == truth[: len(again)]
        assert listener.clock and player.lateness
    finally:
        player.node.destroy_node()
        listener.close()


def test_live_replay_from_the_command_line(recorded: Log) -> None:
    """To the end without a terminal; with one, keys act and `q` ends it."""
    result = run(app, [str(recorded.path), "--rate", "50", "--domain-id", str(own_domain())])
    assert result.exit_code == 0, result.output
    inputs = ("/road/profile", "/rig/displacement", "/rig/front/pressure", "/rig/rear/pressure")
    published = sum(recorded.topics[name].count for name in inputs)
    said = re.search(r"(\d+) messages, late by p50", result.output)
    # The latched configuration counts if it was logged with the first sample, not before it.
    assert said is not None and int(said[1]) - published in (0, 1), result.output
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "pneumo_ros.cli.main", "replay", str(recorded.path), "--paused"]
    process = subprocess.Popen([*command, "--domain-id", str(own_domain())], stdin=theirs, stdout=subprocess.PIPE)
    try:
        assert process.stdout is not None and b"space: pause" in process.stdout.readline()
        for key in (b".", b"+", b";", b" ", b"q"):
            os.write(ours, key)
        assert process.wait(120) == 0
    finally:
        process.kill()
    os.close(ours)
    os.close(theirs)
