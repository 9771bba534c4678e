# SPDX-License-Identifier: Apache-2.0
"""The reference model: a triple pole that leads the output smoothly to its set point (Sections 6.4 and 6.7.2).

Kernel arguments
----------------
state : y_d, y_d', y_d''
target : set point, in the output's unit
pole, period : 1/s, s
"""

from __future__ import annotations

import math

from numba import njit

Reference = tuple[float, float, float]


@njit(cache=True)
def advance_reference(state: Reference, target: float, pole: float, period: float) -> Reference:
    """y_d, y_d', y_d'' one period later, exactly: (d/dt + pole)^3 y_d = pole^3 target with the target held.

    With e = y_d - target, the solution is exp(-pole t) times a quadratic in t.
    """
    e, v, a = state[0] - target, state[1], state[2]
    c1 = v + pole * e
    c2 = 0.5 * (a + pole * (2.0 * v + pole * e))
    fade, t = math.exp(-pole * period), period
    q, dq, ddq = e + t * (c1 + t * c2), c1 + 2.0 * t * c2, 2.0 * c2
    return (
        target + fade * q,
        fade * (dq - pole * q),
        fade * (ddq - 2.0 * pole * dq + pole * pole * q),
    )


@njit(cache=True)
def reference_jerk(state: Reference, target: float, pole: float) -> float:
    """y_d''' of the model at its state."""
    return pole * (pole * (pole * (target - state[0]) - 3.0 * state[1]) - 3.0 * state[2])
