# SPDX-License-Identifier: Apache-2.0
"""Loop timing: period and execution time as percentiles, missed deadlines counted. Knows no clock."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class LoopTiming:
    """Periods and execution times of a step: percentiles over a window, maximum since the start.

    :meth:`mark` only notes two instants; the arithmetic waits for :meth:`summary`, once a second.
    """

    def __init__(self, window: int = 5000) -> None:
        self._window = window
        self._marks: list[tuple[int, int]] = []
        self._last_start: int | None = None
        self._periods, self._steps = np.empty(0), np.empty(0)
        self._longest = {"period": 0.0, "step": 0.0}
        self.count = 0

    def mark(self, start_ns: int, end_ns: int) -> None:
        """Note one step, monotonic times in ns."""
        self._marks.append((start_ns, end_ns))

    def summary(self) -> dict[str, str]:
        """Number of steps, and p50, p99 and maximum of period and step in microseconds, as texts."""
        self._digest()
        out = {"steps": str(self.count)}
        for label, values in (("period", self._periods), ("step", self._steps)):
            p50, p99 = np.percentile(values, [50.0, 99.0]) if len(values) else (0.0, 0.0)
            figures = {"p50": p50, "p99": p99, "max": self._longest[label]}
            out.update({f"{label} {name} (us)": f"{value * 1e6:.1f}" for name, value in figures.items()})
        return out

    def _digest(self) -> None:
        marks, self._marks = self._marks, []
        if not marks:
            return
        times = np.array(marks, dtype=np.int64)
        starts = times[:, 0] if self._last_start is None else np.concatenate([[self._last_start], times[:, 0]])
        self._last_start = int(times[-1, 0])
        self.count += len(marks)
        self._periods = self._kept("period", self._periods, np.asarray(np.diff(starts) * 1e-9, dtype=np.float64))
        self._steps = self._kept("step", self._steps, np.asarray((times[:, 1] - times[:, 0]) * 1e-9, dtype=np.float64))

    def _kept(self, label: str, old: NDArray[np.float64], new: NDArray[np.float64]) -> NDArray[np.float64]:
        if len(new):
            self._longest[label] = max(self._longest[label], float(new.max()))
        return np.concatenate([old, new])[-self._window :]


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
