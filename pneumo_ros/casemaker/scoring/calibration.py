# SPDX-License-Identifier: Apache-2.0
"""Whether a stated probability means what it says."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.casemaker.scoring.metrics import Case

BINS = 10


@dataclass(frozen=True)
class Bin:
    """One bar of the reliability plot: mean stated probability, share right, count."""

    stated: float
    right: float
    count: int


def reliability(cases: Sequence[Case]) -> list[Bin]:
    """Ten bins of equal width over the stated probability of the verdict; empty ones are left out."""
    stated, right = _pairs(cases)
    where = np.minimum((stated * BINS).astype(int), BINS - 1)
    return [
        Bin(float(stated[where == b].mean()), float(right[where == b].mean()), int((where == b).sum()))
        for b in range(BINS)
        if (where == b).any()
    ]


def expected_error(cases: Sequence[Case]) -> float:
    """Expected calibration error: mean |stated - right| over the bins, weighted by count."""
    bins = reliability(cases)
    total = sum(b.count for b in bins)
    return sum(b.count * abs(b.stated - b.right) for b in bins) / total if total else math.nan


def risk_coverage(cases: Sequence[Case]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Coverage and share of errors when only the most certain verdicts are taken."""
    stated, right = _pairs(cases)
    order = np.argsort(-stated, kind="stable")
    wrong = np.cumsum(1.0 - right[order])
    count = np.arange(1, len(order) + 1)
    return count / max(len(order), 1), wrong / count


def _pairs(cases: Sequence[Case]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    stated = np.array([min(max(c.found.probability, 0.0), 1.0) for c in cases])
    return stated, np.array([float(c.right) for c in cases])
