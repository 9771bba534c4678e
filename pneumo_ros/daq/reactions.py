# SPDX-License-Identifier: Apache-2.0
"""What the driver does about what it finds: events, a warning, or safe valves; and what it hands out."""

from __future__ import annotations

from collections.abc import Callable

from pneumo_ros.daq.actuation import Actuation, Applied, Mode
from pneumo_ros.daq.findings import Findings
from pneumo_ros.daq.intake import Measurement
from pneumo_ros.daq.reasons import Event, Finding, Level, Reason
from pneumo_ros.daq.safety_config import SafetyConfig


class Reactions:
    """Commands to the valves, findings, and the queue of measurements and events.

    Parameters
    ----------
    safety : configuration
    send : writes bytes to the port without blocking
    discard : throws away bytes that have not left the host yet
    """

    def __init__(self, safety: SafetyConfig, send: Callable[[bytes], None], discard: Callable[[], None]) -> None:
        self.actuation = Actuation(safety, send, discard)
        self.findings = Findings()
        self.trip: Event | None = None
        self._out: list[Measurement | Event] = []

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

    def event(self, level: Level, reason: Reason, message: str, values: dict[str, str], now: int) -> None:
        """Report something."""
        self._out.append(Event(level, reason, message, values, now))

    def _finding_event(self, finding: Finding, now: int) -> None:
        values = {"subject": finding.subject, "mode": self.mode.value}
        self.event(finding.level, finding.reason, f"{finding.reason.value}: {finding.text}", values, now)

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
