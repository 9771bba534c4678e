# SPDX-License-Identifier: Apache-2.0
"""What this log cannot tell apart from the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.judge.verdict import Opinion, name_of
from pneumo_ros.diagnosis.search.selection import Scored, standard_error

SAME: Final = 0.1  # relative difference of selection scores that is no difference [taste]
POSSIBLE: Final = 0.05  # probability from which an effect is not excluded [taste]
# Degrees between the trajectories of two effects, nuisance parameters answered, below which they are alike [taste]
ANGLE: Final = 8.0


def ambiguity_group(problem: Problem, opinion: Opinion, finalists: Sequence[Scored]) -> tuple[str, ...]:
    """Ids in the verdict's group, the verdict's own first ("none" and "unknown" have none).

    A rival belongs to it when its own best fit does nearly what the verdict's does: its trajectory is within
    :data:`ANGLE` of it (what it fails to explain, over what there was to explain) and the selection blocks do not tell
    them apart (two standard errors, or :data:`SAME`). So does every effect that is not improbable, the likeliest first:
    beside "none" one that is barely too small to be accepted, beside "unknown" one that may be it under another law.
    """
    names = [] if opinion.verdict in ("none", "unknown") else [opinion.verdict, *_alike(problem, opinion, finalists)]
    possible = {name: p for name, p in opinion.names.items() if p >= POSSIBLE and name not in names}
    return (*names, *sorted(possible, key=lambda name: -possible[name]))


def _alike(problem: Problem, opinion: Opinion, finalists: Sequence[Scored]) -> list[str]:
    """Rivals of the same size that do what the verdict does."""
    chosen = opinion.chosen
    names: list[str] = []
    for rival in finalists:
        name = name_of(rival.fit.candidate)
        if name in (opinion.verdict, *names) or rival.size != chosen.size:
            continue
        undecided = rival.level - chosen.level <= max(2.0 * standard_error(rival, chosen), SAME * chosen.level)
        if undecided and angle(problem, chosen, rival) < ANGLE:
            names.append(name)
    return names


def angle(problem: Problem, chosen: Scored, rival: Scored) -> float:
    """Degrees between what the two structures add to what the nuisance parameters can do, from the rival's
    shortfall.
    """
    difference = chosen.fit.residual - rival.fit.residual
    rows = problem.fitted
    whole = float(np.sum((chosen.fit.residual[rows] - _without(problem, chosen)[rows]) ** 2))
    return float(np.degrees(np.arcsin(min(1.0, np.sqrt(np.sum(difference[rows] ** 2) / max(whole, 1e-12))))))


def _without(problem: Problem, chosen: Scored) -> np.ndarray:
    """Residual of the chosen structure with its effects taken away, the nuisance answer (linear) given."""
    from pneumo_ros.diagnosis.fit.problem import Candidate

    bare = problem.residual(Candidate(), chosen.fit.x[: problem.fixed])
    J = chosen.fit.jacobian
    if J is None:
        return np.asarray(bare)
    flat = J[:, :, : problem.fixed].reshape(-1, problem.fixed)
    change = (bare - chosen.fit.residual).ravel()
    answer = np.linalg.solve(flat.T @ flat + np.eye(problem.fixed), flat.T @ change)
    return np.asarray(chosen.fit.residual + (change - flat @ answer).reshape(bare.shape))
