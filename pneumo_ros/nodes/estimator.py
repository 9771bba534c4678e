"""Estimate motion and effective areas from the six measurements of each sample."""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np
from rclpy.context import Context

from pneumo_ros.estimation.half_car import PARAMETERS, Estimator, EstimatorState, build_estimator
from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointDecoder, JointEncoder, decode_pressure
from pneumo_ros.nodes.base import RigNode
from pneumo_ros.nodes.spin import node_main
from pneumo_ros.parameters import Value
from pneumo_ros.rig import load_rig


class EstimatorNode(RigNode):
    """Thin shell over :mod:`pneumo_ros.estimation.half_car`."""

    def __init__(self, context: Context | None = None, overrides: Mapping[str, Value] | None = None) -> None:
        super().__init__("estimator", PARAMETERS, context=context, overrides=overrides)
        self.rig = load_rig(self.values["rig"] or None)
        self.estimator = self._build()
        # Load the compiled code now: the first period of a real-time session is as short as the others.
        self.estimator.step(self.estimator.init(np.zeros(6)), np.full(6, 2e5))
        self.state: EstimatorState | None = None
        self._sample = np.zeros(6)
        self._stamps = [0, 0, 0]
        self._last_stamp = 0
        self._encode = JointEncoder(topics.ESTIMATE.frame_id, topics.ESTIMATE.names).encode_array
        self._publish = self.publisher(topics.ESTIMATE).publish
        self._read = JointDecoder(topics.DISPLACEMENT.name, topics.DISPLACEMENT.names).decode_array
        self.subscribe(topics.DISPLACEMENT, self._on_displacement)
        self.subscribe(topics.FRONT_PRESSURE, lambda data: self._on_pressure(1, data))
        self.subscribe(topics.REAR_PRESSURE, lambda data: self._on_pressure(2, data))

    def _build(self) -> Estimator:
        values = {p.name: self.values[p.name] for p in PARAMETERS}
        return build_estimator(self.rig, self.period_ns * 1e-9, values, self.get_name())

    def on_parameters(self, changed: Mapping[str, Value]) -> None:
        """Rebuild with the new gains; the state goes on."""
        self.estimator = self._build()

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
        if self.state is None or not self.continues(stamp, self._last_stamp):
            self.state = self.estimator.init(self._sample)
        self._last_stamp = stamp
        self.state, estimate = self.estimator.step(self.state, self._sample)
        self._publish(self._encode(stamp, estimate))
        self.timed(start)


def main(args: list[str] | None = None) -> int:
    """Entry point of ``estimator``."""
    return node_main(EstimatorNode, args)


if __name__ == "__main__":
    raise SystemExit(main())
