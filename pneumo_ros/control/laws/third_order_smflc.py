"""Third order SMFLC: the input of Eq. 6.40 with the surface of Eq. 6.33 (Section 6.5)."""

from __future__ import annotations

from numba import njit

from pneumo_ros.control.laws.common import Error, Gains, linear_jerk, saturation


@njit(cache=True)
def third_order_smflc(error: Error, gains: Gains) -> tuple[float, float]:
    """Wanted third derivative of the output, unit/s^3, and the sliding variable S, unit/s^2."""
    pole = gains.pole
    surface = error.acceleration + pole * (2.0 * error.rate + pole * error.value)
    return linear_jerk(error, pole) - gains.sliding * saturation(surface, gains.layer), surface
