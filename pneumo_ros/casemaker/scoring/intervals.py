# SPDX-License-Identifier: Apache-2.0
"""Shares with their uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

Z95 = 1.959964


@dataclass(frozen=True)
class Share:
    """``hits`` of ``count`` with the Wilson score interval (95 %).

    Wilson: Probable inference, the law of succession, and statistical inference, JASA 22 (1927).
    """

    hits: float
    count: int

    @property
    def value(self) -> float:
        """The share; NaN when nothing was counted."""
        return self.hits / self.count if self.count else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Lower and upper bound; the whole range when nothing was counted."""
        n = self.count
        if n == 0:
            return 0.0, 1.0
        p, z2 = self.value, Z95**2
        middle = (p + z2 / (2 * n)) / (1 + z2 / n)
        half = Z95 / (1 + z2 / n) * math.sqrt(p * (1 - p) / n + z2 / (4 * n * n))
        return max(0.0, middle - half), min(1.0, middle + half)

    def __str__(self) -> str:
        if not self.count:
            return "-"
        low, high = self.interval
        hits = f"{self.hits:g}" if self.hits == int(self.hits) else f"{self.hits:.1f}"
        return f"{self.value:.3f} ({hits}/{self.count}; {low:.2f}-{high:.2f})"


def share(flags: list[bool] | list[float]) -> Share:
    """Share of true flags, or mean of numbers in [0, 1] over their count."""
    return Share(float(sum(flags)), len(flags))
