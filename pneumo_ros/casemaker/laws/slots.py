# SPDX-License-Identifier: Apache-2.0
"""Where a second law is switched on: one row of numbers per family and end, handed to the compiled rig as an array.

Column 0 is the law's number within its family (0: the family has no second law here), the others its parameters. An
array of rows keeps the compiled signature the same however many laws there are, which bounds the time of compilation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

(FRICTION, HYSTERESIS, DAMPING, MODE, STOP, AREA, LEAK, HEAT, VOLUME, ORIFICE, LAG, DEADBAND, DELAY, TYRE_LOSS, LIFTOFF,
 EXCITER, SPRUNG, UNSPRUNG, GAUGE, GAUGE_LAG, FORM, EXTERNAL, CROSS, SUPPLY, BODY) = range(25)  # fmt: skip
ROWS, COLUMNS = 25, 10
SHARED = (SUPPLY, BODY)  # rows of what the rig has once: kept with the front end
ENDS = ("front", "rear")


class Law(NamedTuple):
    """A second law at one end ("front" also for what is shared): its row, its number and its parameters, SI."""

    end: str
    row: int
    number: int
    values: tuple[float, ...]


def table(laws: tuple[Law, ...]) -> NDArray[np.float64]:
    """Rows of both ends, (2, ROWS, COLUMNS)."""
    out = np.zeros((2, ROWS, COLUMNS))
    for law in laws:
        row = out[ENDS.index(law.end), law.row]
        row[0] = law.number
        row[1 : 1 + len(law.values)] = law.values
    return out
