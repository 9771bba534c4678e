# SPDX-License-Identifier: Apache-2.0
"""Hooks that effects of several sensors share."""

from __future__ import annotations

from pneumo_ros.arrays import Array
from pneumo_ros.effects.contract import Memory, Values


def shifted(
    outputs: Array, period: float, channels: tuple[int, ...], values: Values, memory: Memory
) -> tuple[Array, Memory]:
    """What a sensor reports whose zero is off by the first value, m or Pa."""
    outputs[:, channels] += values[0]
    return outputs, None


def unshifted(measured: Array, channels: tuple[int, ...], values: Values) -> Array:
    """What was really there."""
    measured[:, channels] -= values[0]
    return measured
