# SPDX-License-Identifier: Apache-2.0
"""What the driver measures and applies as messages: the plant's topics, raw counts, supply pressure, openings."""

from __future__ import annotations

import time
from collections import deque

from pneumo_ros.daq.actuation import Applied
from pneumo_ros.daq.frames import DeviceState
from pneumo_ros.daq.intake import Measurement
from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointEncoder, PressureEncoder
from pneumo_ros.nodes.base import RigNode
from pneumo_ros.rig import Rig

SLEW_NS = 400_000  # ns the mapping to ROS time may move a second; less than a sample, so stamps never run back
KEPT = 100  # samples a command may answer; far more than its age limit allows
STEP_NS = 100_000_000  # ns: more than slewing accounts for; somebody set the clock


class WallClock:
    """Monotonic time to ROS time and back, following a disciplined clock without a jump in the stamps."""

    def __init__(self) -> None:
        self.offset_ns = time.time_ns() - time.monotonic_ns()

    def ros(self, monotonic_ns: int) -> int:
        """ROS (system) time, ns."""
        return monotonic_ns + self.offset_ns

    def monotonic(self, ros_ns: int) -> int:
        """Inverse of :meth:`ros`."""
        return ros_ns - self.offset_ns

    def follow(self) -> int:
        """Call once a second; returns how far the system's clock is ahead of the stamps, ns."""
        ahead = time.time_ns() - time.monotonic_ns() - self.offset_ns
        if abs(ahead) < STEP_NS:
            self.offset_ns += min(max(ahead, -SLEW_NS), SLEW_NS)
        return ahead


class MeasurementOutput:
    """Publishes every sample's raw counts, and at the control rate what estimator and controller need.

    The control loop's topics begin with the first sample of the armed board, which is also where the road begins, and
    go on after a trip, so that the log shows what happened then. A sample with a channel that cannot be believed is
    left out.

    Parameters
    ----------
    node : owns the publishers
    rig : declared noise
    wall : time base of the stamps
    """

    def __init__(self, node: RigNode, rig: Rig, wall: WallClock) -> None:
        self.decimation = 1
        self.first: Measurement | None = None
        self.withheld = 0
        self._given: deque[int] = deque(maxlen=KEPT)
        self._wall = wall
        variance = rig.pressure_noise.value**2
        joints = (topics.DISPLACEMENT, topics.RAW, topics.APPLIED)
        self._joint = {t: JointEncoder(t.frame_id, t.names) for t in joints}
        pressures = (topics.FRONT_PRESSURE, topics.REAR_PRESSURE, topics.SUPPLY_PRESSURE)
        self._pressures = [PressureEncoder(t.frame_id, variance) for t in pressures]
        self._send_joint = {t: node.publisher(t).publish for t in self._joint}
        self._send_pressure = [node.publisher(t).publish for t in pressures]

    def send_applied(self, applied: Applied) -> None:
        """Publish an opening that went to the valves, stamped when it did; called from the driver's threads."""
        stamp = self._wall.ros(applied.time_ns)
        self._send_joint[topics.APPLIED](self._joint[topics.APPLIED].encode(stamp, applied.areas))

    def gave(self, stamp: int) -> bool:
        """Whether one of the last samples published has this stamp: a command for any other is nobody's answer."""
        return stamp in self._given

    def send(self, measurement: Measurement) -> None:
        """Publish one measurement; called from the driver's thread."""
        stamp = self._wall.ros(measurement.stamp_ns)
        self._send_joint[topics.RAW](self._joint[topics.RAW].encode(stamp, measurement.counts))
        if self.first is None:
            if measurement.state is not DeviceState.ARMED:
                return
            self.first = measurement
        if (measurement.sequence - self.first.sequence) % self.decimation:
            return
        values = measurement.values
        if measurement.valid[6]:
            self._send_pressure[2](self._pressures[2].encode(stamp, values[6]))
        if not measurement.usable:
            self.withheld += 1
            return
        self._given.append(stamp)
        self._send_joint[topics.DISPLACEMENT](self._joint[topics.DISPLACEMENT].encode(stamp, values[:4]))
        self._send_pressure[0](self._pressures[0].encode(stamp, values[4]))
        self._send_pressure[1](self._pressures[1].encode(stamp, values[5]))
