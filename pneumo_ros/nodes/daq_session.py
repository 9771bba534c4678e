# SPDX-License-Identifier: Apache-2.0
"""A session on hardware: start when everybody is ready, deactivate on a trip, end after its duration."""

from __future__ import annotations

import sys
import time

from rclpy.lifecycle import LifecycleNodeMixin, TransitionCallbackReturn

from pneumo_ros.daq.actuation import Mode
from pneumo_ros.daq.driver import SerialDriver
from pneumo_ros.daq.reasons import Event
from pneumo_ros.nodes.base import ERROR, OK, RigNode, say, tell_end
from pneumo_ros.nodes.daq_output import WallClock

LOOK_PERIOD = 0.01  # s between looks at the driver's mode
PROGRESS_PERIOD = 0.2  # s between progress lines
TRIPPED, NOT_STARTED = 1, 2  # exit codes


class HardwareNode(LifecycleNodeMixin, RigNode):
    """A node with a life cycle that drives hardware, as far as a session needs to know it.

    Attributes
    ----------
    driver : None while unconfigured
    reason : why the last transition was refused
    wall : monotonic time to ROS time
    """

    driver: SerialDriver | None
    reason: str
    wall: WallClock

    @property
    def state_label(self) -> str:
        """Life cycle state: unconfigured, inactive, active or finalized."""
        return str(self._state_machine.current_state[1])

    def blockers(self) -> list[str]:
        """Why the valves cannot be armed; empty if they can."""
        raise NotImplementedError


class HardwareSession:
    """Triggers the node's transitions from the executor's thread, where they belong.

    Parameters
    ----------
    node : its parameters autostart, arm_patience, duration and report_progress are obeyed
    """

    def __init__(self, node: HardwareNode) -> None:
        self._node = node
        self._asked = self._next_progress = 0.0
        self._first_ns = 0
        self._over = False
        node.steady_timer(LOOK_PERIOD, self._look)

    def begin(self) -> None:
        """Every node of the session is ready."""
        if self._node.values["autostart"]:
            self._asked = time.monotonic()

    def tell_end(self) -> None:
        """Say how far the session came, if it was ended from outside, and whether the valves were driven until then."""
        if not self._first_ns or self._over:
            return
        tell_end(self._node, (time.monotonic_ns() - self._first_ns) * 1e-9)
        trip = self._node.driver.core.trip if self._node.driver is not None else None
        if trip is not None and not self._node.exit_code:
            self._node.exit_code = TRIPPED
            say(self._made_safe(trip), sys.stderr)

    def _made_safe(self, trip: Event) -> str:
        after = (trip.time_ns - self._first_ns) * 1e-9
        return f"valves were made safe {after:.3f} s after arming: {trip.message}"

    def _look(self) -> None:
        node, state = self._node, self._node.state_label
        if node.stop.set:
            return
        if node.driver is not None and node.driver.failed:
            trip = node.driver.core.trip
            self._end(TRIPPED, f"error: {trip.message if trip else 'the driver failed'}")
        elif self._asked and not self._first_ns:
            self._start(state)
        elif state == "active" and node.driver is not None and node.driver.core.mode is not Mode.ARMED:
            node.trigger_deactivate()
        if self._first_ns:
            self._pass((time.monotonic_ns() - self._first_ns) * 1e-9)

    def _start(self, state: str) -> None:
        node, done = self._node, TransitionCallbackReturn.SUCCESS
        if state == "unconfigured" and node.trigger_configure() is not done:
            self._give_up(node.reason)
        elif state == "inactive" and node.driver is not None:
            why = node.blockers()
            if not why and node.trigger_activate() is done:
                self._first_ns = time.monotonic_ns()
                node.event(OK, "session_started", "valves armed", {"start_ns": str(node.wall.ros(self._first_ns))})
            elif time.monotonic() - self._asked > node.values["arm_patience"]:
                self._give_up(f"cannot arm: {'; '.join(why) or node.reason}")

    def _give_up(self, why: str) -> None:
        self._node.event(ERROR, "session_not_started", why)
        self._end(NOT_STARTED, f"error: {why}")

    def _pass(self, elapsed: float) -> None:
        values = self._node.values
        if values["report_progress"] and elapsed >= self._next_progress:
            self._next_progress = elapsed + PROGRESS_PERIOD
            say(f"PROGRESS {elapsed:.3f}")
        if 0.0 < values["duration"] <= elapsed:
            self._finish()

    def _finish(self) -> None:
        node = self._node
        trip = node.driver.core.trip if node.driver is not None else None
        if node.state_label == "active":
            node.trigger_deactivate()
        elif trip is not None:
            self._end(TRIPPED, self._made_safe(trip))
        self._over = True
        node.event(OK, "session_complete", "the session's duration has passed")
        node.stop.set = True

    def _end(self, code: int, words: str) -> None:
        say(words, sys.stderr)
        self._node.exit_code, self._node.stop.set = code, True
