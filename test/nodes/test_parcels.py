# SPDX-License-Identifier: Apache-2.0
"""Nodes of a lockstep session in processes of their own: parcels for one another, the topics for everybody else."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
import rclpy
from helpers import sessions
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor

from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointEncoder, PressureEncoder, stamp_of
from pneumo_ros.log.parcel import unpack
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.topics import Topic
from pneumo_ros.nodes import parcels
from pneumo_ros.nodes.base import OK, RigNode
from pneumo_ros.nodes.estimator import EstimatorNode
from pneumo_ros.nodes.hand_over import HandOver
from pneumo_ros.nodes.interfaces import message_class
from pneumo_ros.nodes.qos import recorder_qos
from pneumo_ros.nodes.session_recorder import SessionRecorderNode
from pneumo_ros.nodes.single_process import NODES, ROLES

PERIOD_NS = 2_000_000
SOME = 200  # periods


@pytest.fixture
def context() -> Iterator[Context]:
    with sessions.own_context() as made:
        yield made


class Spinner:
    """Nodes in an executor, turned until something is so."""

    def __init__(self, context: Context, nodes: list[Any]) -> None:
        self.executor = SingleThreadedExecutor(context=context)
        for node in nodes:
            self.executor.add_node(node)

    def until(self, done: Callable[[], bool], what: str, timeout: float = 30.0) -> None:
        end = time.monotonic() + timeout
        while not done():
            assert time.monotonic() < end, f"not within {timeout} s: {what}"
            self.executor.spin_once(timeout_sec=0.05)


def five_nodes(context: Context, tmp_path: Path) -> dict[str, Any]:
    """As five processes have them, in no process that hands over."""
    own: dict[str, dict[str, Any]] = {
        "plant": {"duration": 0.0}, "session_recorder": {"output": str(tmp_path / "x.mcap")}
    }  # fmt: skip
    return {
        role: build(context=context, overrides={"session_id": "s", **own.get(role, {})})
        for role, build in zip(ROLES, NODES, strict=True)
    }


def listen(node: Any, topic: Topic) -> list[bytes]:
    """What somebody hears of a topic from now on."""
    heard: list[bytes] = []
    qos = recorder_qos(topic.flow)
    node.create_subscription(message_class(topic.type), topic.name, heard.append, qos, raw=True)
    return heard


def test_the_topics_are_for_whoever_listens_and_the_session_listens_to_parcels(
    context: Context, tmp_path: Path
) -> None:
    nodes = five_nodes(context, tmp_path)
    stranger = rclpy.create_node("stranger", context=context)
    turn, plant = Spinner(context, [*nodes.values(), stranger]), nodes["plant"]
    turn.until(lambda: plant.index >= SOME, "some periods")
    assert not any(stranger.count_subscribers(topic.name) for topic in topics.IN_PARCELS)

    opened = listen(stranger, topics.FOR_NEXT["plant"])  # as who records every topic, these as well
    heard = listen(stranger, topics.DISPLACEMENT)
    turn.until(lambda: len(heard) >= SOME, "samples for a stranger")
    assert set(np.diff([stamp_of(data) for data in heard])) == {PERIOD_NS}, "from the first one on it misses none"
    in_parcels = [data for one in opened for name, data in unpack(one, "") if name == topics.DISPLACEMENT.name]
    assert in_parcels[-len(heard) :] == heard, "and they are those of the session, byte for byte"
    nodes["session_recorder"].on_stop(turn.executor)


def test_a_second_publisher_of_a_topic_that_goes_in_parcels_ends_the_session(context: Context, tmp_path: Path) -> None:
    nodes = five_nodes(context, tmp_path)
    turn, controller = Spinner(context, list(nodes.values())), nodes["controller"]
    turn.until(lambda: nodes["plant"].index >= SOME, "some periods")
    intruder = rclpy.create_node("intruder", context=context)
    intruder.create_publisher(message_class(topics.COMMAND.type), topics.COMMAND.name, 10)
    turn.until(lambda: controller.stop.failed, "the end")
    assert "2 nodes publish /valve/command" in controller.stop.reason and "/intruder" in controller.stop.reason
    nodes["session_recorder"].on_stop(turn.executor)


@pytest.mark.parametrize(
    "options",
    [{}, {"session_id": "s", "session_nodes": "estimator,session_recorder"}],
    ids=["started by hand", "a session without a plant"],
)
def test_a_foreign_plant_that_knows_no_parcels_drives_estimator_and_recorder(
    context: Context, tmp_path: Path, options: dict[str, Any]
) -> None:
    path = tmp_path / "x.mcap"
    nodes: list[RigNode] = [
        EstimatorNode(context, options), SessionRecorderNode(context, {**options, "output": str(path)})
    ]  # fmt: skip
    foreign = rclpy.create_node("foreign_plant", context=context)
    made = [foreign.create_publisher(message_class(t.type), t.name, recorder_qos(t.flow)) for t in topics.MEASUREMENTS]
    turn = Spinner(context, nodes)
    listener = rclpy.create_node("listener", context=context)
    turn.executor.add_node(listener)
    estimates = listen(listener, topics.ESTIMATE)
    turn.until(lambda: all(one.get_subscription_count() == 2 for one in made), "its subscribers")
    turn.until(lambda: nodes[0].count_subscribers("estimate/state") == (1 if options else 2), "those of the estimator")
    turn.until(lambda: not options or all(node.begun for node in nodes), "the session's beginning")
    sent: dict[str, list[bytes]] = {topic.name: [] for topic in topics.MEASUREMENTS}
    for k in range(1, SOME + 1):
        stamp = k * PERIOD_NS
        sample = [
            JointEncoder("ground", topics.DISPLACEMENT.names).encode(stamp, [0.05, 0.05, 0.0, 0.0]),
            *(PressureEncoder(t.frame_id, 1.0).encode(stamp, 2e5) for t in topics.MEASUREMENTS[1:]),
        ]
        for publisher, topic, data in zip(made, topics.MEASUREMENTS, sample, strict=True):
            publisher.publish(data)
            sent[topic.name].append(data)
        turn.until(lambda wanted=k: len(estimates) >= wanted, f"estimate {k}")  # type: ignore[misc]
    for node in nodes:
        node.on_stop(turn.executor)
    log = read_log(path)
    for name, messages in (*sent.items(), (topics.ESTIMATE.name, estimates)):
        records = log.records(name)
        assert [records.message(i) for i in range(len(records))] == messages, name
    assert [stamp_of(data) for data in estimates] == [k * PERIOD_NS for k in range(1, SOME + 1)]


@pytest.mark.parametrize("how", ["an event", "the end"])
def test_nothing_for_the_log_waits_when_an_event_is_told_or_the_node_ends(
    context: Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, how: str
) -> None:
    monkeypatch.setattr(parcels, "LOOK_AGAIN", 3600.0)  # nor does it go by itself after a while
    nodes = five_nodes(context, tmp_path)
    plant, listener = nodes["plant"], rclpy.create_node("listener", context=context)
    turn, heard = Spinner(context, [*nodes.values(), listener]), listen(listener, topics.FOR_LOG["plant"])
    turn.until(lambda: plant.index >= SOME, "some periods")
    plant.event(OK, "one", "from here on a batch begins")
    last = plant.index
    turn.until(lambda: plant.index > last, "a period")
    plant.finished = plant.stop.set = True
    if how == "an event":
        plant.event(OK, "two", "within a batch")
    else:
        plant.on_stop(turn.executor)
    stamp = plant.stamp(plant.index)
    turn.until(lambda: stamp in {stamp_of(data) for one in heard for _, data in unpack(one, "")}, "the sample", 5.0)
    nodes["session_recorder"].on_stop(turn.executor)
    written = nodes["session_recorder"].written
    assert written is not None and written.counts[topics.DISPLACEMENT.name] == plant.index + 1


def test_one_process_and_real_time_send_no_parcels(context: Context, tmp_path: Path) -> None:
    for options, hand_over in (({}, HandOver(ROLES)), ({"mode": "realtime"}, None)):
        node = EstimatorNode(context, {"session_id": "s", **options}, hand_over)
        assert node.parcels is None
        node.destroy_node()
