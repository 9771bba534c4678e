"""Loop timing: period and execution time as percentiles, missed deadlines counted. Knows no clock."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import numpy as np


class TimingRecord:
    """The last ``window`` durations, s, with their p50, p99 and the maximum since the start."""

    def __init__(self, window: int = 5000) -> None:
        self._values: deque[float] = deque(maxlen=window)
        self.count = 0
        self.maximum = 0.0

    def add(self, seconds: float) -> None:
        """Record one duration."""
        self._values.append(seconds)
        self.count += 1
        self.maximum = max(self.maximum, seconds)

    def percentiles(self, wanted: Iterable[float] = (50.0, 99.0)) -> tuple[float, ...]:
        """Percentiles over the window, s; zeros before the first value."""
        if not self._values:
            return tuple(0.0 for _ in wanted)
        return tuple(float(p) for p in np.percentile(self._values, list(wanted)))

    def summary(self, label: str) -> dict[str, str]:
        """Texts for a DiagnosticStatus, in microseconds."""
        p50, p99 = self.percentiles()
        return {
            f"{label} p50 (us)": f"{p50 * 1e6:.1f}",
            f"{label} p99 (us)": f"{p99 * 1e6:.1f}",
            f"{label} max (us)": f"{self.maximum * 1e6:.1f}",
        }


class Deadlines:
    """Absolute deadlines of a periodic task: the phase never drifts, missed ones are skipped and counted.

    Times are monotonic, ns.
    """

    def __init__(self, start_ns: int, period_ns: int) -> None:
        self.period_ns = period_ns
        self.next_ns = start_ns + period_ns
        self.missed = 0
        self.ticks = 0

    def due(self, now_ns: int) -> bool:
        """Whether the next deadline has come."""
        return now_ns >= self.next_ns

    def advance(self, now_ns: int) -> int:
        """Account for a tick at ``now_ns``; returns how many whole periods were skipped."""
        skipped = max(0, (now_ns - self.next_ns) // self.period_ns)
        self.missed += skipped
        self.ticks += 1
        self.next_ns += (1 + skipped) * self.period_ns
        return skipped
