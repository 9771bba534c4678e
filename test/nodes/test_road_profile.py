# SPDX-License-Identifier: Apache-2.0
"""The road on hardware: it begins with the first sample and keeps the samples' stamps, however late the node is."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest

rclpy = pytest.importorskip("rclpy")
from helpers.sessions import own_domain  # noqa: E402
from rclpy.context import Context  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.qos import QoSProfile  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402

from pneumo_ros.log import topics  # noqa: E402
from pneumo_ros.log.cdr import JointEncoder  # noqa: E402
from pneumo_ros.nodes.qos import publisher_qos  # noqa: E402
from pneumo_ros.nodes.road_profile import RoadProfileNode  # noqa: E402
from pneumo_ros.rig import load_rig  # noqa: E402
from pneumo_ros.road import PARAMETERS, build_road  # noqa: E402

PERIOD, START = 2_000_000, 1_000_000_000  # ns
HARDWARE = {"mode": "realtime", "session_nodes": "daq,road_profile"}


@pytest.fixture
def context() -> Iterator[Context]:
    made = Context()
    rclpy.init(context=made, domain_id=own_domain())
    yield made
    made.try_shutdown()


def test_a_node_that_was_held_up_begins_with_the_first_sample(context: Context) -> None:
    """Forty samples come before it gets to run; the board's clock is learnt on the way, and three samples are lost."""
    node = RoadProfileNode(context, HARDWARE)
    board = rclpy.create_node("board", context=context)
    heard: list[JointState] = []
    board.create_subscription(JointState, topics.ROAD.relative, heard.append, QoSProfile(depth=1000))
    qos = publisher_qos(topics.DISPLACEMENT.flow, lockstep=False)
    sender = board.create_publisher(JointState, topics.DISPLACEMENT.relative, qos)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(board)
    until(executor, lambda: sender.get_subscription_count() and board.count_publishers(topics.ROAD.relative))
    numbers = [k for k in range(40) if k not in (20, 21, 22)]
    stamps = [START + k * PERIOD - (900_000 if k > 10 else 0) for k in numbers]  # ns; late at first, by 0.9 ms
    encode = JointEncoder(topics.DISPLACEMENT.frame_id, topics.DISPLACEMENT.names).encode
    for stamp in stamps:
        sender.publish(encode(stamp, [0.0] * 4))
    executor.add_node(node)
    until(executor, lambda: len(heard) >= 40)
    node.destroy_node()
    board.destroy_node()
    times = [m.header.stamp.sec * 1_000_000_000 + m.header.stamp.nanosec for m in heard]
    assert len(times) == 40 and set(stamps) <= set(times) and times == sorted(times)
    rig = load_rig()
    wanted = {p.name: p.default for p in PARAMETERS}
    road = build_road(wanted, wheelbase=rig.wheelbase, length_scale=rig.length_scale.value, where="test")
    heights, _ = road.sample([k * PERIOD * 1e-9 for k in range(40)])
    assert abs(heights[39]).max() > 0.0
    for height, message in zip(heights, heard, strict=True):
        assert list(message.position) == pytest.approx(list(height), abs=1e-12)


def until(executor: SingleThreadedExecutor, condition: object, seconds: float = 30.0) -> None:
    end = time.monotonic() + seconds
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < end, "waited too long"
        executor.spin_once(timeout_sec=0.05)
