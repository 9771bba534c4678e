# SPDX-License-Identifier: Apache-2.0
"""The driver without threads or ports: bytes and time in; commands, measurements and events out.

Everything is decided here, so that every path can be tested step by step; :mod:`pneumo_ros.daq.driver` adds the port.
All times are monotonic, ns.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable, Sequence
from enum import Enum

from pneumo_ros.daq.actuation import SECOND, WRAP, Actuation, Applied, Mode
from pneumo_ros.daq.admission import admit
from pneumo_ros.daq.calibration import Calibration
from pneumo_ros.daq.calibration_check import check_calibration
from pneumo_ros.daq.clock import DeviceClock
from pneumo_ros.daq.findings import Findings
from pneumo_ros.daq.frames import DeviceFault, DeviceState, Hello, HelloRequest, Sample, SampleFlag, Status, encode
from pneumo_ros.daq.intake import MISFITS, Intake, Measurement
from pneumo_ros.daq.reasons import Event, Finding, Level, Reason
from pneumo_ros.daq.safety_config import SafetyConfig
from pneumo_ros.daq.stream import StreamDecoder
from pneumo_ros.errors import InputError
from pneumo_ros.plant.air_spring import effective_area, load_surface
from pneumo_ros.rig import Rig

HELLO_EVERY = SECOND // 5  # between handshake attempts
REFUSED_EVERY = 2 * SECOND  # between attempts after a refusal
SILENT_FOR = SECOND // 2  # of silence after which the handshake starts again
WINDOW = SECOND  # over which lost frames are judged
MIN_WINDOW_FRAMES = 100
COMPLAINT_EVERY = SECOND  # between events about refused commands
CLOCK_KEPT = 60 * SECOND  # without samples, after which the drift learnt before is too old
UNWATCHED = SECOND // 10  # without a tick, after which no command passes: nobody is watching the timeouts


class Phase(Enum):
    """State of the link."""

    CLOSED = "closed"
    HANDSHAKE = "handshake"
    RUNNING = "running"
    REFUSED = "refused"


class DriverCore:
    """One rig's driver.

    Parameters
    ----------
    safety, calibration, rig : configuration
    send : writes bytes to the port without blocking
    discard : throws away bytes that have not left the host yet
    draw : the handshakes' nonces; another in each session, so that no answer recorded before fits
    """

    def __init__(
        self,
        safety: SafetyConfig,
        calibration: Calibration,
        rig: Rig,
        send: Callable[[bytes], None],
        discard: Callable[[], None] = lambda: None,
        draw: Callable[[], int] = lambda: secrets.randbits(32),
    ) -> None:
        self.safety, self.calibration, self.rig = safety, calibration, rig
        self._surface = load_surface()
        effective_area(rig.design_height.value, 1e5, self._surface)  # loads the compiled code before it is urgent
        self.phase = Phase.CLOSED
        self.decoder = StreamDecoder()
        self.actuation = Actuation(safety, send, discard)
        self.findings = Findings()
        self.intake: Intake | None = None
        self.status: Status | None = None
        self.last: Measurement | None = None
        self.trip: Event | None = None
        self._send = send
        self._out: list[Measurement | Event] = []
        self._nonce = 0
        self._draw = draw
        self.foreign = 0  # frames of another session, dropped
        self._last_stray = -COMPLAINT_EVERY
        self._strays = 0  # samples of another session since the last own one
        self._last_hello = 0
        self._last_sample = 0
        self._silent = False
        self._window = (0, 0, 0)
        self._last_complaint = -COMPLAINT_EVERY
        self._last_tick = 0

    @property
    def mode(self) -> Mode:
        """What the driver does with the valves."""
        return self.actuation.mode

    @property
    def pending(self) -> bool:
        """Whether there is something to drain."""
        return bool(self._out or self.actuation.applied)

    def drain(self) -> list[Measurement | Event]:
        """Measurements and events since the last call, in order."""
        out, self._out = self._out, []
        return out

    def drain_applied(self) -> list[Applied]:
        """What went to the valves since the last call, in order: commands, ramped, and safe ones."""
        out = list(self.actuation.applied)
        self.actuation.applied.clear()
        return out

    # -- link ------------------------------------------------------------------------------------------------------

    def opened(self, now: int) -> None:
        """The port is open: shake hands."""
        self.decoder.reset()
        self._shake_hands(now)

    def closed(self, why: str, now: int) -> None:
        """The port is gone; never armed again by itself."""
        if self.phase is Phase.CLOSED:
            return
        self._lose(Finding(Reason.LINK_LOST, "port", why), now)
        self.phase = Phase.CLOSED
        self.actuation.board(None)

    def receive(self, data: bytes, now: int) -> None:
        """Bytes from the board, complete at ``now``."""
        for record in self.decoder.feed(data):
            if isinstance(record, Sample):
                self._on_sample(record, now)
            elif isinstance(record, Status):
                self._on_status(record, now)
            elif isinstance(record, Hello):
                self._on_hello(record, now)

    def tick(self, now: int) -> None:
        """Call every 2 ms or so: timeouts, handshakes, keep-alives."""
        self._last_tick = now
        if self.phase is Phase.RUNNING:
            self._watch_samples(now)
            self._watch_frames(now)
        elif self.phase is not Phase.CLOSED:
            pause = HELLO_EVERY if self.phase is Phase.HANDSHAKE else REFUSED_EVERY
            if now - self._last_hello >= pause:
                self._shake_hands(now)
        finding = self.actuation.tick(now)
        if finding is not None:
            self._make_safe(finding, now)

    def _shake_hands(self, now: int) -> None:
        self.phase = Phase.HANDSHAKE
        self.actuation.board(None)
        self._last_hello = now
        # Unguessable: the answer to a handshake of another session must not pass for the answer to this one.
        self._nonce = self._draw() % 0xFFFFFFFF + 1
        self._send(encode(HelloRequest(self._nonce)))

    def _on_hello(self, hello: Hello, now: int) -> None:
        if self.phase is Phase.RUNNING and hello.nonce not in (0, self._nonce):
            self.foreign += 1
            self._lose(Finding(Reason.LINK_SHARED, "board", "it answers another host, or an old frame came again"), now)
            # Not at once: two hosts that take the board from each other must not flood the line.
            self.phase, self._last_hello = Phase.HANDSHAKE, now
            self.actuation.board(None)
            return
        known = self.intake.hello.boot_id if self.intake else hello.boot_id
        if hello.boot_id != known and self.phase is Phase.RUNNING:
            self._lose(Finding(Reason.BOARD_RESET, "board", f"boot {known} became {hello.boot_id}"), now)
        if hello.nonce == 0:
            self._shake_hands(now)
        elif hello.nonce == self._nonce and self.phase is Phase.HANDSHAKE:
            self._meet(hello, now)

    def _meet(self, hello: Hello, now: int) -> None:
        """The answer to our handshake: take the board or refuse it."""
        try:
            scale = admit(hello, self.calibration, self.safety)
        except InputError as error:
            self.phase = Phase.REFUSED
            self._finding_event(Finding(Reason.BOARD_REFUSED, "board", str(error)), now)
            return
        self.intake = Intake(
            hello, self.calibration, self.safety, self.rig, self._surface, self._known_clock(hello, now)
        )
        self.actuation.board(scale, hello.session)
        self.phase, self.status, self.last = Phase.RUNNING, None, None
        self._last_sample, self._silent, self._strays = now, False, 0
        self._window = (now, 0, 0)
        self.findings.reset(now)
        firmware = ".".join(map(str, hello.firmware))
        values = {"serial_number": hello.serial_number, "firmware": firmware, "boot_id": str(hello.boot_id),
                  "sample_period_us": str(hello.sample_period_us), "adc_bits": str(hello.adc_bits)}  # fmt: skip
        self.event(Level.OK, Reason.LINK_OPEN, f"board {hello.serial_number}, firmware {firmware}", values, now)
        self._say_doubts(hello, now)

    def _known_clock(self, hello: Hello, now: int) -> DeviceClock | None:
        """The clock as learnt before, if this board has run on since: late frames after a stall keep right stamps."""
        before = self.intake
        if before is None or now - self._last_sample > CLOCK_KEPT:
            return None
        same = (hello.serial_number, hello.boot_id) == (before.hello.serial_number, before.hello.boot_id)
        return before.clock if same and before.clock.runs_on(hello.device_us, now) else None

    def _say_doubts(self, hello: Hello, now: int) -> None:
        assert self.intake is not None
        for doubt in check_calibration(self.calibration, hello, self.rig.ambient_pressure.value):
            values = {"channel": doubt.channel, "finding": doubt.code, "calibration": self.calibration.name}
            text = f"{doubt.channel}: {doubt.text}"
            self.event(Level.WARN, Reason.CALIBRATION_DOUBTFUL, text, values, now)
        for channel in self.intake.plausibility.unwatched:
            text = f"a stuck {channel} cannot be told in time with {self.calibration.name}"
            self.event(Level.WARN, Reason.CHANNEL_UNWATCHED, text, {"channel": channel}, now)

    # -- samples ---------------------------------------------------------------------------------------------------

    def _on_sample(self, sample: Sample, now: int) -> None:
        if self.phase is not Phase.RUNNING or self.intake is None:
            return
        if sample.session != self.intake.hello.session:
            self._stray(now)
            self._strays += 1
            if self._strays >= MISFITS:  # and none of its own in between: the board has restarted unheard
                self._lose(Finding(Reason.BOARD_RESET, "board", "it is in another session"), now)
                self._shake_hands(now)
            return
        before = self.intake.out_of_step
        measurement, found = self.intake.take(sample, now)
        if self.intake.out_of_step == before:  # one that came again, or late, is no sign of life
            self._last_sample, self._silent, self._strays = now, False, 0
            self.actuation.sample = (sample.sequence + 1) % WRAP
            self._follow_board(sample, now)
        if self.intake.recent_loss > self.safety.plausibility.lost_at_once:
            text = f"{self.intake.recent_loss:.0%} of the last frames lost"
            found.append(Finding(Reason.FRAMES_LOST, "link", text))
        for finding in found:
            self._handle(finding, now)
        if measurement is not None:
            self.last = measurement
            self._out.append(measurement)
        elif not self.intake.in_step:
            self._lose(Finding(Reason.BOARD_RESET, "board", "its samples do not continue the earlier ones"), now)
            self._shake_hands(now)

    def _follow_board(self, sample: Sample, now: int) -> None:
        """Keep our mode and the board's state together."""
        pressed, mode = bool(sample.flags & SampleFlag.ESTOP_PRESSED), self.mode
        stopped = sample.state is DeviceState.ESTOP
        if pressed or (stopped and mode not in (Mode.ESTOP, Mode.RESETTING)):
            self.findings.seen(Finding(Reason.ESTOP, "board", "e-stop input pressed"), now)
            if mode is not Mode.ESTOP:
                self.estop("the board's e-stop" + (" input" if pressed else ""), now)
        elif mode is Mode.ARMING and sample.state is DeviceState.ARMED:
            self.actuation.armed(now)
            self.trip = None
            self.event(Level.OK, Reason.ARMED, "valves armed, safe command until the controller's first", {}, now)
        elif mode is Mode.RESETTING and sample.state is DeviceState.SAFE:
            self.actuation.reset_done()
            self.event(Level.OK, Reason.ESTOP_RESET, "emergency stop reset; arm to go on", {}, now)
        elif mode is Mode.ARMED and sample.state is DeviceState.SAFE:
            self._make_safe(self._board_finding(), now)

    def _board_finding(self) -> Finding:
        fault = self.status.fault if self.status else DeviceFault.NONE
        reason = {DeviceFault.WATCHDOG: Reason.BOARD_WATCHDOG, DeviceFault.CONVERTER: Reason.CONVERTER}.get(
            fault, Reason.BOARD_DISARMED
        )
        return Finding(reason, "board", f"the board went safe by itself: {fault.name.lower()}")

    def _on_status(self, status: Status, now: int) -> None:
        if self.intake is None or self.phase is not Phase.RUNNING:
            return
        if status.session != self.intake.hello.session:
            self._stray(now)
            return
        if self.status is not None and (status.device_us - self.status.device_us) % WRAP >= WRAP // 2:
            return  # an older one that came late
        self.status = status
        for sequence, sent in self.actuation.sent_ns:
            if sequence == status.command_sequence:
                self.intake.clock.add_receipt(status.command_us, sent)
                return

    def _stray(self, now: int) -> None:
        """A frame of another session: old, or somebody else's. It is dropped, and said once a second."""
        self.foreign += 1
        if now - self._last_stray >= COMPLAINT_EVERY:
            self._last_stray = now
            text = f"{self.foreign} frames of another session dropped so far"
            self._finding_event(Finding(Reason.LINK_SHARED, "link", text, Level.WARN), now)

    def _watch_samples(self, now: int) -> None:
        silence = now - self._last_sample
        if silence > self.safety.timeouts.samples * SECOND and not self._silent:
            self._silent = True
            self._lose(Finding(Reason.SAMPLES_STALE, "board", f"no sample for {silence / 1e6:.1f} ms"), now)
        if silence > SILENT_FOR:
            self._shake_hands(now)

    def _watch_frames(self, now: int) -> None:
        """Trip when too many of a window's frames were lost or damaged."""
        start, expected_before, bad_before = self._window
        if self.intake is None or now - start < WINDOW:
            return
        expected = self.intake.samples + self.intake.lost
        share_of = expected - expected_before
        lost = self.lost_frames - bad_before
        if expected_before and share_of >= MIN_WINDOW_FRAMES:
            limit = self.safety.plausibility.lost_frames
            if lost > limit * share_of:
                self._handle(Finding(Reason.FRAMES_LOST, "link", f"{lost} of {share_of} frames lost in a second"), now)
        self._window = (now, expected, self.lost_frames)

    @property
    def lost_frames(self) -> int:
        """Samples that never came or came damaged, since the handshake."""
        return self.intake.lost + self.intake.out_of_step if self.intake else 0

    # -- operator and controller -----------------------------------------------------------------------------------

    def command(self, areas: Sequence[float], stamp: int, now: int) -> None:
        """A controller's command: m2 in the order of VALVES, computed for the sample of monotonic time ``stamp``."""
        if self.mode is Mode.ARMED and now - self._last_tick > UNWATCHED:
            self.fail("its supervision has stopped", now)
        finding = self.actuation.command(areas, stamp, now)
        if finding is None:
            return
        if finding.estop:
            self._make_safe(finding, now)
        elif now - self._last_complaint >= COMPLAINT_EVERY:
            self._last_complaint = now
            self._finding_event(finding._replace(level=Level.WARN), now)  # an error once the driver trips over it

    def blockers(self, now: int) -> list[str]:
        """Why the valves cannot be armed; empty if they can."""
        if self.phase is not Phase.RUNNING or self.intake is None or self.last is None:
            return [f"the link is {self.phase.value}, no samples"]
        out = self.findings.recent(now, round(self.safety.arming.healthy_for * SECOND))
        if self._silent:
            out.append("the board is silent")
        if not self.intake.clock.settled:
            out.append("the device clock is not settled yet (0.5 s)")
        if not all(self.last.valid):
            out.append("a sensor cannot be believed")
        supply = self.last.values[6]
        if supply < self.safety.arming.supply_low:
            out.append(f"supply pressure {supply:.4g} Pa is below {self.safety.arming.supply_low:.4g} Pa")
        return out

    def arm(self, now: int) -> list[str]:
        """Start arming; returns why not."""
        why = self.blockers(now)
        if self.mode is not Mode.SAFE:
            why.append(f"the driver is in mode {self.mode.value}")
        if not why:
            self.actuation.arm(now)
        return why

    def disarm(self, now: int) -> None:
        """Safe command, by the operator's wish."""
        if self.mode in (Mode.ARMED, Mode.ARMING):
            self.actuation.make_safe(now)
            self.event(Level.OK, Reason.DISARMED, "valves safe", {}, now)

    def estop(self, source: str, now: int) -> None:
        """Emergency stop, latched, from any mode and with any link."""
        if self.mode is not Mode.ESTOP:
            self._make_safe(Finding(Reason.ESTOP, source, f"emergency stop by {source}", estop=True), now)

    def reset(self, now: int) -> list[str]:
        """End an emergency stop; returns why not. Arming stays a separate step."""
        if self.mode is not Mode.ESTOP:
            return [f"there is no emergency stop to reset, mode is {self.mode.value}"]
        why = self.blockers(now)
        if not why:
            self.actuation.reset_estop(now)
        return why

    def refuse(self, reason: Reason, why: str, now: int) -> None:
        """Something outside of link and board makes driving unsafe: a trip if armed, else an event."""
        self._lose(Finding(reason, "command", why), now)

    def fail(self, why: str, now: int) -> None:
        """Something in the driver itself broke: valves safe, whatever else still works."""
        self._make_safe(Finding(Reason.DRIVER_FAILED, "driver", why), now)

    def use(self, calibration: Calibration, now: int) -> None:
        """Take another calibration (zero, span); the caller sees to it that nothing is armed."""
        self.calibration = calibration
        if self.intake is not None:
            self.intake.use(calibration)
        self.event(Level.OK, Reason.CALIBRATION_CHANGED, f"calibration {calibration.name} changed", {}, now)

    # -- reactions -------------------------------------------------------------------------------------------------

    def _handle(self, finding: Finding, now: int) -> None:
        if finding.level is not Level.ERROR:
            self._finding_event(finding, now)
            return
        new = self.findings.seen(finding, now)
        if self.mode in (Mode.ARMED, Mode.ARMING) or finding.estop:
            if finding.estop and self.mode is Mode.ESTOP:
                return
            self._make_safe(finding, now)
        elif new:
            self._finding_event(finding._replace(level=Level.WARN), now)

    def _lose(self, finding: Finding, now: int) -> None:
        """The link broke in some way: a trip if armed, else an event."""
        if self.mode in (Mode.ARMED, Mode.ARMING):
            self._make_safe(finding, now)
        else:
            self._finding_event(finding._replace(level=Level.WARN), now)

    def _make_safe(self, finding: Finding, now: int) -> None:
        """The valves first, the word about it after."""
        self.actuation.make_safe(now, estop=finding.estop)
        self._finding_event(finding, now)
        self.trip = self._out[-1] if isinstance(self._out[-1], Event) else None

    def _finding_event(self, finding: Finding, now: int) -> None:
        values = {"subject": finding.subject, "mode": self.mode.value}
        self.event(finding.level, finding.reason, f"{finding.reason.value}: {finding.text}", values, now)

    def event(self, level: Level, reason: Reason, message: str, values: dict[str, str], now: int) -> None:
        """Report something."""
        self._out.append(Event(level, reason, message, values, now))
