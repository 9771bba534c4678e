# SPDX-License-Identifier: Apache-2.0
"""When the next picture goes to a browser, so that its buttons keep working however slowly it draws."""

from __future__ import annotations

PATIENCE = 1.0  # s until another picture goes to a page that has not said it drew the last one
LONGEST_PATIENCE = 60.0  # s; each one that is not answered doubles it, up to this


class Pace:
    """One picture at a time, and as long a rest after it as it took to draw: half of the browser is left to its user.

    A page that does not answer may not have listened yet: it gets another picture after :data:`PATIENCE`, and ever more
    rarely, because one that is only slow would fall behind for good. Times are of a monotonic clock, s.
    """

    def __init__(self) -> None:
        self._number, self._drawn = 0, 0
        self._sent_at = self._free_at = 0.0
        self._patience = PATIENCE

    def due(self, now: float) -> bool:
        """Whether a picture may go now."""
        if self._drawn == self._number:
            return now >= self._free_at
        return now - self._sent_at >= self._patience

    def send(self, now: float) -> int:
        """A picture goes; its number, which the page says when it has drawn it."""
        unanswered = self._drawn < self._number
        self._patience = min(2.0 * self._patience, LONGEST_PATIENCE) if unanswered else PATIENCE
        self._number, self._sent_at = self._number + 1, now
        return self._number

    def drawn(self, number: int, now: float) -> None:
        """The page has drawn a picture."""
        self._drawn = min(max(self._drawn, number), self._number)
        if self._drawn == self._number:
            self._free_at = now + (now - self._sent_at)

    @property
    def begun(self) -> bool:
        """Whether the page has drawn anything yet."""
        return self._drawn > 0
