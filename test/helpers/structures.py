# SPDX-License-Identifier: Apache-2.0
"""Structures with scores as a test wants them, without a fit."""

from __future__ import annotations

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Candidate
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.diagnosis.search.selection import Scored

REFIT_UNKNOWNS = 30  # tolerances and initial states that every structure has


def scored(level: float, cost: float, *effects: str, unknowns: int = REFIT_UNKNOWNS, site: str = "front") -> Scored:
    """Effects at one site that leave ``level`` of fitted and kept blocks, and need so many unknowns in all."""
    candidate = Candidate(tuple((name, site) for name in effects))
    blocks = level * np.array([0.9, 1.0, 1.1, 1.0])
    fit = Fit(candidate, np.zeros(unknowns), cost, np.zeros((1, 6)))
    return Scored(fit, level, blocks, 10.0, fitted=level, unknowns=unknowns - REFIT_UNKNOWNS)
