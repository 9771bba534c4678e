# SPDX-License-Identifier: Apache-2.0
"""The command side: modes, arming, what goes to the valves and what never does. Knows no port and no thread.

A command reaches the board only while ARMED, if it is finite, inside the valves' range, newer than the last one and
young enough. Everything else leads to the safe command. ESTOP is latched.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from enum import Enum
from typing import NamedTuple

from pneumo_ros.daq.frames import Command, CommandFlag, encode
from pneumo_ros.daq.limits import command_finding
from pneumo_ros.daq.reasons import Finding, Reason
from pneumo_ros.daq.safety_config import SafetyConfig
from pneumo_ros.daq.scaling import OutputScale

SECOND = 1_000_000_000  # ns
WRAP = 1 << 32
APPLIED_KEPT = 4096  # openings not fetched yet; more than seconds of them
SENT_KEPT = 512  # commands whose sending time is remembered for the round trip
KEEP_ALIVE = 20_000_000  # ns between commands while SAFE
QUICK = 1_000_000  # ns between commands while a change must get through: every look at the timeouts, as some are lost
QUICK_FOR = 100_000_000  # ns after a trip


class Mode(Enum):
    """What the driver does with the valves."""

    SAFE = "safe"
    ARMING = "arming"
    ARMED = "armed"
    ESTOP = "estop"
    RESETTING = "resetting"


class Applied(NamedTuple):
    """Openings (m2, in the order of VALVES) as they were sent to the board at ``time_ns``, monotonic."""

    time_ns: int
    areas: tuple[float, ...]


class Actuation:
    """Modes and commands of one driver.

    Parameters
    ----------
    safety : configuration
    send : writes bytes to the board, without blocking
    discard : throws away what has not left the host yet, so that a safe command overtakes it
    """

    def __init__(self, safety: SafetyConfig, send: Callable[[bytes], None], discard: Callable[[], None]) -> None:
        self._safety, self._send, self._discard = safety, send, discard
        self.mode = Mode.SAFE
        self.scale: OutputScale | None = None
        self.sent = 0
        self.refused = 0
        self.sent_ns: deque[tuple[int, int]] = deque(maxlen=SENT_KEPT)
        self.areas = safety.safe_command
        self.applied: deque[Applied] = deque(maxlen=APPLIED_KEPT)
        self.session = 0
        self.sample = 0  # one more than the latest SAMPLE's sequence
        self._sequence = 0
        self._last_send = 0
        self._quick_until = 0
        self._since = 0
        self._first_command: int | None = None
        self._last_command = 0
        self._last_stamp = 0

    def board(self, scale: OutputScale | None, session: int = 0) -> None:
        """A board has answered (None: it is gone); the sequence starts again, SAFE unless ESTOP."""
        self.scale, self.session = scale, session
        self._sequence = self.sample = 0
        self.sent_ns.clear()
        if self.mode is not Mode.ESTOP:
            self.mode = Mode.ESTOP if self.mode is Mode.RESETTING else Mode.SAFE

    # -- modes -----------------------------------------------------------------------------------------------------

    def arm(self, now: int) -> None:
        """SAFE -> ARMING: an unarmed command first, because the board arms on the edge, then the safe one, armed."""
        self._write(CommandFlag(0), self._safety.safe_command, now)
        self.mode, self._since = Mode.ARMING, now
        self._write(CommandFlag.ARM, self._safety.safe_command, now)

    def armed(self, now: int) -> None:
        """The board says it is armed."""
        self.mode, self._since = Mode.ARMED, now
        self._first_command = None
        self._last_stamp = 0

    def make_safe(self, now: int, *, estop: bool = False) -> None:
        """To SAFE or ESTOP, at once: nothing waits in front of the safe command."""
        self.mode = Mode.ESTOP if estop or self.mode in (Mode.ESTOP, Mode.RESETTING) else Mode.SAFE
        self._quick_until = now + QUICK_FOR
        self._discard()
        self._keep_alive(now)

    def reset_estop(self, now: int) -> None:
        """ESTOP -> RESETTING: asks the board until it is SAFE."""
        self.mode, self._since = Mode.RESETTING, now
        self._keep_alive(now)

    def reset_done(self) -> None:
        """The board has left its e-stop."""
        self.mode = Mode.SAFE

    # -- commands --------------------------------------------------------------------------------------------------

    def command(self, areas: Sequence[float], stamp: int, now: int) -> Finding | None:
        """Pass a controller's command on.

        Parameters
        ----------
        areas : m2 in the order of VALVES
        stamp : sample time it was computed for, ns on the monotonic clock
        now : ns

        Returns
        -------
        Why it was refused; a refused command is not fresh, so refusals end in COMMAND_STALE.
        """
        if self.mode is not Mode.ARMED:
            return None
        finding = command_finding(areas, self._safety.limits["command_area"]) or self._age_finding(stamp, now)
        if finding is not None:
            self.refused += 1
            return finding
        if self._first_command is None:
            self._first_command = now
        self._last_stamp, self._last_command = stamp, now
        self._write(CommandFlag.ARM, self._ramped(areas, now - self._first_command), now)
        return None

    def tick(self, now: int) -> Finding | None:
        """Timeouts and keep-alives; returns what ends the armed or resetting mode."""
        finding = self._timeout(now)
        if finding is None and self.scale is not None and now - self._last_send >= self._pause(now):
            self._keep_alive(now)
        return finding

    def _age_finding(self, stamp: int, now: int) -> Finding | None:
        age = (now - stamp) / SECOND
        if stamp > self._last_stamp and age <= self._safety.timeouts.command:
            return None
        text = (
            f"its sample is {age * 1e3:.1f} ms old" if stamp > self._last_stamp else "an older sample's than the last"
        )
        return Finding(Reason.COMMAND_STALE, "command", f"command refused: {text}")

    def _timeout(self, now: int) -> Finding | None:
        waited = (now - self._since) / SECOND
        if self.mode is Mode.ARMED and self._first_command is None:
            if waited > self._safety.arming.first_command:
                return Finding(Reason.COMMAND_STALE, "command", f"no command within {waited:.1f} s of arming")
        elif self.mode is Mode.ARMED:
            age = (now - self._last_command) / SECOND
            if age > self._safety.timeouts.command:
                return Finding(Reason.COMMAND_STALE, "command", f"no fresh command for {age * 1e3:.1f} ms")
        elif self.mode in (Mode.ARMING, Mode.RESETTING) and waited > self._safety.arming.healthy_for:
            return Finding(Reason.ARM_REFUSED, "board", f"the board did not follow within {waited:.1f} s")
        return None

    def _pause(self, now: int) -> int:
        """ns between commands of the driver's own; armed with a controller at work it sends none."""
        if self.mode is Mode.ARMED and self._first_command is not None:
            return SECOND
        quick = self.mode in (Mode.ARMING, Mode.ARMED, Mode.RESETTING) or now < self._quick_until
        return QUICK if quick else KEEP_ALIVE

    def _keep_alive(self, now: int) -> None:
        flags = {
            Mode.SAFE: CommandFlag(0),
            Mode.ARMING: CommandFlag.ARM,
            Mode.ARMED: CommandFlag.ARM,
            Mode.ESTOP: CommandFlag.ESTOP,
            Mode.RESETTING: CommandFlag.RESET,
        }[self.mode]
        self._write(flags, self._safety.safe_command, now)

    def _ramped(self, areas: Sequence[float], since_first: int) -> Sequence[float]:
        """From the safe command to the controller's, so that arming is bumpless."""
        ramp = self._safety.arming.ramp * SECOND
        if since_first >= ramp:
            return areas
        share = since_first / ramp
        return [safe + share * (area - safe) for safe, area in zip(self._safety.safe_command, areas, strict=True)]

    def _write(self, flags: CommandFlag, areas: Sequence[float], now: int) -> None:
        if self.scale is None:
            return
        self._sequence = (self._sequence + 1) % WRAP
        self.areas = tuple(areas)
        self.applied.append(Applied(now, self.areas))
        self._send(encode(Command(self.session, self._sequence, self.sample, flags, self.scale.counts(areas))))
        self.sent += 1
        self.sent_ns.append((self._sequence, now))
        self._last_send = now
