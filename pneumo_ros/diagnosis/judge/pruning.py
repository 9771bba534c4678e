# SPDX-License-Identifier: Apache-2.0
"""Effects of the best structure that do harm on the held-out log are taken away before the others are judged.

A name that the held-out log denies does not stand anyway (:mod:`pneumo_ros.diagnosis.judge.verdict`); in the structure
it would cost those beside it theirs. A law that is bent to fit a log may do anything on the next, an error of a sensor
above all, whose curve goes on where the fitted log never was. The held-out log takes away here and adds nothing, so it
still chooses between no names.
"""

from __future__ import annotations

from functools import partial
from typing import Final

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.diagnosis.judge.equations import EXPLAINED, SHOWN, Equations, held_up, left_in
from pneumo_ros.diagnosis.judge.held_out_runs import held_by
from pneumo_ros.diagnosis.record import Record
from pneumo_ros.diagnosis.search.fitting import of_law
from pneumo_ros.diagnosis.search.parts import reduced

# Times as much (rms) that a structure leaves with an effect as without it, from which on the effect does harm
# [calibration: set 0.5, opened]
HARM: Final = 1.25
STEPS: Final = 4  # iterations of a fit with an effect taken away [numerics]


def harmful(problem: Problem, best: Fit, holdout: Record, equations: Equations | None = None) -> tuple[Part, ...]:
    """Laws of a structure that it predicts a held-out log better without, one after another, the worst first.

    One always stays: what becomes of a lone effect is the verdict's matter.

    Parameters
    ----------
    problem, best : the structure, fitted to all blocks
    holdout : the held-out record
    equations : the rig's equations along it, where these are known
    """

    def left(one: Fit) -> tuple[float, float]:
        """Gap of the free run, rms, and what the equations miss; without end where the run has none."""
        gap = np.inf if one.diverged else held_by(problem, one, holdout).total
        if not np.isfinite(gap):
            return np.inf, np.inf
        return gap, 0.0 if equations is None else float(np.mean(left_in(equations, problem, one)))

    gone: list[Part] = []
    while len(best.candidate.laws) > 1:
        own = left(best)
        bare = problem.each(partial(_without, problem, best), best.candidate.laws)
        harms = [harm(own, there) for there in problem.each(left, bare)]
        worst = int(np.argmax(harms))
        if harms[worst] < HARM:
            break
        gone.append(best.candidate.laws[worst])
        best = bare[worst]
    return tuple(gone)


def _without(problem: Problem, best: Fit, law: Part) -> Fit:
    rows = np.ones(len(problem.measured), dtype=bool)
    return reduced(problem, best, of_law(best.candidate, law), STEPS, rows)


def harm(own: tuple[float, float], bare: tuple[float, float]) -> float:
    """Times as much (rms) that is left with an effect as without it, of the gap or of the equations, the larger.

    Of the equations alone where they miss much more without it: then the run owes its gap to another effect, whose law
    goes astray on the held-out log, and to lose this one would hide that and no more.
    """
    shown = own[1] > EXPLAINED + SHOWN
    missed = float(np.sqrt(own[1] / max(bare[1], EXPLAINED))) if shown else 0.0
    return missed if held_up(own[1], bare[1]) > 1.0 else max(own[0] / max(bare[0], 1e-12), missed)
