# SPDX-License-Identifier: Apache-2.0
"""What made rigs share: what one is, courses of their inputs, and scipy's integrator."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.integrate import solve_ivp

from pneumo_ros.arrays import Array

Columns = dict[str, Array]
SLOTS = "import math\n\nfrom pneumo_ros.own_rig import Contact, Flow, Force, Input, Sensor\n\n"


@dataclass(frozen=True)
class Made:
    """A rig.

    Attributes
    ----------
    physics, names : rig.py and rig.yaml
    log : random numbers -> columns of a log, ``t`` first
    families : what is missing in the model; empty: nothing; ``unknown``: what no family is
    """

    physics: str
    names: str
    log: Callable[[Generator], Columns]
    families: frozenset[str]


def several(rng: Generator, sizes: Sequence[float], hertz: Sequence[float]) -> Callable[[float], float]:
    """Sines of random phases."""
    phases = rng.uniform(0.0, 2.0 * np.pi, len(hertz))
    return lambda t: float(np.sum(np.array(sizes) * np.sin(2.0 * np.pi * np.array(hertz) * t + phases)))


def levels(rng: Generator, length: float, count: int, low: float, high: float) -> Callable[[float], float]:
    """Random levels joined by straight lines."""
    at, values = np.linspace(0.0, length, count), rng.uniform(low, high, count)
    return lambda t: float(np.interp(t, at, values))


def run(rates: Callable[[float, Array], list[float]], start: Sequence[float], t: Array, step: float) -> Array:
    """(states, N)."""
    return np.asarray(solve_ivp(rates, (t[0], t[-1]), start, t_eval=t, max_step=step, rtol=1e-7, atol=1e-9).y)


def sampled(course: Callable[[float], float], t: Array) -> Array:
    """(N,) a course where the log has a row."""
    return np.array([course(one) for one in t])


def beyond(value: float, zone: float) -> float:
    """What of a value is outside a dead zone."""
    return float(np.sign(value) * max(abs(value) - zone, 0.0))
