# SPDX-License-Identifier: Apache-2.0
"""Command the valves from the estimate; never a value that is not finite, never outside the valve's range."""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np
import yaml
from rclpy.context import Context
from std_msgs.msg import String

from pneumo_ros.control.half_car import PARAMETERS as CONTROL_PARAMETERS
from pneumo_ros.daq.safety_config import load_safety
from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointDecoder, JointEncoder
from pneumo_ros.nodes.base import ERROR, WARN
from pneumo_ros.nodes.hand_over import HandOver
from pneumo_ros.nodes.spin import node_main
from pneumo_ros.nodes.stage import StageNode
from pneumo_ros.parameters import Parameter, Value
from pneumo_ros.session.stages import ControllerStage

PARAMETERS: tuple[Parameter, ...] = (
    *CONTROL_PARAMETERS,
    Parameter("safety", "", "", "safety file (YAML); empty for config/safety.yaml", read_only=True),
    Parameter("telemetry_every", 5, "1", "publish /controller/sliding every so many steps", 1, 1000, read_only=True),
)


WATCH_PERIOD = 0.004  # s between looks at the estimate's age, real time only


class ControllerNode(StageNode[ControllerStage]):
    """Thin shell over :class:`~pneumo_ros.session.stages.ControllerStage`: a controller, or a valve profile.

    In real time it is the first of three watchdogs: without a fresh estimate it sends the safe command, whatever the
    driver and the board behind it do.
    """

    def __init__(
        self,
        context: Context | None = None,
        overrides: Mapping[str, Value] | None = None,
        hand_over: HandOver | None = None,
    ) -> None:
        super().__init__("controller", PARAMETERS, ControllerStage, context, overrides, hand_over)
        self._command = JointEncoder(topics.COMMAND.frame_id, topics.COMMAND.names).encode_array
        self._sliding = JointEncoder(topics.SLIDING.frame_id, topics.SLIDING.names).encode_array
        self._publish = self.sender(topics.COMMAND)
        self._publish_sliding = self.sender(topics.SLIDING)
        self._read = JointDecoder(topics.ESTIMATE.name, topics.ESTIMATE.names).decode_array
        self._steps = 0
        self._last_ns = self._last_stamp = self._said = 0
        self._refused = 0
        self._stale = False
        safety = load_safety(self.values["safety"] or None)
        self._closed, self._timeout_ns = np.array(safety.safe_command), round(safety.timeouts.estimate * 1e9)
        if not self.lockstep:
            self.steady_timer(WATCH_PERIOD, self._watch)
        self.subscribe(topics.ESTIMATE, self._on_estimate)

    def publish_setup(self) -> None:
        """Parameters, and which profile is played."""
        super().publish_setup()
        if self.stage.profile is not None:
            played = {"node": self.get_name(), "valves": self.stage.profile.describe()}
            self._setup.publish(String(data=yaml.safe_dump(played, sort_keys=False)))

    def _on_estimate(self, data: bytes) -> None:
        start = time.monotonic_ns()
        stamp, estimate = self._read(data)
        if stamp <= self._said and stamp > self._last_stamp:
            return  # the safe command has overtaken this sample; a command's stamp never goes back
        self._last_ns, self._last_stamp, self._stale = start, stamp, False
        output = self.advance(stamp, estimate)
        self._said = stamp
        self._publish(self._command(stamp, output.values))
        self.send_off()
        if output.refused:
            self._say_refused(stamp)
        if self._steps % self.values["telemetry_every"] == 0:
            self._publish_sliding(self._sliding(stamp, output.telemetry))
        self._steps += 1
        self.timed(start)

    def _watch(self) -> None:
        """Safe command for as long as no fresh estimate comes; monotonic time."""
        age = time.monotonic_ns() - self._last_ns
        if not self._last_ns or age <= self._timeout_ns or self.stop.set:
            return
        # The time since the last sample, on its clock: neither simulated time nor a clock that was set matters.
        self._said = self._last_stamp + age
        self._publish(self._command(self._said, self._closed))
        if not self._stale:  # told once the valves are asked to close, for telling takes its time
            self._stale = True
            self.event(WARN, "estimate_stale", f"no estimate for {age / 1e6:.1f} ms: safe command")

    def _say_refused(self, stamp: int) -> None:
        """Valves at trim instead of a command that is not finite; said once a second at most."""
        if self._refused % round(self.values["rate_hz"]) == 0:
            self.event(ERROR, "command_not_finite", "valves at trim instead", {"stamp_ns": str(stamp)})
        self._refused += 1

    def health(self) -> dict[str, str]:
        """Loop figures and refused commands."""
        return {**super().health(), "refused commands": str(self._refused)}


def main(args: list[str] | None = None) -> int:
    """Entry point of ``controller``."""
    return node_main(ControllerNode, args)


if __name__ == "__main__":
    raise SystemExit(main())
