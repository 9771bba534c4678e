# SPDX-License-Identifier: Apache-2.0
"""How large the effects of a case are: each sized alone to its grade, then seen together."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pneumo_ros.casemaker.bench import SEARCH_STEP, Bench, Logs, refitted
from pneumo_ros.casemaker.budget import Budget, budget_of
from pneumo_ros.casemaker.catalogue import get
from pneumo_ros.casemaker.gap_size import Null, quick_gap
from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.planned import Planned
from pneumo_ros.casemaker.refit import bounded_gap
from pneumo_ros.casemaker.registry import Applied
from pneumo_ros.casemaker.scene import Scene, Session, observation, play
from pneumo_ros.casemaker.simulate import STEP
from pneumo_ros.casemaker.trim import NoRestError

GRADE_TOLERANCE = 0.04  # relative
QUICK_TRIES, CAREFUL_TRIES = 5, 9
ROUGH_TOLERANCE = 0.2  # of the grade of one of several effects
PART, GROWTH = 0.03, 1.7  # smallest part of what the refit leaves that one of several holds; else it grows by this


@dataclass(frozen=True)
class Graded:
    """An effect at the size that meets its grade, as far as a sane size can."""

    size: float
    gap: float
    ratio: float
    weakest: float  # smallest ratio of one of its effects alone to its grade
    sizes: tuple[float, ...]
    applied: tuple[Applied, ...]


def graded_effects(case: Planned, real: RicherRig, scene: Scene, null: Null, seed: int, on: Bench) -> Graded:
    """Size each effect alone to the case's grade (so that in a pair both can be seen), then measure the whole."""
    sizes, weakest = [], math.inf
    for i, one in enumerate(case.effects):
        grade = case.grades[i] if case.grades else case.grade
        size, alone = case.size, grade
        if size is None:
            only = replace(case, effects=(one,), laws=case.laws[i : i + 1], grade=grade)
            size, alone = _search(only, real, scene, null, seed, on)
        sizes.append(size)
        weakest = min(weakest, alone / grade)
    return of_sizes(case, real, tuple(sizes), weakest, scene, null, seed, on)


def of_sizes(
    case: Planned, real: RicherRig, sizes: tuple[float, ...], weakest: float, scene: Scene, null: Null, seed: int,
    on: Bench,
) -> Graded:  # fmt: skip
    """The effects together at their sizes, and how large the whole is."""
    applied = applied_effects(case, real, sizes, seed)
    rig, road_gain = combined(real, applied)
    value = null.gap
    if applied:
        value = refitted(play(rig, on.nominal, scene, on.car.surface, road_gain), on, null.logs)[0]
    return Graded(max(sizes, default=0.0), value, value / null.gap, weakest, sizes, applied)


def grown_sizes(
    case: Planned, real: RicherRig, graded: Graded, seed: int, scenes: tuple[Scene, Scene], drawn: Logs, on: Bench
) -> tuple[float, ...]:
    """Sizes, larger for those of several effects that hold too little of the held-out gap."""
    rig, road_gain = combined(real, graded.applied)
    logs = tuple(play(rig, on.nominal, scene, on.car.surface, road_gain, SEARCH_STEP) for scene in scenes)
    if not all(np.isfinite(log.run.measured).all() for log in logs):
        return graded.sizes
    budget = true_budget(case, real, graded.sizes, seed, (logs[0], logs[1]), drawn, on, orders=False)
    total = sum(budget.shares)
    return tuple(
        min(1.0, GROWTH * size) if share < 1.3 * PART * total else size
        for size, share in zip(graded.sizes, budget.shares, strict=True)
    )


def applied_effects(case: Planned, real: RicherRig, sizes: tuple[float, ...], seed: int) -> tuple[Applied, ...]:
    out, rig = [], real
    laws = case.laws or ("",) * len(case.effects)
    for (name, side), law, size in zip(case.effects, laws, sizes, strict=True):
        # By name: an effect is the same alone, where it is sized, and in a pair.
        done = get(name, law).apply(rig, size, side, np.random.default_rng([seed, zlib.crc32(name.encode())]))
        rig = done.rig
        out.append(done)
    return tuple(out)


def combined(real: RicherRig, applied: tuple[Applied, ...]) -> tuple[RicherRig, float]:
    if not applied:
        return real, 1.0
    return applied[-1].rig, max(item.road_gain for item in applied)


def rig_with_some(
    case: Planned, real: RicherRig, sizes: tuple[float, ...], seed: int, members: frozenset[int]
) -> RicherRig:
    """The true rig with some of its effects."""
    kept = sorted(members)
    some = replace(case, effects=tuple(case.effects[i] for i in kept), laws=tuple(case.laws[i] for i in kept))
    return combined(real, applied_effects(some, real, tuple(sizes[i] for i in kept), seed))[0]


def true_budget(
    case: Planned, real: RicherRig, sizes: tuple[float, ...], seed: int, logs: tuple[Session, Session], drawn: Logs,
    on: Bench, orders: bool = True,
) -> Budget:  # fmt: skip
    seen = (observation(logs[0], on.nominal), observation(logs[1], on.nominal))
    some: Callable[[frozenset[int]], RicherRig] = partial(rig_with_some, case, real, sizes, seed)
    return budget_of(len(case.effects), some, logs, seen, drawn, on.car, on.car.surface, orders)


def _search(case: Planned, real: RicherRig, scene: Scene, null: Null, seed: int, on: Bench) -> tuple[float, float]:
    """Size whose refit gap is ``case.grade`` floors, and how many it is: the quick ruler finds the neighbourhood, the
    refit decides.
    """

    step = SEARCH_STEP if case.budgeted else STEP

    def ratio_at(size: float, careful: bool) -> float:
        rig, road_gain = combined(real, applied_effects(case, real, (size,), seed))
        try:
            session = play(rig, on.nominal, scene, on.car.surface, road_gain, step)
        except NoRestError:
            return math.inf
        if case.budgeted and not careful:
            seen = observation(session, on.nominal)
            return bounded_gap(on.car, seen, null) / null.gap if np.isfinite(seen.measured).all() else math.inf
        return _left(session, null, on, careful) / null.gap

    first = min(0.02 * case.grade, 0.5)
    if case.budgeted and case.kind not in ("single", "unknown"):  # of several at once the shares are measured anyway
        return _sized(lambda size: ratio_at(size, False), case.grade, first, QUICK_TRIES, ROUGH_TOLERANCE)
    start, _ = _sized(lambda size: ratio_at(size, False), case.grade, first, QUICK_TRIES)
    return _sized(lambda size: ratio_at(size, True), case.grade, start, CAREFUL_TRIES)


def _left(session: Session, null: Null, on: Bench, careful: bool) -> float:
    if careful:
        return refitted(session, on, null.logs)[0]
    seen = observation(session, on.nominal)
    return quick_gap(on.car, seen, null) if np.isfinite(seen.measured).all() else math.inf


def _sized(
    ratio_at: Callable[[float], float], grade: float, start: float, tries: int, tolerance: float = GRADE_TOLERANCE
) -> tuple[float, float]:
    """(size, its ratio): false position on log(excess over the floor) against log(size)."""
    wanted = 0.5 * math.log(grade**2 - 1.0)
    low: tuple[float, float] | None = None
    high: tuple[float, float] | None = None
    size, best, closest = start, (start, 0.0), math.inf
    for _ in range(tries):
        ratio = ratio_at(size)
        # As a ratio: an effect sized below its threshold is no nearer to its grade than one three times over.
        off = abs(math.log(ratio / grade)) if 0.0 < ratio < math.inf else math.inf
        if off < closest:
            best, closest = (size, ratio), off
        if off < tolerance or (size >= 1.0 and ratio < grade):
            break
        excess = 0.5 * math.log(max(ratio**2 - 1.0, 0.02)) if math.isfinite(ratio) else 10.0
        if excess < wanted:
            low = (math.log(size), excess)
        else:
            high = (math.log(size), excess)
        size = _next_size(low, high, wanted)
    return best


def _next_size(low: tuple[float, float] | None, high: tuple[float, float] | None, wanted: float) -> float:
    if low is not None and high is not None:
        share = (wanted - low[1]) / max(high[1] - low[1], 1e-9)
        share = min(max(share, 0.15), 0.85)
        return math.exp(low[0] + share * (high[0] - low[0]))
    known = low if low is not None else high
    assert known is not None  # the caller has just set one of them
    step = min(max(wanted - known[1], -2.5), 2.5)
    return min(1.0, math.exp(known[0] + 1.1 * step))
