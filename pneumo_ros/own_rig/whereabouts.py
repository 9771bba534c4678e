# SPDX-License-Identifier: Apache-2.0
"""Where the gap of one's own rig lies: what whatever may act at a slot closes on the held-out log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.diagnose import Fitted
from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit
from pneumo_ros.diagnosis.judge.held_out import total_floor
from pneumo_ros.diagnosis.judge.held_out_runs import held_by
from pneumo_ros.diagnosis.judge.outcome import Whereabouts
from pneumo_ros.diagnosis.search.parts import with_parts
from pneumo_ros.effects.parameters import Active
from pneumo_ros.own_rig.model import OwnRig
from pneumo_ros.own_rig.records import OwnRecord

STEPS = 3  # iterations of a fit with whatever acts at a slot
WHOLE = 1.02  # closes nearly all: keeps the ratio of two such places finite
NEAR_FLOOR = 1.5  # of the floor: nothing to look for below


def whereabouts(
    model: OwnRig, records: Sequence[OwnRecord], holdout: OwnRecord, fitted: Fitted | None, threads: int
) -> tuple[Whereabouts, Whereabouts | None]:
    """Places of what structures leave; as :data:`pneumo_ros.diagnosis.diagnose.Locate`."""
    problem = Problem(model, tuple(records), threads=threads)
    before = _left(problem, model, holdout, None, ())
    return before, None if fitted is None else _left(problem, model, holdout, *fitted)


def _left(
    problem: Problem, model: OwnRig, holdout: OwnRecord, nuisance: Array | None, active: Sequence[Active]
) -> Whereabouts:
    """Places of what one structure leaves."""
    base = _base(problem, nuisance, active)
    floor = total_floor(holdout)
    own = held_by(problem, base, holdout).total
    if own < NEAR_FLOOR * floor:
        return Whereabouts((), own / floor, own / floor, True)
    closed = {slot.place: _closed(problem, base, model, slot.place, holdout, own) for slot in model.physics.slots}
    best = max(closed.values())
    odds = {place: share / (WHOLE - share) for place, share in closed.items()}
    whole = max(sum(odds.values()), 1e-12)
    shares = sorted(((place, best * o / whole) for place, o in odds.items()), key=lambda one: -one[1])
    return Whereabouts(tuple(shares), own / floor, own / floor * float(np.sqrt(1.0 - best)), best < 0.05)


def _base(problem: Problem, nuisance: Array | None, active: Sequence[Active]) -> Fit:
    """The structure at its values; the nominal one re-estimated."""
    candidate = Candidate(tuple((one.effect, one.site) for one in active))
    values = [v for one in active for v in one.values]
    start = problem.start(candidate, None, values)
    if nuisance is not None:
        for m, p in enumerate(problem.model.parameters):
            start[m] = (nuisance[m] - p.nominal) / p.std
    return fit(problem, candidate, start, rows=_all(problem), iterations=STEPS)


def _closed(problem: Problem, base: Fit, model: OwnRig, place: str, holdout: OwnRecord, own: float) -> float:
    """Share of the squared held-out gap that whatever acts at a place closes, 0..1."""
    parts = tuple(part for part in model.anything_at(place) if part[0] in model.effects)
    if not parts or base.diverged:
        return 0.0
    left = held_by(problem, with_parts(problem, base, parts, STEPS, _all(problem)), holdout).total
    return float(np.clip(1.0 - (left / own) ** 2, 0.0, 1.0)) if np.isfinite(left) else 0.0


def _all(problem: Problem) -> np.ndarray:
    return np.ones(len(problem.measured), dtype=bool)
