# SPDX-License-Identifier: Apache-2.0
"""What :mod:`pneumo_ros.own_rig.loop` calls, holding nothing: a rig's own bridge is generated in its place.

:mod:`pneumo_ros.own_rig.kernel` writes these functions around a user's, from named tuples to arrays and back.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from pneumo_ros.arrays import Array

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Numba's decorator, or nothing."""
    return function


def derivative(x: Array, u: Array, p: Array, f: Array, out: Array) -> None:
    """Rates of the states, into ``out``."""


def reading(x: Array, u: Array, p: Array, f: Array, out: Array) -> None:
    """The measured channels, into ``out``."""


def coordinates(x: Array, u: Array, p: Array, out: Array) -> None:
    """Coordinates (K, 3) of the slots, into ``out``."""


def settle(x: Array, u: Array, p: Array) -> None:
    """At the end of a step: a model that changes abruptly has its states change here."""
