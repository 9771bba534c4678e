# SPDX-License-Identifier: Apache-2.0
"""What a node says reaches /rosout by its logger, over real DDS: once a second and code, with its level."""

from __future__ import annotations

import time

import pytest

pytest.importorskip("rclpy")
import rclpy
from helpers import sessions
from rcl_interfaces.msg import Log
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile

from pneumo_ros.nodes.base import OK, WARN
from pneumo_ros.nodes.estimator import EstimatorNode


def test_events_are_heard_on_rosout_once_a_second() -> None:
    with sessions.own_context() as context:
        node, observer = EstimatorNode(context, {"mode": "realtime"}), rclpy.create_node("observer", context=context)
        heard: list[Log] = []
        profile = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        observer.create_subscription(Log, "/rosout", heard.append, profile)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(observer)
        for _ in range(5):
            node.event(WARN, "far_off", "the estimate is far off")
        node.event(OK, "fine_again", "the estimate is fine again")

        def said(words: str) -> list[Log]:
            return [message for message in heard if words in message.msg]

        end = time.monotonic() + 10.0
        while not said("fine again") and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.05)
        warned = said("far off")
        assert [(m.name, m.level) for m in warned] == [("estimator", Log.WARN)]
        assert len(said("fine again")) == 1
