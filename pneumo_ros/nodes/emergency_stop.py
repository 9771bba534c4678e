# SPDX-License-Identifier: Apache-2.0
"""Latched emergency stop of the node that owns the valves: a topic and a service set it, only a service releases it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from std_srvs.srv import Trigger

from pneumo_ros.log.topics import ESTOP
from pneumo_ros.nodes.base import ERROR, OK, RigNode

TRIP_SERVICE, RESET_SERVICE = "/rig/estop_trip", "/rig/estop_reset"
_FLAG = 4  # offset of the bool in a serialised std_msgs/Bool
CLOSED = np.zeros(4)  # m2: closed valves hold the air in the springs, as without power


class EmergencyStop:
    """The latch.

    Parameters
    ----------
    node : owner of the valves; the latch subscribes and offers the services on it
    may_release : says why a release must be refused, or ''

    Attributes
    ----------
    latched : True from the first request to a granted release
    """

    def __init__(self, node: RigNode, may_release: Callable[[], str] = lambda: "") -> None:
        self.latched = False
        self._node, self._may_release = node, may_release
        node.subscribe(ESTOP, self._on_topic)
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

    def _on_topic(self, data: bytes) -> None:
        # `false` does nothing: a publisher that comes and goes must not release the rig.
        if len(data) > _FLAG and data[_FLAG]:
            self.trip("topic")

    def _on_trip(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.trip("service")
        response.success, response.message = True, "emergency stop is latched"
        return response

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        why = self._may_release()
        response.success, response.message = not why, why or "released"
        if self.latched and not why:
            self.latched = False
            self._node.event(OK, "estop_reset", "emergency stop released")
        return response
