"""The family by name, and its dispatch for compiled code (an index, because compiled functions cannot be looked up)."""

from __future__ import annotations

from numba import njit

from pneumo_ros.control.laws.common import Error, Gains
from pneumo_ros.control.laws.first_order_smflc import first_order_smflc
from pneumo_ros.control.laws.linear import linear
from pneumo_ros.control.laws.third_order_integral_smc import third_order_integral_smc
from pneumo_ros.control.laws.third_order_smc import third_order_smc
from pneumo_ros.control.laws.third_order_smflc import third_order_smflc

LAWS = ("flc", "mrflc", "third_order_integral_smc", "third_order_smc", "third_order_smflc", "first_order_smflc")
FLC, MRFLC, THIRD_ORDER_INTEGRAL_SMC, THIRD_ORDER_SMC, THIRD_ORDER_SMFLC, FIRST_ORDER_SMFLC = range(6)


@njit(cache=True)
def wanted_jerk(law: int, error: Error, gains: Gains) -> tuple[float, float]:
    """Third derivative wanted of an output and its sliding variable, by law index into :data:`LAWS`."""
    if law == FIRST_ORDER_SMFLC:
        return first_order_smflc(error, gains)
    if law == THIRD_ORDER_SMFLC:
        return third_order_smflc(error, gains)
    if law == THIRD_ORDER_SMC:
        return third_order_smc(error, gains)
    if law == THIRD_ORDER_INTEGRAL_SMC:
        return third_order_integral_smc(error, gains)
    return linear(error, gains)
