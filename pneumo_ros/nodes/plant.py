# SPDX-License-Identifier: Apache-2.0
"""The simulated rig. In lockstep it owns /clock and advances a period once command and road for it are in."""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from rclpy.context import Context
from rclpy.executors import Executor
from std_msgs.msg import String

from pneumo_ros.effects.stepping import stepped_rig
from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointDecoder, JointEncoder, PressureEncoder, encode_clock
from pneumo_ros.nodes.base import OK, RigNode, say, tell_end
from pneumo_ros.nodes.emergency_stop import EmergencyStop
from pneumo_ros.nodes.hand_over import HandOver
from pneumo_ros.nodes.spin import node_main
from pneumo_ros.parameters import Parameter, Value
from pneumo_ros.plant.sensors import NoiseSource
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig
from pneumo_ros.session.timing import Deadlines

SECOND = 1_000_000_000
START_NS = SECOND  # simulation starts at 1 s: to ROS a clock at 0 is a clock that was never set
PROGRESS_PERIOD = 0.2  # s between progress lines on standard output
PARAMETERS: tuple[Parameter, ...] = (
    Parameter("duration", 20.0, "s", "length of the session; 0 runs until stopped", 0.0, 86400.0, read_only=True),
    Parameter("seed", 1, "1", "seed of the sensor noise", 0, 2**31 - 1, read_only=True),
    Parameter("truth_every", 5, "1", "publish /sim/truth every so many periods", 1, 1000, read_only=True),
    Parameter("clock_every", 5, "1", "publish /clock every so many periods (lockstep)", 1, 10, read_only=True),
    Parameter(
        "simulated_rig",
        "",
        "",
        "rig file that is simulated where it is not the one that the session states and believes; empty: `rig`",
        read_only=True,
    ),
    Parameter("report_progress", False, "", "print the simulated time on standard output", read_only=True),
)


class PlantNode(RigNode):
    """Thin shell over :mod:`pneumo_ros.plant.stepping`: the nominal equations, or the rig as it was diagnosed."""

    def __init__(
        self,
        context: Context | None = None,
        overrides: Mapping[str, Value] | None = None,
        hand_over: HandOver | None = None,
    ) -> None:
        super().__init__("plant", PARAMETERS, context=context, overrides=overrides, owns_time=True, hand_over=hand_over)
        self.rig = load_rig(self.values["rig"] or None)
        real = load_rig(self.values["simulated_rig"]) if self.values["simulated_rig"] else self.rig
        self.stepped = stepped_rig(real, self.period_ns / SECOND)
        self.state, self.command = self.stepped.init(), trim(self.rig).command
        self.noise = NoiseSource(self.rig, self.values["seed"])
        self.last = round(self.values["duration"] * self.values["rate_hz"])
        self.index = -1
        self.finished = False
        self.start_ns = START_NS
        self.road = np.zeros((2, 2))
        self._commands: dict[int, NDArray[np.float64]] = {}
        self._roads: dict[int, NDArray[np.float64]] = {}
        self._deadlines: Deadlines | None = None
        self._next_progress = 0.0
        self._make_topics()
        self.estop = EmergencyStop(self)
        # Load the compiled code now: the first period of a real-time session is as short as the others.
        self.stepped.truth(self.stepped.step(self.state, self.command, self.road), self.command, self.road[1])

    def _make_topics(self) -> None:
        variance = self.rig.pressure_noise.value**2
        self._displacement = JointEncoder(topics.DISPLACEMENT.frame_id, topics.DISPLACEMENT.names)
        self._truth = JointEncoder(topics.TRUTH.frame_id, topics.TRUTH.names)
        self._pressures = [PressureEncoder(t.frame_id, variance) for t in (topics.FRONT_PRESSURE, topics.REAR_PRESSURE)]
        self._send_measurement = [self.sender(t) for t in topics.MEASUREMENTS]
        self._publish_truth = self.sender(topics.TRUTH)
        self._send_clock = self.sender(topics.CLOCK) if self.lockstep else None
        self.publisher(topics.CONFIG).publish(String(data=self.rig.to_yaml()))
        self._read_command = JointDecoder(topics.COMMAND.name, topics.COMMAND.names).decode_array
        self._read_road = JointDecoder(topics.ROAD.name, topics.ROAD.names).decode_array
        self.subscribe(topics.COMMAND, self._on_command)
        self.subscribe(topics.ROAD, self._on_road)

    # -- start -----------------------------------------------------------------------------------------------------

    def on_begin(self) -> None:
        """The first sample."""
        self.index = 0
        if not self.lockstep:
            self.start_ns = time.time_ns()
            self._deadlines = Deadlines(time.monotonic_ns(), self.period_ns)
            self.steady_timer(self.period_ns / SECOND, self._tick)
        found = {"effects": ", ".join(one.label for one in self.rig.effects)} if self.rig.effects else {}
        self.event(OK, "session_started", "first sample", {"start_ns": str(self.start_ns), **found})
        self._publish_sample()

    # -- lockstep --------------------------------------------------------------------------------------------------

    def stamp(self, index: int) -> int:
        """Sample time of a period, ns."""
        return self.start_ns + index * self.period_ns

    def _on_command(self, data: bytes) -> None:
        stamp, areas = self._read_command(data)
        self._commands = {stamp: areas}
        if self.lockstep:
            self._advance_if_complete()

    def _on_road(self, data: bytes) -> None:
        stamp, heights = self._read_road(data)
        self._roads[stamp] = heights
        if self.lockstep:
            self._advance_if_complete()

    def _advance_if_complete(self) -> None:
        """A period passes when the command for its sample and the road at its end are in."""
        areas = self._commands.get(self.stamp(self.index))
        heights = self._roads.get(self.stamp(self.index + 1))
        if areas is None or heights is None or self.index < 0 or self.stop.set:
            return
        start = time.monotonic_ns()
        self.command[:] = self.estop.applied(areas)
        self.road[0] = self._roads.pop(self.stamp(self.index), heights)
        self.road[1] = heights
        self._step()
        self.timed(start)

    # -- real time -------------------------------------------------------------------------------------------------

    def _tick(self) -> None:
        deadlines = self._deadlines
        start = time.monotonic_ns()
        if deadlines is None or not deadlines.due(start) or self.stop.set:
            return
        for areas in self._commands.values():
            self.command[:] = self.estop.applied(areas)
        # Skipped periods are simulated, so that the rig keeps pace with the clock; nobody measures in them.
        for _ in range(deadlines.advance(start)):
            self._pass_road()
            self.state = self.stepped.step(self.state, self.command, self.road)
            self.index += 1
        self._pass_road()
        self._step()
        self.timed(start)

    def _pass_road(self) -> None:
        """Road at both ends of the period; a sample that is not in yet leaves the last height."""
        self.road[0] = self.road[1]
        now = self.stamp(self.index + 1)
        for stamp in [s for s in self._roads if s <= now]:
            self.road[1] = self._roads.pop(stamp)

    # -- both ------------------------------------------------------------------------------------------------------

    def _step(self) -> None:
        self.state = self.stepped.step(self.state, self.command, self.road)
        self.index += 1
        self._publish_sample()
        if self.last and self.index >= self.last:
            self.finish("session_complete", "the session's duration has passed")

    def _publish_sample(self) -> None:
        stamp = self.stamp(self.index)
        noise = self.noise.next()
        values = [e + n for e, n in zip(self.stepped.read(self.state), noise, strict=True)]
        if self._send_clock is not None and self.index % self.values["clock_every"] == 0:
            self._send_clock(encode_clock(stamp))
        self._send_measurement[0](self._displacement.encode(stamp, values[:4]))
        self._send_measurement[1](self._pressures[0].encode(stamp, values[4]))
        self._send_measurement[2](self._pressures[1].encode(stamp, values[5]))
        self.send_off()
        if self.index % self.values["truth_every"] == 0:
            known = self.stepped.truth(self.state, self.command, self.road[1])
            self._publish_truth(self._truth.encode(stamp, known.tolist()))
        if self.values["report_progress"] and time.monotonic() > self._next_progress:
            self._next_progress = time.monotonic() + PROGRESS_PERIOD
            say(f"PROGRESS {self.index * self.period_ns / SECOND:.3f}")

    def finish(self, code: str, message: str) -> None:
        """End the session."""
        self.finished = True
        self.event(OK, code, message, {"samples": str(self.index + 1)})
        self.stop.set = True

    def on_stop(self, executor: Executor) -> None:
        """Say how far the session came, if it was ended from outside."""
        if not self.finished and self.index >= 0:
            tell_end(self, self.index * self.period_ns / SECOND, {"samples": str(self.index + 1)})
        super().on_stop(executor)

    def health(self) -> dict[str, str]:
        """Loop figures and missed deadlines."""
        missed = self._deadlines.missed if self._deadlines else 0
        return {**super().health(), "missed periods": str(missed)}


def main(args: list[str] | None = None) -> int:
    """Entry point of ``plant``."""
    return node_main(PlantNode, args)


if __name__ == "__main__":
    raise SystemExit(main())
