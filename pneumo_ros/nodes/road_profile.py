# SPDX-License-Identifier: Apache-2.0
"""Publish the road under both axles: ahead of the clock, so that a simulated period's end is known when it starts, or
on hardware, where the exciter begins with the first sample of the armed board, under the stamps of the samples."""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np
from rclpy.context import Context
from std_msgs.msg import String

from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointEncoder, stamp_of
from pneumo_ros.nodes.base import RigNode
from pneumo_ros.nodes.hand_over import HandOver
from pneumo_ros.nodes.qos import publisher_qos
from pneumo_ros.nodes.spin import node_main
from pneumo_ros.parameters import Value
from pneumo_ros.rig import load_rig
from pneumo_ros.road import PARAMETERS, build_road

BLOCK = 1024  # samples computed at once
LEAD = 16  # samples ahead of the clock, which ticks every few periods only (plant: clock_every)


class RoadProfileNode(RigNode):
    """Thin shell over :mod:`pneumo_ros.road`."""

    def __init__(
        self,
        context: Context | None = None,
        overrides: Mapping[str, Value] | None = None,
        hand_over: HandOver | None = None,
    ) -> None:
        super().__init__("road_profile", PARAMETERS, context=context, overrides=overrides, hand_over=hand_over)
        rig = load_rig(self.values["rig"] or None)
        wanted = {p.name: self.values[p.name] for p in PARAMETERS}
        self.road = build_road(
            wanted, wheelbase=rig.wheelbase, length_scale=rig.length_scale.value, where=self.get_name()
        )
        self._encode = JointEncoder(topics.ROAD.frame_id, topics.ROAD.names, with_velocity=True).encode
        self._publish = self.sender(topics.ROAD)
        self._start: int | None = None
        self._sent = -1
        self._block = -1
        self._heights: list[list[float]] = []
        self._rates: list[list[float]] = []
        self._last = 0
        self._load(0)
        if "daq" in self.session_nodes:
            # Reliable: a node that is held up and misses the first samples would begin the road that much too late.
            qos = publisher_qos(topics.DISPLACEMENT.flow, lockstep=False)
            self.subscribe(topics.DISPLACEMENT, self._on_sample, qos)
        else:
            self.subscribe(topics.CLOCK if self.lockstep else topics.DISPLACEMENT, self._on_time)

    def _on_time(self, data: bytes) -> None:
        start = time.monotonic_ns()
        # A Clock and a header's stamp begin alike.
        now = stamp_of(data)
        if self._start is None:
            self._start = now
        index = round((now - self._start) / self.period_ns) + LEAD
        # A clock that jumps ahead leaves a hole in the road; filling it would flood the log.
        for i in range(max(self._sent + 1, index - BLOCK), index + 1):
            self._send(i, self._start + i * self.period_ns)
        self.send_off()
        self._sent = max(self._sent, index)
        self.timed(start)

    def _on_sample(self, data: bytes) -> None:
        """The height that the exciter has at this sample, under the sample's own stamp.

        The board counts periods on its own clock, and its samples' stamps follow what is known of that clock: a road
        that went on by this computer's would leave them, by 1 ms in ten seconds at 100 ppm.
        """
        start = time.monotonic_ns()
        now = stamp_of(data)
        passed = 1 if self._start is None else max(1, round((now - self._last) / self.period_ns))
        self._start = now if self._start is None else self._start
        for behind in range(min(passed, BLOCK) - 1, -1, -1):  # samples that were withheld or lost
            self._send(self._sent + passed - behind, now - behind * self.period_ns)
        self.send_off()
        self._sent, self._last = self._sent + passed, now
        self.timed(start)

    def _send(self, index: int, stamp: int) -> None:
        block, row = divmod(index, BLOCK)
        if block != self._block:
            self._load(block)
        self._publish(self._encode(stamp, self._heights[row], self._rates[row]))

    def _load(self, block: int) -> None:
        heights, rates = self.road.sample((block * BLOCK + np.arange(BLOCK)) * self.period_ns * 1e-9)
        self._heights, self._rates, self._block = heights.tolist(), rates.tolist(), block

    def publish_setup(self) -> None:
        """Parameters and the road's full specification."""
        super().publish_setup()
        self._setup.publish(String(data=f"node: {self.get_name()}\n{self.road.spec.to_yaml()}"))


def main(args: list[str] | None = None) -> int:
    """Entry point of ``road_profile``."""
    return node_main(RoadProfileNode, args)


if __name__ == "__main__":
    raise SystemExit(main())
