# SPDX-License-Identifier: Apache-2.0
"""Whether a rig file that is surer than its maker should be makes what is told as an effect."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.fit.solver import fit
from pneumo_ros.diagnosis.judge.ambiguity import as_good
from pneumo_ros.diagnosis.search.selection import Scored, score

STRAINED: Final = 1.5  # tolerances that one must be off by in the refit for it to be asked [numerics]
STEPS: Final = 10  # iterations of the looser refit, from the refit [numerics]


def stated_otherwise(problem: Problem, refit: Scored, chosen: Scored) -> list[str]:
    """What to state in the rig file where a refit inside looser tolerances leaves as little as a structure of effects
    does, a line for each statement with the parameters that are then off by more than their tolerances, the farthest
    first; none elsewhere.
    """
    sure = [m for m, p in enumerate(problem.model.parameters) if p.loose > 1.0]
    if not chosen.size or not any(abs(refit.fit.x[m]) > STRAINED for m in sure):
        return []
    loose = replace(problem, loose=True)
    rival = fit(loose, refit.fit.candidate, refit.fit.x, refit.fit.jacobian, iterations=STEPS)
    if rival.diverged or not as_good(refit, chosen, score(loose, rival)):
        return []
    values = problem.nuisance(rival.x)
    off: dict[str, list[str]] = {}
    for m in sorted(sure, key=lambda m: -abs(rival.x[m])):
        p, times = problem.model.parameters[m], abs(rival.x[m])
        if times > 1.0:
            unit = "" if p.unit == "1" else f" {p.unit}"
            off.setdefault(p.otherwise, []).append(f"{p.name} {values[m]:.2g}{unit} ({times:.1f} times its tolerance)")
    return [f"without an effect {', '.join(ones)} would explain as much: {what}" for what, ones in off.items()]
