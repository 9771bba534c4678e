# SPDX-License-Identifier: Apache-2.0
"""Quality of service by parameter, and parameters dumped from one node and given to another, over real DDS."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")
import rclpy
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from helpers import sessions
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from pneumo_ros.cli.session_plan import node_tables
from pneumo_ros.errors import InputError
from pneumo_ros.nodes.estimator import EstimatorNode
from pneumo_ros.nodes.session_recorder import SessionRecorderNode
from pneumo_ros.rig import load_rig
from pneumo_ros.session.plan import read_config

STATE = "/estimate/state"
REAL_TIME = {"mode": "realtime"}


@pytest.fixture
def context() -> Iterator[Context]:
    with sessions.own_context() as made:
        yield made


def overrides(topic: str, kind: str, **policies: Any) -> dict[str, Any]:
    return {f"qos_overrides.{topic}.{kind}.{policy}": value for policy, value in policies.items()}


def offered(observer: Node, topic: str, timeout: float = 10.0) -> QoSProfile:
    """What a topic's one publisher offers, as another node of the graph sees it."""
    end = time.monotonic() + timeout
    while not (found := observer.get_publishers_info_by_topic(topic)) and time.monotonic() < end:
        time.sleep(0.02)
    return found[0].qos_profile


def test_a_publisher_offers_what_parameters_say(context: Context) -> None:
    wanted = overrides(STATE, "publisher", reliability="best_effort", durability="transient_local", depth=7)
    node = EstimatorNode(context, {**REAL_TIME, **wanted})
    observer = rclpy.create_node("observer", context=context)
    seen = offered(observer, STATE)
    assert seen.reliability is ReliabilityPolicy.BEST_EFFORT and seen.durability is DurabilityPolicy.TRANSIENT_LOCAL
    assert node.get_parameter(f"qos_overrides.{STATE}.publisher.depth").value == 7
    # What that means to others: who asks for more than is offered gets nothing.
    demanding = observer.create_subscription(JointState, STATE, lambda _: None, QoSProfile(depth=1))
    modest = observer.create_subscription(
        JointState, STATE, lambda _: None, QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    )
    end = time.monotonic() + 10.0
    while modest.get_publisher_count() < 1 and time.monotonic() < end:
        time.sleep(0.02)
    assert modest.get_publisher_count() == 1 and demanding.get_publisher_count() == 0


def test_without_overrides_the_table_holds(context: Context) -> None:
    node = EstimatorNode(context, REAL_TIME)
    seen = offered(node, STATE)
    assert seen.reliability is ReliabilityPolicy.RELIABLE and seen.durability is DurabilityPolicy.VOLATILE


def test_a_subscription_asks_for_what_parameters_say(context: Context) -> None:
    wanted = overrides("/rig/displacement", "subscription", reliability="reliable", depth=50)
    node = EstimatorNode(context, {**REAL_TIME, **wanted})
    observer = rclpy.create_node("observer", context=context)
    end = time.monotonic() + 10.0
    while not (found := observer.get_subscriptions_info_by_topic("/rig/displacement")) and time.monotonic() < end:
        time.sleep(0.02)
    assert found[0].qos_profile.reliability is ReliabilityPolicy.RELIABLE
    assert {s.topic_name: s for s in node.subscriptions}["/rig/displacement"].qos_profile.depth == 50


def test_every_topic_of_a_node_can_be_overridden(context: Context, tmp_path: Path) -> None:
    for node in (
        EstimatorNode(context, REAL_TIME),
        SessionRecorderNode(context, {**REAL_TIME, "output": str(tmp_path / "a.mcap")}),
    ):
        names = {name.rpartition(".")[0] for name in node._parameters if name.startswith("qos_overrides.")}
        own = {"/parameter_events", "/rosout"}
        wanted = {f"qos_overrides.{p.topic_name}.publisher" for p in node.publishers if p.topic_name not in own}
        wanted |= {f"qos_overrides.{s.topic_name}.subscription" for s in node.subscriptions}
        assert len(wanted) >= 8 and wanted <= names
        if isinstance(node, SessionRecorderNode):
            node.writer.finish(False, "test")


@pytest.mark.parametrize(
    ("mode", "policies", "words"),
    [
        ("lockstep", {"reliability": "best_effort"}, "every message counts"),
        ("realtime", {"depth": 0}, "depth is 0"),
        ("realtime", {"reliability": "usually"}, "usually"),
        ("realtime", {"durability": "eternal"}, "eternal"),
    ],
)
def test_a_bad_override_is_refused_in_one_line(
    context: Context, mode: str, policies: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words) as refused:
        EstimatorNode(context, {"mode": mode, **overrides(STATE, "publisher", **policies)})
    assert f"qos_overrides.{STATE}" in str(refused.value) and "\n" not in str(refused.value)


def dumped(context: Context, node: Node) -> dict[str, Any]:
    """A node's parameters as `ros2 param dump` writes them, asked for over its services."""
    asker = rclpy.create_node("asker", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(asker)
    executor.add_node(node)
    client = AsyncParameterClient(asker, node.get_name())
    assert client.wait_for_services(10.0)
    listing = client.list_parameters([], 0)
    executor.spin_until_future_complete(listing, 10.0)
    names = sorted(listing.result().result.names)
    values = client.get_parameters(names)
    executor.spin_until_future_complete(values, 10.0)
    tree: dict[str, Any] = {}
    for name, value in zip(names, values.result().values, strict=True):
        *path, last = name.split(".")
        place = tree
        for part in path:
            place = place.setdefault(part, {})
        place[last] = parameter_value_to_python(value)
    executor.shutdown()
    return {f"/{node.get_name()}": {"ros__parameters": tree}}


def test_dumped_parameters_start_the_same_node_again(context: Context, tmp_path: Path) -> None:
    """`ros2 param dump`, then `ros2 run ... --params-file` or `pneumo run --config`."""
    changed = {"rate_hz": 400.0, **REAL_TIME, **overrides(STATE, "publisher", depth=9, history="keep_last")}
    first = EstimatorNode(context, changed)
    document = dumped(context, first)
    file = tmp_path / "estimator.yaml"
    file.write_text(yaml.safe_dump(document), encoding="utf-8")
    with sessions.own_context(arguments=["--ros-args", "--params-file", str(file)]) as again:
        second = EstimatorNode(again)
        assert dumped(again, second) == document
        profile = next(p for p in second.publishers if p.topic_name == STATE).qos_profile
        assert profile.depth == 9 and profile.history is HistoryPolicy.KEEP_LAST
    read = read_config(file, node_tables())["estimator"]
    assert read["rate_hz"] == 400.0 and read[f"qos_overrides.{STATE}.publisher.depth"] == 9
    third = EstimatorNode(context, read)
    assert dumped(context, third) == document


def test_diagnostics_name_part_and_hardware(context: Context) -> None:
    """REP 107: `node: part`, a hardware id, levels OK to STALE."""
    node = EstimatorNode(context, REAL_TIME)
    observer = rclpy.create_node("observer", context=context)
    heard: list[DiagnosticArray] = []
    observer.create_subscription(DiagnosticArray, "/diagnostics", heard.append, 10)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    executor.add_node(observer)
    end = time.monotonic() + 15.0
    while not heard and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.1)
    status = heard[0].status[0]
    assert status.name == "estimator: loop" and status.hardware_id == load_rig().name and heard[0].header.stamp.sec > 0
    assert status.level in (b"\x00", b"\x01", b"\x02", b"\x03") and status.message
