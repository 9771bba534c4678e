# SPDX-License-Identifier: Apache-2.0
"""The least that a diagnosis asks of a log; what more it may have is in :mod:`pneumo_ros.diagnosis.traits`."""

from __future__ import annotations

from typing import Protocol

from pneumo_ros.arrays import Array


class Record(Protocol):
    """A log on one time base: N rows, C channels."""

    @property
    def name(self) -> str: ...

    @property
    def period(self) -> float:
        """s between rows."""

    @property
    def measured(self) -> Array:
        """(N, C), no NaN."""

    @property
    def weight(self) -> Array:
        """(N, C), 0 where no sample is there."""

    @property
    def noise(self) -> Array:
        """(C,) standard deviation of the sensor noise."""
