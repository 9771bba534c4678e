# SPDX-License-Identifier: Apache-2.0
"""What flows where it should not, and openings that pass another share.

A gas chokes: its flow through a hole goes with the upper pressure alone below the critical ratio (ISO 6358); through a
long gap it goes with the difference of squares. A liquid's goes with the root of the difference, and with it.

Kernel arguments
----------------
up, down, scale : pressures (or levels) on both sides, and the one that a gas's gap is stated at, in one unit
gas : whether it chokes; a liquid does not
opening : pressure above which something opens
error, slope, over : share by which a flow is off, how it grows, and over which distance from where it is stated
flow : what flows on purpose, any unit
exponent : of a flow over the difference of pressures
left, time : share of a settling that is still to come, and its time constant, s; of a filling, what it would take at
    the rate that it has at a difference of ``scale``
per : of :func:`gap_over_hole`, :func:`alike_at`
"""

from __future__ import annotations

import math

from numba import njit

CRITICAL = 0.528  # pressure ratio below which air chokes


@njit(cache=True, error_model="numpy")
def through_hole(up: float, down: float, gas: bool) -> float:
    """Flow through a hole over that of the same hole at an upper pressure of one with nothing behind it."""
    if down > up:
        return -through_hole(down, up, gas)
    if not gas:
        return math.sqrt(up - down)
    if up <= 0.0:
        return 0.0
    ratio = down / up
    if ratio <= CRITICAL:
        return up
    r = (ratio - CRITICAL) / (1.0 - CRITICAL)
    # Linear within 0.1 % of balance, where the root's slope would be infinite.
    if ratio > 0.999:
        edge = (0.999 - CRITICAL) / (1.0 - CRITICAL)
        return up * math.sqrt(1.0 - edge * edge) * (1.0 - ratio) / 0.001
    return up * math.sqrt(1.0 - r * r)


@njit(cache=True, error_model="numpy", inline="always")
def through_gap(up: float, down: float, gas: bool, scale: float) -> float:
    """Laminar flow, in the pressure's unit: the difference, of a gas times the mean pressure over a scale."""
    return (up - down) * (0.5 * (up + down) / scale if gas else 1.0)


@njit(cache=True, error_model="numpy", inline="always")
def gap_over_hole(up: float, down: float, per: float) -> float:
    """A gas's flow through a gap over its choked flow through a hole: the difference of squares over the upper
    pressure.
    """
    return per * (up - down * down / up)


def alike_at(reference: float, down: float) -> float:
    """``per`` that makes gap and choked hole pass the same at an upper pressure ``reference``, over one behind it."""
    return reference / (reference**2 - down**2)


@njit(cache=True, error_model="numpy", inline="always")
def through_opening(up: float, down: float, scale: float, exponent: float) -> float:
    """Through a gap that the pressure itself opens, in the pressure's unit: d (|d| / scale)^(n - 1)."""
    d = up - down
    return d * (abs(d) / scale + 1e-9) ** (exponent - 1.0)


@njit(cache=True, error_model="numpy", inline="always")
def relieved(up: float, opening: float) -> float:
    """Through a way out that opens above a pressure, in the pressure's unit."""
    return max(0.0, up - opening)


@njit(cache=True, error_model="numpy", inline="always")
def in_excess(flow: float, error: float, slope: float, over: float) -> float:
    """What an opening passes beside the flow that is modelled: e (1 + a x) W."""
    return error * (1.0 + slope * over) * flow


@njit(cache=True, error_model="numpy", inline="always")
def settling(left: float, time: float) -> float:
    """Rate of what settles exponentially, for one unit of it."""
    return left / time


@njit(cache=True, error_model="numpy", inline="always")
def filling(up: float, down: float, scale: float, time: float) -> float:
    """Rate of the pressure in a vessel that is filled, or emptied, through an orifice: with the root of the difference,
    linear where that is well below 4 % of the scale.
    """
    d = up - down
    return d / (time * math.sqrt(abs(d) / scale + 0.04))
