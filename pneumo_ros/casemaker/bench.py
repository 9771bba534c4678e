# SPDX-License-Identifier: Apache-2.0
"""What every case shares: the nominal rig, its plant, and the ruler by which effects are sized."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.casemaker.gap_size import NUISANCE, refit
from pneumo_ros.casemaker.scene import Session, observation
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import Rig, load_rig

Logs = NDArray[np.float64]
SEARCH_STEP = 0.5e-3  # s, of the richer rig while a size is searched
RULER_STEP = 1e-3  # s: RK4 then errs by less than a third of the sensor noise, on both sides of the ratio


@dataclass(frozen=True)
class Bench:
    """What every case shares: the nominal rig and its plant, the ruler of the grades."""

    nominal: Rig
    car: HalfCar
    references: tuple[float, float]


def bench() -> Bench:
    """The nominal rig that ships with the package."""
    nominal = load_rig()
    car, trim = nominal_half_car(nominal)
    return Bench(nominal, replace(car, step=RULER_STEP), trim.pressures)


def refitted(session: Session, on: Bench, start: Logs | None = None) -> tuple[float, Logs]:
    """What the nominal structure leaves after the refit, and the refit's parameters; infinite if the rig ran away."""
    seen = observation(session, on.nominal)
    if not np.isfinite(seen.measured).all():
        return math.inf, np.zeros(len(NUISANCE))
    return refit(on.car, seen, start)
