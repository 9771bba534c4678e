# SPDX-License-Identifier: Apache-2.0
"""Estimate motion and effective areas from the six measurements of each sample."""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np
from rclpy.context import Context

from pneumo_ros.estimation.half_car import PARAMETERS
from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointDecoder, JointEncoder, decode_pressure
from pneumo_ros.nodes.hand_over import HandOver
from pneumo_ros.nodes.spin import node_main
from pneumo_ros.nodes.stage import StageNode
from pneumo_ros.parameters import Value
from pneumo_ros.session.stages import EstimatorStage


class EstimatorNode(StageNode[EstimatorStage]):
    """Thin shell over :class:`~pneumo_ros.session.stages.EstimatorStage`."""

    def __init__(
        self,
        context: Context | None = None,
        overrides: Mapping[str, Value] | None = None,
        hand_over: HandOver | None = None,
    ) -> None:
        super().__init__("estimator", PARAMETERS, EstimatorStage, context, overrides, hand_over)
        self._sample = np.zeros(6)
        self._stamps = [0, 0, 0]
        self._encode = JointEncoder(topics.ESTIMATE.frame_id, topics.ESTIMATE.names).encode_array
        self._publish = self.sender(topics.ESTIMATE)
        self._read = JointDecoder(topics.DISPLACEMENT.name, topics.DISPLACEMENT.names).decode_array
        self.subscribe(topics.DISPLACEMENT, self._on_displacement)
        self.subscribe(topics.FRONT_PRESSURE, lambda data: self._on_pressure(1, data))
        self.subscribe(topics.REAR_PRESSURE, lambda data: self._on_pressure(2, data))

    def _on_displacement(self, data: bytes) -> None:
        self._stamps[0], self._sample[:4] = self._read(data)
        self._step_if_complete()

    def _on_pressure(self, index: int, data: bytes) -> None:
        self._stamps[index], self._sample[3 + index] = decode_pressure(data)
        self._step_if_complete()

    def _step_if_complete(self) -> None:
        """The three messages of a sample may come in any order; they belong together by stamp."""
        stamp = self._stamps[0]
        if stamp != self._stamps[1] or stamp != self._stamps[2]:
            return
        start = time.monotonic_ns()
        self._publish(self._encode(stamp, self.advance(stamp, self._sample).values))
        self.send_off()
        self.timed(start)


def main(args: list[str] | None = None) -> int:
    """Entry point of ``estimator``."""
    return node_main(EstimatorNode, args)


if __name__ == "__main__":
    raise SystemExit(main())
