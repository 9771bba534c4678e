"""Third order sliding mode (Eqs. 6.33 and 6.41): its dynamics on the surface leave an offset (Eq. 6.42)."""

from __future__ import annotations

from numba import njit

from pneumo_ros.control.laws.common import Error, Gains, saturation, second_order_jerk


@njit(cache=True)
def third_order_smc(error: Error, gains: Gains) -> tuple[float, float]:
    """Wanted third derivative of the output, unit/s^3, and the sliding variable S, unit/s^2."""
    pole = gains.pole
    surface = error.acceleration + pole * (2.0 * error.rate + pole * error.value)
    return second_order_jerk(error, pole) - gains.sliding * saturation(surface, gains.layer), surface
