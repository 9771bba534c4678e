"""A rig with effects, stepped: the numbers of the whole-log simulation, for every effect; and its file form."""

from __future__ import annotations

import numpy as np
import pytest
from rig_logs import signals_of, simulated

from pneumo_ros.gap.effects.loading import load_library
from pneumo_ros.gap.model import Active
from pneumo_ros.gap.rig_model import RigModel
from pneumo_ros.gap.signals import Signals
from pneumo_ros.gap.twin_rig import TwinRig
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import NamedEffect, load_rig

LIBRARY = load_library()
VARIANTS = [(effect.id, site) for effect in LIBRARY.values() for site in effect.sites]
LAG = NamedEffect("valve_lag", "rear", (("valve_lag", 0.015), ("valve_damping_ratio", 0.86)))
FRICTION = NamedEffect(
    "coulomb_friction", "front", (("friction_force", 6.0), ("bristle_length", 2e-4), ("stribeck_excess", 0.25))
)


@pytest.fixture(scope="module")
def model() -> RigModel:
    return RigModel(load_rig(), LIBRARY, step=1e-3)


@pytest.fixture(scope="module")
def record() -> Signals:
    """Rough enough for stops and lift-off to act."""
    channels, road, commands = simulated(2.2, 5)
    return signals_of(channels, road * [2.5, 4.0], commands, seed=5)


def typical(effect: str, site: str) -> Active:
    return Active(effect, site, tuple(p.typical for p in LIBRARY[effect].parameters))


def stepped(rig: TwinRig, record: Signals) -> np.ndarray:
    state = rig.init()
    shown = [rig.read(state)]
    for i in range(len(record.measured) - 1):
        state = rig.step(state, record.commands[i], record.road[i : i + 2])
        shown.append(rig.read(state))
    return np.array(shown)


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference over each channel's standard deviation."""
    return float(np.max(np.abs(one - other) / np.std(other, axis=0)))


@pytest.mark.parametrize(("effect", "site"), VARIANTS)
def test_stepping_gives_the_numbers_of_the_whole_log(model: RigModel, record: Signals, effect: str, site: str) -> None:
    active = (typical(effect, site),)
    start = trim(model.rig).state
    whole = model.simulate(record, initial=start, active=active)
    assert apart(stepped(TwinRig(model, record.period, None, active), record), whole) < 1e-9
    assert apart(whole, model.simulate(record, initial=start)) > 1e-4
