# SPDX-License-Identifier: Apache-2.0
"""What the monitors have found lately: news are told once, arming waits until nothing was found for a while."""

from __future__ import annotations

from pneumo_ros.daq.reasons import Finding, Reason

FORGET_AFTER = 1_000_000_000  # ns without a finding after which its return is news again


class Findings:
    """When each (reason, subject) was last seen, monotonic ns."""

    def __init__(self) -> None:
        self._last: dict[tuple[Reason, str], tuple[int, str]] = {}
        self._start = 0

    def reset(self, now: int) -> None:
        """A new board: nothing is known of it yet."""
        self._last.clear()
        self._start = now

    def seen(self, finding: Finding, now: int) -> bool:
        """Note a finding; True if it is news."""
        key = (finding.reason, finding.subject)
        before = self._last.get(key)
        self._last[key] = (now, finding.text)
        return before is None or now - before[0] > FORGET_AFTER

    def recent(self, now: int, span: int) -> list[str]:
        """Texts of what was seen within ``span`` ns; a board that is younger than that counts as a finding."""
        out = [f"{key[0].code}: {text}" for key, (when, text) in self._last.items() if now - when < span]
        if now - self._start < span:
            out.append("the board has not been watched for long enough")
        return out
