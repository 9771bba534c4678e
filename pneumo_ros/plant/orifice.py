# SPDX-License-Identifier: Apache-2.0
"""Mass flow of air through an orifice, polytropic, clamped at the critical ratio, with a check valve.

Source: Eqs. 4.1-4.7 (SI form, errata 5) with the critical clamp; Eqs. 4.8 and 4.12 in the corrected form of errata 4.
"""

from __future__ import annotations

import math

from numba import njit

from pneumo_ros.units import GAS_CONSTANT


@njit(cache=True)
def critical_ratio(n: float) -> float:
    """Downstream over upstream pressure (absolute) below which the flow is sonic, for polytropic exponent ``n``.

    ``n = 1`` gives the isothermal limit exp(-1/2).
    """
    if abs(n - 1.0) < 1e-9:
        return math.exp(-0.5)
    return (2.0 / (n + 1.0)) ** (n / (n - 1.0))


@njit(cache=True)
def flow_function(ratio: float, n: float) -> float:
    """Dimensionless sqrt(2n/(n-1) (r^(2/n) - r^((n+1)/n))) of Eq. 4.7 at an unclamped ``ratio`` in (0, 1]; ``n`` is the
    polytropic exponent.

    Written with expm1 of the logarithm, so that n -> 1 is smooth and small pressure drops keep their digits.
    """
    x = math.log(ratio)
    k = (n - 1.0) / n
    drop = -x if abs(k) < 1e-9 else -math.expm1(k * x) / k
    return math.exp(x / n) * math.sqrt(2.0 * max(drop, 0.0))


@njit(cache=True, error_model="numpy")
def clamped_flow_function(ratio: float, power: float, k: float, critical: float, choked: float) -> float:
    """:func:`flow_function` with its critical clamp and check valve, from a power the caller already has.

    Parameters
    ----------
    ratio : downstream over upstream absolute pressure
    power : ratio**k
    k : (n - 1)/n; below 1e-9 the isothermal limit is used
    critical, choked : ``critical_ratio(n)`` and ``flow_function(critical, n)``, computed once

    r^(2/n) = (r/r^k)^2, so one power serves temperature and both orifices: the transcendental functions are what a
    step of the rig costs.
    """
    if ratio >= 1.0:
        return 0.0
    if ratio <= critical:
        return choked
    drop = (1.0 - power) / k if k > 1e-9 else -math.log(ratio)
    return ratio / power * math.sqrt(2.0 * max(drop, 0.0))


@njit(cache=True)
def mass_flow(area: float, upstream: float, downstream: float, temperature: float, n: float) -> float:
    """Mass flow through an orifice, kg/s, never negative (check valve).

    Parameters
    ----------
    area : effective orifice area (opening times discharge coefficient), m2
    upstream, downstream : absolute pressures, Pa, > 0
    temperature : upstream temperature, K
    n : polytropic exponent, >= 1

    Source: Eq. 4.7.
    """
    if downstream >= upstream:
        return 0.0
    psi = flow_function(max(downstream / upstream, critical_ratio(n)), n)
    return area * upstream * psi / math.sqrt(GAS_CONSTANT * temperature)
