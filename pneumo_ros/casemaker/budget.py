# SPDX-License-Identifier: Apache-2.0
"""The true budget of a case's held-out gap: what each effect makes, what a refit takes, counted like a diagnosis does.

For every subset S of the effects the true rig with only those effects is driven by the log's commands from its first
reading, on the fit and on the held-out log; the tolerances are refitted (linearly, inside three sigma) on the fit log
and what is left of the held-out log is v(S), squared, a mean over channels in their stds. An effect's share is its
Shapley value of v, that is v(S) - v(S with it) averaged over the orders in which effects can be added, over the nominal
gap less v(all); ``left_out`` is the last step alone: v(all but this) - v(all). ``refit`` is what the refit without any
effect takes from the nominal gap; shares and refit add up to one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.casemaker.gap_size import DECIMATE, NUISANCE, Observation, free_run, gap, perturbed
from pneumo_ros.casemaker.open_loop import shown
from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.refit import SIGMA, bounded_step, sensitivities
from pneumo_ros.casemaker.scene import Session
from pneumo_ros.plant.air_spring import AreaSurface
from pneumo_ros.plant.half_car import HalfCar

Subset = frozenset[int]


@dataclass(frozen=True)
class Budget:
    """Shares of the nominal held-out gap (squared, above the floor).

    Attributes
    ----------
    shares : of each effect, over the orders
    left_out : of each effect, left out last
    refit : of the refit
    nominal, refitted, complete : the held-out gaps behind them
    """

    shares: tuple[float, ...]
    left_out: tuple[float, ...]
    refit: float
    nominal: float
    refitted: float
    complete: float


def true_logs(sigmas: dict[str, float]) -> NDArray[np.float64]:
    """Logs of the ruler's 16 parameters in a drawn rig, from how many sigmas each number of the rig file is off."""
    names = {"damping_front": "bushing_damping", "damping_rear": "bushing_damping",
             "area_scale_front": "effective_area_scale", "area_scale_rear": "effective_area_scale",
             "volume": "volume_scale", "discharge": "discharge_coefficient", "supply": "supply_pressure"}  # fmt: skip
    out = []
    for part, name, width in NUISANCE:
        key = f"outlet_area_{part}" if name == "outlet_scale" else names.get(name, name)
        out.append(math.log1p(width * sigmas[key]))
    return np.array(out)


def budget_of(
    count: int,
    rig_with: Callable[[Subset], RicherRig],
    logs: tuple[Session, Session],
    seen: tuple[Observation, Observation],
    drawn: NDArray[np.float64],
    car: HalfCar,
    surface: AreaSurface,
    orders: bool = True,
) -> Budget:
    """Budget of a case with ``count`` effects.

    Parameters
    ----------
    rig_with : the true rig with a subset of its effects
    logs, seen : fit and held-out session
    drawn : logs of the tolerances' true values, (16,)
    orders : whether all subsets are simulated; otherwise the shares are those left out last, at a fraction of the time
    """
    full = rig_with(frozenset(range(count)))
    slopes = [sensitivities(car, one, drawn) for one in seen]
    prior = float(np.mean(seen[0].noise / slopes[0].scale))

    def left(members: Subset) -> float:
        rig = rig_with(members)
        errors = [
            ((one.measured - shown(rig, full, session, surface))[::DECIMATE] / slope.scale).ravel()
            for one, session, slope in zip(seen, logs, slopes, strict=True)
        ]
        if not all(np.isfinite(error).all() for error in errors):
            return math.nan
        step = bounded_step(slopes[0].jacobian, errors[0], drawn / SIGMA, prior)
        return float(np.mean((errors[1] - slopes[1].jacobian @ step) ** 2))

    everyone = frozenset(range(count))
    sizes = range(count + 1) if orders else sorted({0, max(count - 1, 0), count})
    value = {s: left(s) for k in sizes for s in map(frozenset, combinations(range(count), k))}
    nominal = gap(free_run(perturbed(car, np.zeros(len(NUISANCE))), seen[1]), seen[1])
    whole = nominal**2 - value[everyone]
    last = [(value[everyone - {i}] - value[everyone]) / whole for i in range(count)]
    shares = [_shapley(i, count, value) / whole for i in range(count)] if orders else last
    empty: Subset = frozenset()
    return Budget(tuple(shares), tuple(last), (nominal**2 - value[empty]) / whole, nominal, math.sqrt(value[empty]),
                  math.sqrt(value[everyone]))  # fmt: skip


def _shapley(player: int, count: int, value: dict[Subset, float]) -> float:
    others: Sequence[int] = [i for i in range(count) if i != player]
    total = 0.0
    for k in range(count):
        weight = math.factorial(k) * math.factorial(count - k - 1) / math.factorial(count)
        for some in map(frozenset, combinations(others, k)):
            total += weight * (value[some] - value[some | {player}])
    return total
