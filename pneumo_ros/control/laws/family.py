# SPDX-License-Identifier: Apache-2.0
"""The laws, and their dispatch by index."""

from __future__ import annotations

from numba import njit

from pneumo_ros.control.laws.common import Error, Gains, linear_jerk, saturation, second_order_jerk

# By name, and by index for compiled code, which cannot look functions up.
LAWS = ("flc", "mrflc", "third_order_integral_smc", "third_order_smc", "third_order_smflc", "first_order_smflc")
FLC, MRFLC, THIRD_ORDER_INTEGRAL_SMC, THIRD_ORDER_SMC, THIRD_ORDER_SMFLC, FIRST_ORDER_SMFLC = range(6)


@njit(cache=True)
def linear(error: Error, gains: Gains) -> tuple[float, float]:
    """Feedback linearisation (Eqs. 6.18-6.21) with a constant reference, or model reference (Eq. 6.22) with that one.

    Wanted third derivative of the output, unit/s^3, and the sliding variable S, zero: there is none.
    """
    return linear_jerk(error, gains.pole), 0.0


@njit(cache=True)
def third_order_integral_smc(error: Error, gains: Gains) -> tuple[float, float]:
    """Third order integral sliding mode (Eqs. 6.32, 6.40): no offset, at the price of the integral's overshoot.

    Wanted third derivative of the output, unit/s^3, and the sliding variable S, unit/s^2.
    """
    pole = gains.pole
    surface = error.acceleration + pole * (3.0 * error.rate + pole * (3.0 * error.value + pole * error.integral))
    return linear_jerk(error, pole) - gains.sliding * saturation(surface, gains.layer), surface


@njit(cache=True)
def third_order_smc(error: Error, gains: Gains) -> tuple[float, float]:
    """Third order sliding mode (Eqs. 6.33, 6.41): its dynamics on the surface leave an offset (Eq. 6.42).

    Wanted third derivative of the output, unit/s^3, and the sliding variable S, unit/s^2.
    """
    pole = gains.pole
    surface = error.acceleration + pole * (2.0 * error.rate + pole * error.value)
    return second_order_jerk(error, pole) - gains.sliding * saturation(surface, gains.layer), surface


@njit(cache=True)
def third_order_smflc(error: Error, gains: Gains) -> tuple[float, float]:
    """Third order SMFLC: the input of Eq. 6.40 with the surface of Eq. 6.33 (Section 6.5).

    Wanted third derivative of the output, unit/s^3, and the sliding variable S, unit/s^2.
    """
    pole = gains.pole
    surface = error.acceleration + pole * (2.0 * error.rate + pole * error.value)
    return linear_jerk(error, pole) - gains.sliding * saturation(surface, gains.layer), surface


@njit(cache=True)
def first_order_smflc(error: Error, gains: Gains) -> tuple[float, float]:
    """First order SMFLC: the input of Eq. 6.40 with the surface S = e' + lambda e (Eqs. 6.43, 6.90).

    Wanted third derivative of the output, unit/s^3, and the sliding variable S, unit/s.
    """
    surface = error.rate + gains.pole * error.value
    return linear_jerk(error, gains.pole) - gains.sliding * saturation(surface, gains.layer), surface


@njit(cache=True)
def wanted_jerk(law: int, error: Error, gains: Gains) -> tuple[float, float]:
    """Third derivative wanted of an output and its sliding variable, by ``law``, an index into :data:`LAWS`."""
    if law == FIRST_ORDER_SMFLC:
        return first_order_smflc(error, gains)
    if law == THIRD_ORDER_SMFLC:
        return third_order_smflc(error, gains)
    if law == THIRD_ORDER_SMC:
        return third_order_smc(error, gains)
    if law == THIRD_ORDER_INTEGRAL_SMC:
        return third_order_integral_smc(error, gains)
    return linear(error, gains)
