# SPDX-License-Identifier: Apache-2.0
"""The linear refit with bounds: what a structure leaves once the rig's tolerances have taken their share.

The sensitivities of the contract's plant serve every structure of a case, so that all its subsets of effects cost one
simulation each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from pneumo_ros.casemaker.gap_size import DECIMATE, NUISANCE, Null, Observation, free_run, perturbed, quick_gap
from pneumo_ros.plant.half_car import HalfCar

SIGMA = np.array([s for _, _, s in NUISANCE])
WIDEST = 3.0  # sigma
Logs = NDArray[np.float64]


@dataclass(frozen=True)
class Sensitivities:
    """Of one log, per sigma of each tolerance, in channel stds: (rows, 16); ``scale`` (6,) are those stds."""

    jacobian: Logs
    scale: Logs


def sensitivities(car: HalfCar, seen: Observation, logs: Logs) -> Sensitivities:
    """Central differences about ``logs``."""
    scale = np.std(seen.measured, axis=0)
    columns = []
    for i, width in enumerate(SIGMA):
        step = np.zeros(len(SIGMA))
        step[i] = 0.1 * width
        change = free_run(perturbed(car, logs + step), seen) - free_run(perturbed(car, logs - step), seen)
        columns.append((change[::DECIMATE] / scale / 0.2).ravel())
    return Sensitivities(np.column_stack(columns), scale)


def bounded_step(jacobian: Logs, error: Logs, at: Logs, prior: float) -> Logs:
    """Step in sigmas that leaves least of ``error``, no parameter beyond three sigma; ``prior`` as in the refit."""
    normal = jacobian.T @ jacobian + prior**2 * np.eye(len(at))
    root = np.linalg.cholesky(normal)
    wanted = np.linalg.solve(root, jacobian.T @ error - prior**2 * at)
    low, high = -WIDEST - np.maximum(at, -WIDEST), WIDEST - np.minimum(at, WIDEST)
    return np.asarray(lsq_linear(root.T, wanted, (low - 1e-9, high + 1e-9), method="bvls").x)


def bounded_gap(car: HalfCar, seen: Observation, null: Null) -> float:
    """What :func:`pneumo_ros.casemaker.gap_size.refit` would leave about, from the sensitivities without the effect."""
    return quick_gap(car, seen, null, bounded_step)
