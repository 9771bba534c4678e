# SPDX-License-Identifier: Apache-2.0
"""The newest samples of a running topic."""

from __future__ import annotations

import threading
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.dashboard.panels import Samples

RESTART_NS = 1_000_000_000  # a safe command in between may carry a later stamp than the command that follows it
CAPACITY = 60_000  # samples a topic: 30 s at 2 kHz, 2 min at 500 Hz


class Ring:
    """The last samples of one topic. One thread appends, others read."""

    def __init__(self, names: Sequence[str], capacity: int = CAPACITY) -> None:
        self.names = tuple(names)
        self._time = np.zeros(capacity, np.int64)
        self._values = np.zeros((capacity, len(self.names)))
        self._count = 0
        self._lock = threading.Lock()

    def append(self, time_ns: int, values: Sequence[float]) -> None:
        """Add one; a stamp that goes far back starts a new session, one that comes a little late does not."""
        with self._lock:
            if self._count and time_ns < self._time[(self._count - 1) % len(self._time)] - RESTART_NS:
                self._count = 0
            row = self._count % len(self._time)
            self._time[row], self._values[row] = time_ns, values
            self._count += 1

    def since(self, begin_ns: int) -> Samples:
        """Those with stamps from ``begin_ns`` on."""
        with self._lock:
            order = self._order()
            time, values = self._time[order], self._values[order]
        if np.any(np.diff(time) < 0):
            ascending = np.argsort(time, kind="stable")
            time, values = time[ascending], values[ascending]
        return Samples(time, self.names, values).between(begin_ns, np.iinfo(np.int64).max - 1)

    def _order(self) -> NDArray[np.int64]:
        size = len(self._time)
        if self._count <= size:
            return np.arange(self._count)
        return np.roll(np.arange(size), -(self._count % size))
