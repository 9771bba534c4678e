# SPDX-License-Identifier: Apache-2.0
"""Nodes of a lockstep session in processes of their own: parcels for one another, the topics for everybody else."""

from __future__ import annotations

import json
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
from std_msgs.msg import String

from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointEncoder, PressureEncoder, stamp_of
from pneumo_ros.log.parcel import unpack
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.topics import Topic
from pneumo_ros.nodes import sources
from pneumo_ros.nodes.base import OK, RigNode
from pneumo_ros.nodes.estimator import EstimatorNode
from pneumo_ros.nodes.hand_over import HandOver
from pneumo_ros.nodes.interfaces import message_class
from pneumo_ros.nodes.qos import publisher_qos, recorder_qos
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


def announce(node: Any, topic: Topic) -> None:
    """Say as the nodes of the session do which subscription is the node's."""
    own: list[str] = []
    end = time.monotonic() + 10.0
    while not own and time.monotonic() < end:
        there = node.get_subscriptions_info_by_topic(topic.name)
        own = [sources.gid_of(one) for one in there if one.node_name == node.get_name()]
    said = {"session": "s", "node": node.get_name(), "publishers": {}, "subscriptions": {topic.name: own}}
    qos = publisher_qos(topics.READY.flow, True)
    node.create_publisher(String, topics.READY.name, qos).publish(String(data=json.dumps(said)))


def test_a_topic_is_sent_by_itself_while_and_only_while_a_stranger_listens(
    context: Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unheard: list[bytes] = []  # what reaches subscriptions whose node takes parcels
    monkeypatch.setattr(sources, "_forget", unheard.append)
    nodes = five_nodes(context, tmp_path)
    turn, plant = Spinner(context, list(nodes.values())), nodes["plant"]

    def periods(count: int) -> None:
        end = plant.index + count
        turn.until(lambda: plant.index >= end, f"{count} periods")

    turn.until(lambda: all(node.begun for node in nodes.values()), "the beginning")
    periods(SOME)
    unheard.clear()
    periods(SOME)
    assert not unheard, "nobody listens, and yet a message was sent by itself"

    stranger = rclpy.create_node("stranger", context=context)
    turn.executor.add_node(stranger)
    heard = listen(stranger, topics.DISPLACEMENT)
    announce(stranger, topics.DISPLACEMENT)  # whoever takes no parcels is a stranger, though it be of the session
    parcels = listen(stranger, topics.FOR_NEXT["plant"])  # it takes these too, as who records every topic does
    turn.until(lambda: len(heard) >= 4 * SOME and len(parcels) >= SOME, "both kinds of message")
    assert set(np.diff([stamp_of(data) for data in heard])) == {PERIOD_NS}
    assert set(unheard) <= set(heard), "only the topic that a stranger listens to"

    turn.executor.remove_node(stranger)
    stranger.destroy_node()

    def silent() -> bool:
        unheard.clear()
        periods(SOME)
        return not unheard

    turn.until(silent, "silence again")
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
    turn.until(lambda: nodes[0].count_subscribers("estimate/state") == 2, "those of the estimator")
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


def test_nothing_for_the_log_waits_when_an_event_is_told_or_the_node_ends(context: Context, tmp_path: Path) -> None:
    nodes = five_nodes(context, tmp_path)
    plant, recorder = nodes["plant"], nodes["session_recorder"]
    listener = rclpy.create_node("listener", context=context)
    turn = Spinner(context, [*nodes.values(), listener])
    parcels, events = listen(listener, topics.FOR_LOG["plant"]), listen(listener, topics.EVENTS)
    turn.until(lambda: plant.index >= SOME, "some periods")
    plant.event(OK, "one", "between two batches")
    stamp = plant.stamp(plant.index)
    told = len(events) + 1
    turn.until(lambda: len(events) >= told, "the event")
    assert stamp in {stamp_of(data) for one in parcels for _, data in unpack(one, "")}

    plant.event(OK, "two", "after which something waits")
    last = plant.index
    turn.until(lambda: plant.index > last, "a period")
    plant.finished = plant.stop.set = True  # no event tells this end
    for node in (plant, recorder):
        node.on_stop(turn.executor)
    assert recorder.written is not None and recorder.written.counts[topics.DISPLACEMENT.name] == plant.index + 1


def test_one_process_and_real_time_send_no_parcels(context: Context, tmp_path: Path) -> None:
    for options, hand_over in (({}, HandOver(ROLES)), ({"mode": "realtime"}, None)):
        node = EstimatorNode(context, {"session_id": "s", **options}, hand_over)
        assert node.parcels is None
        node.destroy_node()
