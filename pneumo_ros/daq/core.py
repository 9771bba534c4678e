# SPDX-License-Identifier: Apache-2.0
"""The driver without threads or ports: bytes and time in; commands, measurements and events out.

Everything is decided here, so that every path can be tested step by step; :mod:`pneumo_ros.daq.driver` adds the port.
All times are monotonic, ns.
"""

from __future__ import annotations

from collections.abc import Sequence

from pneumo_ros.daq.actuation import SECOND, WRAP, Mode
from pneumo_ros.daq.calibration import Calibration
from pneumo_ros.daq.frames import DeviceFault, DeviceState, Hello, Sample, SampleFlag, Status
from pneumo_ros.daq.intake import MISFITS
from pneumo_ros.daq.link import COMPLAINT_EVERY, HELLO_EVERY, REFUSED_EVERY, Link, Phase
from pneumo_ros.daq.reasons import Finding, Level, Reason

UNWATCHED = SECOND // 10  # without a tick, after which no command passes: nobody is watching the timeouts


class DriverCore(Link):
    """One rig's driver; parameters as of :class:`~pneumo_ros.daq.link.Link`."""

    _last_complaint = -COMPLAINT_EVERY
    _last_tick = 0

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
