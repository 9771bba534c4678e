# SPDX-License-Identifier: Apache-2.0
"""The terms of an empty library: the names through which :func:`pneumo_ros.effects.kernel.simulate` calls terms.

Generated modules hold functions of these names for a library. ``z`` is a tuple with each term's own states at each end,
``flags`` whether it acts there, ``p`` its parameters there; ``s`` are the :class:`~pneumo_ros.effects.kernel.Signals`.

Kernel arguments
----------------
on, values, inner : per term and end: whether it acts (K, 2), its parameters (K, 2, M), its own states (K, 2, S)
z, flags, p : the same as tuples, one entry for each term and end
s, loads : signals and loads of :mod:`pneumo_ros.effects.kernel`
dt, drop : a step, s; how far the supply's pressure lies below the regulated one, Pa
"""

from __future__ import annotations

from typing import Any

from numba import njit

from pneumo_ros.arrays import Array

Each = tuple[Any, ...]  # one entry for each term and end


@njit(cache=True)
def switches(on: Array) -> tuple[bool, Each]:
    """Whether any acting term has states of its own, and ``flags`` from (K, 2) bool."""
    return False, ()


@njit(cache=True)
def parameters(values: Array) -> Each:
    """``p`` from (K, 2, M)."""
    return ()


@njit(cache=True)
def at_rest() -> Each:
    """``z`` of zeros."""
    return ()


@njit(cache=True)
def restored(inner: Array) -> Each:
    """``z`` from (K, 2, S)."""
    return ()


@njit(cache=True)
def stored(z: Each, inner: Array) -> None:
    """Write ``z`` into (K, 2, S)."""


@njit(cache=True)
def started(z: Each, flags: Each, p: Each, s: Any) -> Each:
    """``z`` at the first instant, from ``z`` at rest."""
    return z


@njit(cache=True)
def advanced(z: Each, flags: Each, p: Each, s: Any, dt: float) -> Each:
    """``z`` one step of ``dt`` s later, signals held."""
    return z


@njit(cache=True)
def sagged(z: Each, flags: Each, p: Each, drop: float) -> float:
    """``drop``, Pa, and what the terms add to the drop of the supply's pressure."""
    return drop


@njit(cache=True)
def added(z: Each, flags: Each, p: Each, s: Any, loads: Any) -> Any:
    """``loads`` (:class:`~pneumo_ros.effects.kernel.Loads`) and what the terms add to them."""
    return loads
