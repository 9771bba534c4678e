# SPDX-License-Identifier: Apache-2.0
"""The inlet valve between command and opening: delay, cross-talk, sticking spool, slew limit, overlap.

The second order lag of the spool is part of the differential equations; what has a memory but no rate is here and
moves once a step.

Kernel arguments
----------------
commands : (N,) one row a period, m2
time, delay, period : s
law : (COLUMNS,) second law of the delay, see :mod:`pneumo_ros.casemaker.laws.ground`
spool : position, m2
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.casemaker.laws.ground import late
from pneumo_ros.casemaker.parameters import End


@njit(cache=True)
def delayed(commands: NDArray[np.float64], time: float, law: NDArray[np.float64], delay: float, period: float) -> float:
    """Command in force at ``time - delay``, m2; commands are held over a period, and the first one before the run."""
    if law[0] > 0.0:
        delay = late(law, time, period)
    index = int(np.floor((time - delay) / period + 1e-9))
    return commands[min(max(index, 0), commands.shape[0] - 1)]


@njit(cache=True)
def spool_target(command: float, other: float, other_rest: float, held: float, step: float, end: End) -> float:
    """Where the spool is driven to after one step, m2.

    Parameters
    ----------
    command : of this valve, m2
    other, other_rest : the other valve's command and its value at rest, m2 (cross-talk acts on the difference)
    held : the target of the step before, m2
    step : s
    """
    wanted = command + end.crosstalk * (other - other_rest)
    if end.valve_stick > 0.0 and abs(wanted - held) < end.valve_stick:
        return held
    if end.valve_slew > 0.0:
        reach = end.valve_slew * step
        return held + min(max(wanted - held, -reach), reach)
    return wanted


@njit(cache=True)
def opening_of(spool: float, end: End) -> float:
    """Free opening, m2, of a spool that overlaps its port by ``valve_overlap``."""
    return max(0.0, spool - end.valve_overlap)
