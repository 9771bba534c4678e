# SPDX-License-Identifier: Apache-2.0
"""Joint states and the URDF of the running rig, for RViz, robot_state_publisher and PlotJuggler. Not part of a session.

Started beside one: ``ros2 run pneumo_ros joint_states``. With control_msgs installed it also publishes what the
joint_state_broadcaster of ros2_control would, on /dynamic_joint_states.
"""

from __future__ import annotations

import time
from collections.abc import Mapping

from rclpy.context import Context
from rclpy.publisher import Publisher
from std_msgs.msg import String

from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointDecoder, JointEncoder, decode_pressure
from pneumo_ros.nodes.base import RigNode
from pneumo_ros.nodes.interfaces import message_class
from pneumo_ros.nodes.qos import overriding, publisher_qos, subscriber_qos
from pneumo_ros.nodes.spin import node_main
from pneumo_ros.parameters import Parameter, Value
from pneumo_ros.rig import load_rig
from pneumo_ros.rig.joints import JOINTS, joint_positions
from pneumo_ros.rig.urdf import urdf

DYNAMIC = "control_msgs/msg/DynamicJointState"
PARAMETERS: tuple[Parameter, ...] = (
    Parameter("publish_rate", 50.0, "Hz", "joint states a second, at most", 1.0, 1000.0, read_only=True),
)


class JointStatesNode(RigNode):
    """Thin shell over :mod:`pneumo_ros.rig.joints`."""

    def __init__(self, context: Context | None = None, overrides: Mapping[str, Value] | None = None) -> None:
        super().__init__("joint_states", PARAMETERS, context=context, overrides=overrides)
        self.rig = load_rig(self.values["rig"] or None)
        self._encode = JointEncoder(topics.JOINT_STATES.frame_id, topics.JOINT_STATES.names).encode_array
        self._publish = self.publisher(topics.JOINT_STATES).publish
        self.publisher(topics.ROBOT_DESCRIPTION).publish(String(data=urdf(self.rig)))
        self._read = JointDecoder(topics.DISPLACEMENT.name, topics.DISPLACEMENT.names).decode_array
        self._next = 0.0
        self._pressures: dict[str, float] = {}
        self._dynamic = self._dynamic_publisher()
        self._listen()

    def _listen(self) -> None:
        """As in real time whatever the mode: only the newest sample is of interest, and no session waits for it."""
        for topic, callback in (
            (topics.DISPLACEMENT, self._on_displacement),
            (topics.FRONT_PRESSURE, lambda data: self._on_pressure("front_air_spring", data)),
            (topics.REAR_PRESSURE, lambda data: self._on_pressure("rear_air_spring", data)),
        ):
            qos, options = subscriber_qos(topic.flow, lockstep=False), overriding(lockstep=False)
            self.create_subscription(
                message_class(topic.type), topic.name, callback, qos, raw=True, qos_overriding_options=options
            )

    def _dynamic_publisher(self) -> Publisher | None:
        try:
            kind = message_class(DYNAMIC)
        except ModuleNotFoundError:
            self.get_logger().info("control_msgs is not installed: /joint_states only, no /dynamic_joint_states")
            return None
        return self.create_publisher(kind, "dynamic_joint_states", publisher_qos(topics.JOINT_STATES.flow, False))

    def _on_pressure(self, spring: str, data: bytes) -> None:
        self._pressures[spring] = decode_pressure(data)[1]

    def _on_displacement(self, data: bytes) -> None:
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + 1.0 / self.values["publish_rate"]
        stamp, measured = self._read(data)
        positions = joint_positions(measured, self.rig)
        self._publish(self._encode(stamp, positions))
        if self._dynamic is not None:
            self._publish_dynamic(self._dynamic, stamp, positions.tolist())

    def _publish_dynamic(self, publisher: Publisher, stamp: int, positions: list[float]) -> None:
        values = message_class("control_msgs/msg/InterfaceValue")
        message = message_class(DYNAMIC)()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        message.joint_names = [*JOINTS, *self._pressures]
        message.interface_values = [values(interface_names=["position"], values=[one]) for one in positions] + [
            values(interface_names=["pressure"], values=[one]) for one in self._pressures.values()
        ]
        publisher.publish(message)


def main(args: list[str] | None = None) -> int:
    """Entry point of ``joint_states``."""
    return node_main(JointStatesNode, args)


if __name__ == "__main__":
    raise SystemExit(main())
