# SPDX-License-Identifier: Apache-2.0
"""What this log cannot tell apart from the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.judge.verdict import Opinion, name_of
from pneumo_ros.diagnosis.search.selection import Scored, alike, standard_error

SAME: Final = 0.1  # relative difference of selection scores that is no difference [taste]
POSSIBLE: Final = 0.05  # probability from which an effect is not excluded [taste]
# Difference of log mean squares, forms of laws added, that tells nothing [calibration: set 0.4, opened]
AS_GOOD: Final = 0.3
MOST: Final = 0.8  # share of the fall of mean square that a rival must bring as well [taste]
# Degrees between the trajectories of two effects, nuisance parameters answered, below which they are alike [taste]
ANGLE: Final = 8.0


def ambiguity_group(problem: Problem, opinion: Opinion, refit: Scored, finalists: Sequence[Scored]) -> tuple[str, ...]:
    """Ids in the verdict's group, the verdict's own first ("none" and "unknown" have none).

    A rival belongs to it when its own best fit does nearly what the verdict's does: its trajectory is within
    :data:`ANGLE` of it (what it fails to explain, over what there was to explain) and the selection blocks do not tell
    them apart (two standard errors, or :data:`SAME`); or when it leaves no more than another law of the verdict's
    family might, and closes most of what that closes. So does every effect that is not improbable, the likeliest first:
    beside "none" one that is barely too small to be accepted, beside "unknown" one that may be it under another law.
    """
    told = opinion.verdict not in ("none", "unknown")
    names = [opinion.verdict, *_alike(problem, opinion, refit, finalists)] if told else []
    possible = {name: p for name, p in opinion.names.items() if p >= POSSIBLE and name not in names}
    return (*names, *sorted(possible, key=lambda name: -possible[name]))


def _alike(problem: Problem, opinion: Opinion, refit: Scored, finalists: Sequence[Scored]) -> list[str]:
    """Rivals of the same size that do what the verdict does."""
    chosen = opinion.chosen
    names: list[str] = []
    for rival in finalists:
        name = name_of(rival.fit.candidate)
        if name in (opinion.verdict, *names) or rival.size != chosen.size:
            continue
        undecided = rival.level - chosen.level <= max(2.0 * standard_error(rival, chosen), SAME * chosen.level)
        if as_good(refit, chosen, rival) or (undecided and angle(problem, chosen, rival) < ANGLE):
            names.append(name)
    return names


def as_good(refit: Scored, chosen: Scored, rival: Scored) -> bool:
    """Whether a rival leaves no more than another law of the right kind might."""
    for whole, least, left in (
        (refit.fitted, chosen.fitted, rival.fitted),
        (refit.level, chosen.level, rival.level),
    ):
        form = alike(whole)
        if np.log((form + left) / (form + least)) > AS_GOOD or whole - left < MOST * (whole - least):
            return False
    return True


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
