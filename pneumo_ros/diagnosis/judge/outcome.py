# SPDX-License-Identifier: Apache-2.0
"""What the competition and the held-out log gave: all that verdict, ranking and report are made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.diagnosis.judge.budget import Budget
from pneumo_ros.diagnosis.judge.closable import Closable
from pneumo_ros.diagnosis.judge.held_out_runs import HeldOut
from pneumo_ros.diagnosis.record import Record
from pneumo_ros.diagnosis.search.selection import Scored
from pneumo_ros.diagnosis.search.state import Search
from pneumo_ros.effects.parameters import Active


@dataclass(frozen=True)
class Whereabouts:
    """What flexible corrections on top of a structure say about the places of what it leaves.

    Attributes
    ----------
    shares : (place, share of the held-out residual that the structure leaves), largest first
    residual : rms residual of the equations, in null standard deviations, that the structure leaves on the held-out log
    mendable : the same once the right places get a flexible correction
    flat : noise, tolerances and model form explain what is left
    kept : share of the equations' gap that this structure leaves; None for the nominal one, which leaves all of it
    """

    shares: tuple[tuple[str, float], ...]
    residual: float
    mendable: float
    flat: bool
    kept: float | None = None


@dataclass(frozen=True)
class Outcome:
    """Structures with their scores, and the held-out log under the nominal, the re-estimated and the best of them.

    Attributes
    ----------
    search : the competition, ended
    refit, finalists, chosen : scored on the selection blocks
    base, best : the refit and the chosen structure, fitted to all blocks; the same object where nothing was chosen
    holdout : the held-out record
    runs : "nominal", "refit" and "best" on it
    closable : what could be closed at the places of the best structure's effects, and elsewhere
    budget : shares of the nominal gap
    before, after : places of what the nominal and the best structure leave; None where nobody looked
    """

    search: Search
    refit: Scored
    finalists: tuple[Scored, ...]
    chosen: Scored
    base: Fit
    best: Fit
    holdout: Record
    runs: Mapping[str, HeldOut]
    closable: Closable
    budget: Budget
    before: Whereabouts | None
    after: Whereabouts | None

    @property
    def problem(self) -> Problem:
        """The fitted logs, as last timed."""
        return self.search.problem

    @property
    def nuisance(self) -> Array:
        """Tolerance parameters of the best structure, SI."""
        return self.problem.nuisance(self.best.x)

    @property
    def active(self) -> tuple[Active, ...]:
        """Effects of the best structure."""
        return self.problem.active(self.best.candidate, self.problem.values(self.best.candidate, self.best.x))
