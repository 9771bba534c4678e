# SPDX-License-Identifier: Apache-2.0
"""The device's behaviour in Python, rule by rule as firmware/src/core.c.

The emulator runs it; the shared vectors of firmware/vectors hold both to one behaviour.

The numbered rules are those of docs/serial-protocol.md, "What the device does".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from pneumo_ros.daq.frames import (
    INPUT_COUNT,
    Command,
    CommandFlag,
    DeviceFault,
    DeviceState,
    Hello,
    HelloRequest,
    Record,
    Sample,
    SampleFlag,
    Status,
    encode,
)
from pneumo_ros.daq.stream import StreamDecoder

STATUS_PERIOD_US = 100_000
CONVERTER_FAILURES = 5  # in a row, while armed
NO_FLAGS = SampleFlag(0)
_WRAP = 1 << 32
SPREAD = 2_654_435_761  # Knuth's multiplier: sessions of neighbouring boot ids lie far apart


@dataclass
class Device:
    """One board: call :meth:`boot` once, :meth:`receive` with bytes from the host, :meth:`tick` once a sample period.

    Parameters
    ----------
    identity : what HELLO says
    send : takes bytes for the host
    write_outputs : sets the valves' DAC counts
    """

    identity: Hello
    send: Callable[[bytes], None]
    write_outputs: Callable[[tuple[int, ...]], None]
    state: DeviceState = DeviceState.SAFE
    fault: DeviceFault = DeviceFault.NONE
    outputs: tuple[int, ...] = ()
    decoder: StreamDecoder = field(default_factory=StreamDecoder)
    refused_commands: int = 0
    session: int = 0
    _flags: SampleFlag = NO_FLAGS
    _may_arm: bool = False
    _has_sequence: bool = False
    _command_sequence: int = 0
    _command_us: int = 0
    _sample_sequence: int = 0
    _status_us: int = 0
    _converter_failures: int = 0

    def boot(self, now_us: int) -> None:
        """Rule 1: safe outputs, then the announcement."""
        self._set_safe_outputs()
        self._status_us = now_us
        self.session = self.identity.boot_id * SPREAD % _WRAP
        self._send_hello(0, now_us)

    def power_down(self) -> None:
        """The outputs without power, which is the safe state."""
        self._set_safe_outputs()

    @property
    def samples(self) -> int:
        """Sequence of the next sample."""
        return self._sample_sequence

    def receive(self, data: bytes, now_us: int) -> None:
        """Bytes from the host, in any portions; ``now_us`` is the device clock, us."""
        for record in self.decoder.feed(data):
            self._on_record(record, now_us)

    def tick(self, now_us: int, counts: tuple[int, ...] | None, estop_pressed: bool = False) -> None:
        """One sample period: e-stop input, watchdog, conversion, SAMPLE and STATUS.

        Parameters
        ----------
        now_us : device clock at the conversion, us
        counts : raw counts in HELLO's order; None if the converter did not answer
        estop_pressed : the hardware input
        """
        self._check_estop_input(estop_pressed, now_us)
        if self.state is DeviceState.ARMED and (now_us - self._command_us) % _WRAP > self.identity.watchdog_us:
            self._leave_armed(DeviceState.SAFE, DeviceFault.WATCHDOG, now_us)
        self._check_converter(counts is None, now_us)
        self._send_sample(now_us, counts or (0,) * INPUT_COUNT)
        if (now_us - self._status_us) % _WRAP >= STATUS_PERIOD_US:
            self._send_status(now_us)

    def _on_record(self, record: Record, now_us: int) -> None:
        if isinstance(record, Command):
            self._on_command(record, now_us)
        elif isinstance(record, HelloRequest):
            self._on_hello_request(record, now_us)

    def _on_hello_request(self, request: HelloRequest, now_us: int) -> None:
        if self.state is DeviceState.ARMED:
            self._leave_armed(DeviceState.SAFE, DeviceFault.HANDSHAKE, now_us)
        self.session = (self.session + 1) % _WRAP
        self._may_arm = self._has_sequence = False
        self._command_sequence = 0
        self._send_hello(request.nonce, now_us)

    def _on_command(self, command: Command, now_us: int) -> None:
        if not self._acceptable(command):  # rule 2
            self.refused_commands += 1
            return
        self._has_sequence = True
        self._command_sequence, self._command_us = command.sequence, now_us
        if command.flags & CommandFlag.ESTOP:  # rule 6
            if self.state is not DeviceState.ESTOP:
                self._leave_armed(DeviceState.ESTOP, DeviceFault.ESTOP_COMMAND, now_us)
        elif self.state is DeviceState.ARMED:
            self._when_armed(command, now_us)
        elif self.state is DeviceState.SAFE:
            self._when_safe(command, now_us)
        else:
            self._when_stopped(command, now_us)

    def _acceptable(self, command: Command) -> bool:
        top = (1 << self.identity.dac_bits) - 1
        ahead = (command.sequence - self._command_sequence) % _WRAP
        newer = not self._has_sequence or 0 < ahead < _WRAP // 2
        own = command.session == self.session
        return own and newer and self._fresh(command) and all(count <= top for count in command.counts)

    def _fresh(self, command: Command) -> bool:
        """What opens valves or ends a stop answers a sample of just now; what closes them may be of any age."""
        if not command.flags & (CommandFlag.ARM | CommandFlag.RESET):
            return True
        behind = (self._sample_sequence - command.sample) % _WRAP
        return behind * self.identity.sample_period_us <= self.identity.watchdog_us

    def _when_safe(self, command: Command, now_us: int) -> None:
        """Rule 3: arming needs the edge."""
        if not command.flags & CommandFlag.ARM:
            self._may_arm = True
            return
        if not self._may_arm or self._flags & SampleFlag.ESTOP_PRESSED or self._converter_failures:
            return
        self._may_arm = False
        self.state = DeviceState.ARMED
        self._set_outputs(command.counts)
        self._send_status(now_us)

    def _when_armed(self, command: Command, now_us: int) -> None:
        """Rule 4."""
        if command.flags & CommandFlag.ARM:
            self._set_outputs(command.counts)
        else:
            self._leave_armed(DeviceState.SAFE, DeviceFault.HOST_DISARMED, now_us)

    def _when_stopped(self, command: Command, now_us: int) -> None:
        """Rule 6: only RESET without ARM, with the input released, ends the latch."""
        reset = command.flags & CommandFlag.RESET and not command.flags & CommandFlag.ARM
        if not reset or self._flags & SampleFlag.ESTOP_PRESSED:
            return
        self.state = DeviceState.SAFE
        self._may_arm = False
        self._send_status(now_us)

    def _check_estop_input(self, pressed: bool, now_us: int) -> None:
        self._flags &= ~SampleFlag.ESTOP_PRESSED
        if not pressed:
            return
        self._flags |= SampleFlag.ESTOP_PRESSED
        if self.state is not DeviceState.ESTOP:
            self._leave_armed(DeviceState.ESTOP, DeviceFault.ESTOP_INPUT, now_us)

    def _check_converter(self, failed: bool, now_us: int) -> None:
        """Rule 7."""
        self._flags &= ~SampleFlag.CONVERTER_FAILED
        if not failed:
            self._converter_failures = 0
            return
        self._flags |= SampleFlag.CONVERTER_FAILED
        self._converter_failures += 1
        if self.state is DeviceState.ARMED and self._converter_failures >= CONVERTER_FAILURES:
            self._leave_armed(DeviceState.SAFE, DeviceFault.CONVERTER, now_us)

    def _leave_armed(self, to: DeviceState, fault: DeviceFault, now_us: int) -> None:
        """Rule 8: outputs first, then the word about it."""
        self._set_safe_outputs()
        self.state, self.fault = to, fault
        self._may_arm = False
        self._send_status(now_us)

    def _set_safe_outputs(self) -> None:
        self._set_outputs(tuple(entry.safe for entry in self.identity.outputs))

    def _set_outputs(self, counts: tuple[int, ...]) -> None:
        self.outputs = counts
        self.write_outputs(counts)

    def _send_hello(self, nonce: int, now_us: int) -> None:
        self.send(encode(self.identity._replace(nonce=nonce, session=self.session, device_us=now_us)))

    def _send_sample(self, now_us: int, counts: tuple[int, ...]) -> None:
        self.send(encode(Sample(self.session, self._sample_sequence, now_us, self.state, self._flags, counts)))
        self._sample_sequence = (self._sample_sequence + 1) % _WRAP

    def _send_status(self, now_us: int) -> None:
        self._status_us = now_us
        self.send(encode(self._status(now_us)))

    def _status(self, now_us: int) -> Status:
        return Status(
            session=self.session,
            device_us=now_us,
            state=self.state,
            fault=self.fault,
            flags=self._flags,
            command_sequence=self._command_sequence,
            command_us=self._command_us,
            good_frames=self.decoder.good % _WRAP,
            bad_frames=self.decoder.bad % _WRAP,
            refused_commands=self.refused_commands % _WRAP,
            counts=self.outputs,
        )
