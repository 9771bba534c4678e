# SPDX-License-Identifier: Apache-2.0
"""Where playback is: position in the log as a function of the wall clock; play, pause, rate, seek, step, loop. Pure."""

from __future__ import annotations

from dataclasses import dataclass

SECOND = 1_000_000_000


@dataclass
class Transport:
    """A tape's transport. All times in ns; ``wall`` is monotonic.

    Parameters
    ----------
    start, end : log times of the first and last message
    rate : log seconds a wall second
    loop : begin again at the end
    paused : whether it stands still

    ``jumps`` counts every discontinuity, so that a player notices one that lands where it was; ``wraps`` those at a
    loop's end, before which everything up to the end is due; ``landed`` is where the last jump went.
    """

    start: int
    end: int
    rate: float = 1.0
    loop: bool = False
    paused: bool = False
    jumps: int = 0
    wraps: int = 0
    landed: int = 0
    _anchor_wall: int = 0
    _anchor_log: int = 0

    def begin(self, wall: int, position: int) -> None:
        """Be at ``position`` at ``wall``."""
        self.landed = min(max(position, self.start), self.end)
        self._anchor_wall, self._anchor_log = wall, self.landed
        self.jumps += 1

    def now(self, wall: int) -> int:
        """The log time at ``wall``; at the end a loop begins again."""
        if self.paused:
            return self._anchor_log
        position = self._anchor_log + round((wall - self._anchor_wall) * self.rate)
        if position <= self.end:
            return position
        if not self.loop or self.end == self.start:
            return self.end
        self.wraps += 1
        self.begin(self.wall_of(self.end), self.start)
        return self.now(wall)

    def wall_of(self, position: int) -> int:
        """When ``position`` will be reached, if nothing intervenes; it must not lie behind."""
        return self._anchor_wall + round((position - self._anchor_log) / self.rate)

    def finished(self, wall: int) -> bool:
        """Whether the end is reached for good."""
        return not self.loop and not self.paused and self.now(wall) >= self.end

    def pause(self, wall: int, paused: bool = True) -> None:
        """Stand still, or go on."""
        self._hold(wall)
        self.paused = paused

    def set_rate(self, wall: int, rate: float) -> None:
        """Go faster or slower from here."""
        self._hold(wall)
        self.rate = rate

    def seek(self, wall: int, position: int) -> None:
        """Jump; a paused transport stays paused."""
        self.begin(wall, position)

    def step(self, wall: int, position: int) -> None:
        """Stand still at ``position``, which lies ahead: no jump."""
        self.paused = True
        self._anchor_wall, self._anchor_log = wall, min(position, self.end)

    def _hold(self, wall: int) -> None:
        self._anchor_log, self._anchor_wall = self.now(wall), wall
