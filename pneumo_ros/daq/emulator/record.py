# SPDX-License-Identifier: Apache-2.0
"""What an emulated board did, in monotonic time: the truth a driver's work is compared with."""

from __future__ import annotations

import json
from array import array
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.files import new_file

COLUMNS = 7


class EmulatorRecord:
    """Samples, changes of the outputs, faults and states; times monotonic, ns."""

    def __init__(self) -> None:
        self.events: list[tuple[int, str, str]] = []
        self.overruns = 0
        self.lateness_ns = array("q")
        self._safe: bool | None = None
        self._samples = array("q")  # boot, sequence, time, counts
        self._states = array("d")

    def sample(
        self, boot: int, sequence: int, time_ns: int, counts: tuple[int, ...], state: NDArray[np.float64]
    ) -> None:
        """A sample was taken; ``counts`` in the board's order."""
        self._samples.extend((boot, sequence, time_ns, *counts))
        self._states.extend(state)

    def event(self, time_ns: int, kind: str, text: str) -> None:
        """Something happened."""
        self.events.append((time_ns, kind, text))

    def outputs(self, time_ns: int, safe: bool) -> bool:
        """The valves' drive was set; only changes between safe and not safe are kept. Says whether this was one."""
        if safe is self._safe:
            return False
        self._safe = safe
        self.event(time_ns, "valves", "safe" if safe else "driven")
        return True

    def arrays(self) -> dict[str, NDArray[np.int64] | NDArray[np.float64]]:
        """boot, sequence and time_ns (N,), counts (N, 7), states (N, 10), lateness_ns (M,)."""
        rows = np.frombuffer(self._samples, dtype=np.int64).reshape(-1, 3 + COLUMNS)
        return {
            "boot": rows[:, 0],
            "sequence": rows[:, 1],
            "time_ns": rows[:, 2],
            "counts": rows[:, 3:],
            "states": np.frombuffer(self._states, dtype=np.float64).reshape(-1, 10),
            "lateness_ns": np.frombuffer(self.lateness_ns, dtype=np.int64),
        }

    def save(self, path: Path) -> None:
        """Write everything to one .npz; the name appears only when it is complete."""
        columns: dict[str, Any] = {**self.arrays(), "events": json.dumps(self.events), "overruns": self.overruns}
        with new_file(path) as part, part.open("wb") as stream:
            np.savez(stream, **columns)
