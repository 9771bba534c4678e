# SPDX-License-Identifier: Apache-2.0
"""Logs of a rig model itself, with effects that are known: what a diagnosis of them must find."""

from __future__ import annotations

import numpy as np

from helpers.rig_logs import excitation, signals_of, simulated
from pneumo_ros.diagnosis.half_car.signals import Signals
from pneumo_ros.diagnosis.search.state import Effort
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.trim import trim

QUICK = Effort(singles=5, finalists=3, seconds=(2,), blind_pairs=1, pair_finalists=2)


def drawn(model: RigModel, seed: int, spread: float = 1.0) -> np.ndarray:
    """Nuisance values inside the tolerances."""
    rng = np.random.default_rng(seed)
    sigmas = np.clip(rng.normal(size=len(model.parameters)), -2.0, 2.0) * spread
    return np.array([p.nominal + p.std * s for p, s in zip(model.parameters, sigmas, strict=True)])


def log(model: RigModel, seed: int, nuisance: np.ndarray | None = None, active: tuple[Active, ...] = ()) -> Signals:
    """A log of the model itself, from rest at the nominal trim, with sensor noise."""
    road, commands = excitation(6.0, seed)
    inputs = driven(road, commands)
    clean = model.simulate(inputs, nuisance, trim(model.rig).state, active)
    return signals_of(clean, road, commands, seed, f"log-{seed}")


def driven(road: np.ndarray, commands: np.ndarray) -> Signals:
    """Inputs alone, the sensors still at rest."""
    return signals_of(np.tile(simulated(0.1, 1)[0][0], (len(road), 1)), road, commands)
