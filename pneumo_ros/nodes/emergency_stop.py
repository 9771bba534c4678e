# SPDX-License-Identifier: Apache-2.0
"""Latched emergency stop of the node that owns the valves: a topic and a service set it, only a service releases it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_srvs.srv import Trigger

from pneumo_ros.log.topics import ESTOP
from pneumo_ros.nodes.base import ERROR, OK, RigNode
from pneumo_ros.nodes.interfaces import message_class

TRIP_SERVICE, RESET_SERVICE = "rig/estop_trip", "rig/estop_reset"
CLOSED = np.zeros(4)  # m2: closed valves hold the air in the springs, as without power
_FLAG = 4  # offset of the bool in a serialised std_msgs/Bool
RELIABLE = QoSProfile(depth=10)
ANY = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
HISTORY = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def hear_stops(node: Node, trip: Callable[[str], None]) -> None:
    """Call ``trip("topic")`` at every `true` on /rig/estop, whatever its publisher's quality of service.

    No single subscription hears every publisher: one that asks for reliability is not matched by a best effort panel,
    one that does not may miss what a reliable one says, and only one that asks for history hears a panel that pressed
    before. The third is made when such a panel is there: an ordinary one would be told that it does not fit.

    `false` does nothing: a publisher that comes and goes must not release the rig.
    """
    with_history: list[object] = []

    def on_message(data: bytes) -> None:
        if len(data) > _FLAG and data[_FLAG]:
            trip("topic")

    def subscribe(profile: QoSProfile, events: SubscriptionEventCallbacks) -> object:
        kind = message_class(ESTOP.type)
        # No overrides: two subscriptions share the topic's parameters, and none may keep a stop from being heard.
        return node.create_subscription(
            kind, ESTOP.relative, on_message, profile, event_callbacks=events, raw=True, qos_overriding_options=None
        )

    def on_matched(_: object) -> None:
        there = [info.qos_profile for info in node.get_publishers_info_by_topic(ESTOP.relative)]
        if not with_history and any(offered.durability == DurabilityPolicy.TRANSIENT_LOCAL for offered in there):
            with_history.append(subscribe(HISTORY, SubscriptionEventCallbacks(use_default_callbacks=False)))

    subscribe(RELIABLE, SubscriptionEventCallbacks(use_default_callbacks=False))
    subscribe(ANY, SubscriptionEventCallbacks(matched=on_matched, use_default_callbacks=False))


class EmergencyStop:
    """The latch of a simulated rig: it lasts as long as its session, for no air is behind it.

    Parameters
    ----------
    node : owner of the valves; the latch subscribes and offers the services on it

    Attributes
    ----------
    latched : True from the first request to a granted release
    """

    def __init__(self, node: RigNode) -> None:
        self.latched = False
        self._node = node
        hear_stops(node, self.trip)
        node.create_service(Trigger, TRIP_SERVICE, self._on_trip)
        node.create_service(Trigger, RESET_SERVICE, self._on_reset)

    def applied(self, areas: NDArray[np.float64]) -> NDArray[np.float64]:
        """The orifice areas that reach the valves, m2: the commanded ones, or all closed."""
        return CLOSED if self.latched else areas

    def trip(self, by: str) -> None:
        """Latch; said once."""
        if not self.latched:
            self.latched = True
            self._node.event(ERROR, "estop", "emergency stop: valves closed", {"by": by})

    def _on_trip(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.trip("service")
        response.success, response.message = True, "emergency stop is latched"
        return response

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = self.latched, "released"
        if not self.latched:
            response.message = "there is no emergency stop to reset"
            return response
        self.latched = False
        self._node.event(OK, "estop_reset", "emergency stop released")
        return response
