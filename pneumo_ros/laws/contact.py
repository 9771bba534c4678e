# SPDX-License-Identifier: Apache-2.0
"""Parts that touch and part: a stop, play, a contact that cannot pull.

Kernel arguments
----------------
depth : of the contact, 0 or more; stiffness : at the first touch; hardening : its growth, for a unit of depth
closing : share of the push that the rate inwards adds
load : what presses the parts together; share : of what pulls that is not there
travel, half : of the parts against each other, and half their play
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.laws.friction import clipped


@njit(cache=True, error_model="numpy", inline="always")
def stop(depth: float, stiffness: float, hardening: float, closing: float) -> float:
    """Push of a stop: k d (1 + a d) (1 + closing), stiffening rubber that loses energy in every contact; it never
    pulls.
    """
    return stiffness * depth * (1.0 + hardening * depth) * max(0.0, 1.0 + closing)


@njit(cache=True, error_model="numpy", inline="always")
def missing_pull(load: float, share: float) -> float:
    """What has to be added to a linear contact that pulls where the real one lets go."""
    return -share * min(load, 0.0)


@njit(cache=True, error_model="numpy", inline="always")
def in_play(travel: float, half: float) -> float:
    """The part of the travel that moves nothing."""
    return clipped(travel, half)
