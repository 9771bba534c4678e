"""Third order integral sliding mode (Eqs. 6.32 and 6.40): no offset, at the price of the integral's overshoot."""

from __future__ import annotations

from numba import njit

from pneumo_ros.control.laws.common import Error, Gains, linear_jerk, saturation


@njit(cache=True)
def third_order_integral_smc(error: Error, gains: Gains) -> tuple[float, float]:
    """Wanted third derivative of the output, unit/s^3, and the sliding variable S, unit/s^2."""
    pole = gains.pole
    surface = error.acceleration + pole * (3.0 * error.rate + pole * (3.0 * error.value + pole * error.integral))
    return linear_jerk(error, pole) - gains.sliding * saturation(surface, gains.layer), surface
