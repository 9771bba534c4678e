# SPDX-License-Identifier: Apache-2.0
"""Driver core, board rules and emulated rig on one simulated clock: no port, no thread, no waiting."""

from __future__ import annotations

from collections.abc import Callable

from pneumo_ros.daq.actuation import Mode
from pneumo_ros.daq.calibration_file import load_calibration
from pneumo_ros.daq.core import DriverCore
from pneumo_ros.daq.emulator.board import board_identity
from pneumo_ros.daq.emulator.device import Device
from pneumo_ros.daq.emulator.simulation import RigSimulation, SimulationSettings
from pneumo_ros.daq.frames import DeviceState, Hello
from pneumo_ros.daq.intake import Measurement
from pneumo_ros.daq.reasons import Event, Reason
from pneumo_ros.daq.safety_config import SafetyConfig, load_safety
from pneumo_ros.rig import load_rig
from pneumo_ros.road import Road, build_road

MS = 1_000_000  # ns
START = 5_000_000_000
RIG = load_rig()
FLAT = build_road({"kind": "flat"}, wheelbase=RIG.wheelbase)
SAFE = (0, 0, 0, 0)


class Bench:
    """A driver core and a board on one simulated clock, 1 ms a step, a controller at 500 Hz."""

    def __init__(
        self,
        hello: Hello | None = None,
        calibration: str = "appendix_c_corrected",
        safety: SafetyConfig | None = None,
        road: Road = FLAT,
    ) -> None:
        self.now, self.rows = START, 0
        self.zero = START  # when the device's clock began
        self.hello = hello or board_identity()
        lines = load_calibration(calibration)
        self.simulation = RigSimulation(
            RIG, road, self.hello._replace(inputs=board_identity().inputs), lines, SimulationSettings()
        )
        self.to_host, self.to_board = bytearray(), bytearray()
        self.outputs: list[tuple[int, tuple[int, ...]]] = []
        self.core = DriverCore(safety or load_safety(), lines, RIG, self.to_board.extend)
        self.events: list[Event] = []
        self.measurements: list[Measurement] = []
        self.controller: Callable[[Measurement], None] | None = None
        self.spoil: Callable[[list[int]], None] = lambda counts: None
        self.up: Callable[[bytes], bytes] = lambda data: data
        self.down: Callable[[bytes], bytes] = lambda data: data
        self.pressed = self.converter_fails = False
        self.boot()
        self.core.opened(self.now)

    def boot(self) -> None:
        self.device = Device(self.hello, self.to_host.extend, self._write)
        self.device.boot(self.us)

    @property
    def us(self) -> int:
        return (self.now - self.zero) // 1000 % 2**32

    def _write(self, counts: tuple[int, ...]) -> None:
        self.simulation.write_outputs(counts)
        self.outputs.append((self.now, counts))

    def run(self, milliseconds: int) -> Bench:
        for _ in range(milliseconds):
            self.now += MS
            self.simulation.advance()
            counts = list(self.simulation.convert(self.simulation.values()))
            self.spoil(counts)
            self.device.tick(self.us, None if self.converter_fails else tuple(counts), self.pressed)
            self.core.receive(self.up(bytes(self.to_host)), self.now + MS // 10)
            self.to_host.clear()
            self.core.tick(self.now + MS // 5)
            self._take()
            self.device.receive(self.down(bytes(self.to_board)), self.us)
            self.to_board.clear()
        return self

    def _take(self) -> None:
        for item in self.core.drain():
            if isinstance(item, Event):
                self.events.append(item)
                continue
            self.measurements.append(item)
            if self.controller and item.usable and item.sequence % 2 == 0:
                self.controller(item)

    def hold_trim(self, item: Measurement) -> None:
        self.core.command(self.simulation.trim.command.tolist(), item.stamp_ns, self.now)

    def armed(self) -> Bench:
        self.controller = self.hold_trim
        self.run(700)
        assert self.core.arm(self.now) == []
        self.run(300)
        assert self.core.mode is Mode.ARMED and self.device.state is DeviceState.ARMED
        return self

    def reasons(self) -> list[Reason]:
        return [event.reason for event in self.events]

    def safe_after(self, start: int) -> float:
        """ms from ``start`` until the outputs became safe for good."""
        last_driven = max((when for when, counts in self.outputs if counts != SAFE), default=0)
        first_safe = min(when for when, counts in self.outputs if counts == SAFE and when >= last_driven)
        return (first_safe - start) / MS

    def refuses_to_move_until_armed(self) -> None:
        """The controller goes on, nothing reaches the valves."""
        before = len(self.outputs)
        self.run(1500)
        assert self.core.mode is not Mode.ARMED
        assert all(counts == SAFE for _, counts in self.outputs[before:])
