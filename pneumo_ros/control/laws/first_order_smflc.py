"""First order SMFLC: the input of Eq. 6.40 with the surface S = e' + lambda e (Eqs. 6.43 and 6.90)."""

from __future__ import annotations

from numba import njit

from pneumo_ros.control.laws.common import Error, Gains, linear_jerk, saturation


@njit(cache=True)
def first_order_smflc(error: Error, gains: Gains) -> tuple[float, float]:
    """Wanted third derivative of the output, unit/s^3, and the sliding variable S, unit/s."""
    surface = error.rate + gains.pole * error.value
    return linear_jerk(error, gains.pole) - gains.sliding * saturation(surface, gains.layer), surface
