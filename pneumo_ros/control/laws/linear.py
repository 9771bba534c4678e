"""Feedback linearisation (Eqs. 6.18-6.21) and model reference (Eq. 6.22): one law, two references.

FLC holds a constant reference, MRFLC follows the reference model; the caller chooses which error it passes.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.control.laws.common import Error, Gains, linear_jerk


@njit(cache=True)
def linear(error: Error, gains: Gains) -> tuple[float, float]:
    """Wanted third derivative of the output, unit/s^3, and the sliding variable S, zero: there is none."""
    return linear_jerk(error, gains.pole), 0.0
