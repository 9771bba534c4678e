# SPDX-License-Identifier: Apache-2.0
"""The bridge to viewers over real DDS: joint states and URDF beside a plant that another node plays."""

from __future__ import annotations

import time
from xml.etree import ElementTree

import numpy as np
import pytest

pytest.importorskip("rclpy")
import rclpy
from helpers import sessions
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from pneumo_ros.log.topics import DISPLACEMENT
from pneumo_ros.nodes.joint_states import JointStatesNode
from pneumo_ros.rig import load_rig
from pneumo_ros.rig.joints import JOINTS, joint_positions


def test_joint_states_and_urdf_beside_a_session() -> None:
    with sessions.own_context() as context:
        bridge = JointStatesNode(context, {"publish_rate": 1000.0})
        other = rclpy.create_node("other", context=context)
        states: list[JointState] = []
        descriptions: list[String] = []
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        other.create_subscription(JointState, "/joint_states", states.append, 10)
        other.create_subscription(String, "/robot_description", descriptions.append, latched)
        measured = other.create_publisher(JointState, DISPLACEMENT.name, 10)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(bridge)
        executor.add_node(other)
        # Names in another order than the table's: values are matched by name.
        values = dict(zip(reversed(DISPLACEMENT.names), (-0.016, -0.012, 0.041, 0.055), strict=True))
        message = JointState(name=list(values), position=list(values.values()))
        message.header.stamp.sec = 7
        end = time.monotonic() + 15.0
        while not (states and descriptions) and time.monotonic() < end:
            measured.publish(message)
            executor.spin_once(timeout_sec=0.05)
        assert states and descriptions
        wanted = joint_positions(np.array([values[name] for name in DISPLACEMENT.names]), load_rig())
        assert tuple(states[0].name) == JOINTS and states[0].header.stamp.sec == 7
        np.testing.assert_allclose(states[0].position, wanted)
        assert ElementTree.fromstring(descriptions[0].data).get("name") == load_rig().name
