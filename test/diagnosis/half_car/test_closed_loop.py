# SPDX-License-Identifier: Apache-2.0
"""The loop around a diagnosed rig closes exactly, and a diagnosed effect changes the ride."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pneumo_ros.control.loop import measure
from pneumo_ros.diagnosis.half_car.closed_loop import rerun_diagnosed
from pneumo_ros.diagnosis.half_car.signals import Signals, read_signals
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.errors import InputError
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.session.stages import ControllerStage, EstimatorStage

ROWS, SEED = 700, 5
NOTHING = {"active": [], "nuisance": {}}
# The valves' commands arrive 30 ms late: an effect on the inputs, so no kernel has to be compiled for it.
DELAY = {"active": [{"effect": "transport_delay", "site": "both", "values": [0.03]}], "nuisance": {}}


@pytest.fixture(scope="module")
def signals(practice: Callable[[str], Path]) -> Signals:
    found = read_signals(practice("nominal-exact-fit"))
    short = {key: getattr(found, key)[:ROWS] for key in ("measured", "weight", "commands", "road")}
    _, trim = nominal_half_car(found.rig)
    return replace(found, **short, start_state=found.start_state._replace(state=np.array(trim.state)))


def step_by_step(signals: Signals, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The loop closed the plain way, one period after another: channels and commands."""
    nominal, trim = nominal_half_car(signals.rig)
    # The diagnosis integrates one step a sample.
    car = HalfCar(nominal.body, nominal.front, nominal.rear, nominal.surface, signals.period)
    estimator, controller = EstimatorStage(signals.rig, 2e-3, {}), ControllerStage(signals.rig, 2e-3, {})
    state, seen, commanded = trim.state, None, None
    channels, commands = [], []
    for i in range(ROWS):
        channels.append(measure(state, car.body) + noise[i])
        seen, estimate = estimator.step(estimator.first(channels[-1]) if seen is None else seen, channels[-1])
        before = controller.first(estimate.values) if commanded is None else commanded
        commanded, command = controller.step(before, estimate.values)
        commands.append(command.values)
        if i + 1 < ROWS:
            state = car.advance(state, commands[-1], signals.road[i : i + 2], 2e-3)
    return np.array(channels), np.array(commands)


def test_window_by_window_is_the_closed_loop(signals: Signals) -> None:
    """Without an effect, row by row what one step after another gives."""
    ours = rerun_diagnosed(signals, NOTHING, {}, {}, SEED, RigModel(signals.rig))
    noise = np.random.default_rng(SEED).standard_normal((ROWS, 6)) * signals.noise_stated
    channels, commands = step_by_step(signals, noise)
    assert np.max(np.abs(ours.channels - channels) / channels.std(axis=0)) < 1e-9
    assert np.max(np.abs(ours.command - commands)) < 1e-15


def test_a_diagnosed_delay_makes_the_ride_worse(signals: Signals) -> None:
    model = RigModel(signals.rig)
    free, late = (rerun_diagnosed(signals, d, {}, {}, SEED, model) for d in (NOTHING, DELAY))
    assert "transport_delay (both)" in late.notes[0]
    assert late.channels[:, 0].std() > 1.1 * free.channels[:, 0].std()


def test_an_unknown_effect_is_named(signals: Signals) -> None:
    with pytest.raises(InputError, match="gremlins"):
        rerun_diagnosed(signals, {"active": [{"effect": "gremlins", "site": "", "values": []}]}, {}, {})
    with pytest.raises(InputError, match="'active'"):
        rerun_diagnosed(signals, {"verdict": "leak"}, {}, {})
