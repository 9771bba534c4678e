# SPDX-License-Identifier: Apache-2.0
"""Logs that begin on a rough road: the first state is known less well than the noise has it, and is found."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from helpers.rig_logs import RATE, noisy, simulated, write_log
from typer.testing import CliRunner

from pneumo_ros.arrays import Array
from pneumo_ros.cli.diagnose import app
from pneumo_ros.diagnosis.half_car.signals import read_signals
from pneumo_ros.diagnosis.judge.held_out import free_run
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig

OPEN = 1.0  # s, then the valves shut: what the air misses then is never mended by a flow


def shut(seconds: float) -> tuple[Array, Array, Array]:
    """(channels, road, openings) of the nominal rig whose valves a driver shut after a second, as after a trip."""
    rig = load_rig()
    _, road, commands = simulated(seconds, 3)
    commands = np.where((np.arange(len(commands)) / RATE < OPEN)[:, None], commands, 0.0)
    car, trim = nominal_half_car(rig)
    states = car.simulate(trim.state, commands[:-1], road, 1.0 / RATE)
    ends = [states[:, 0] + rig.front_arm.value * states[:, 1], states[:, 0] - rig.rear_arm.value * states[:, 1]]
    return np.column_stack([*ends, states[:, 2], states[:, 3], states[:, 8], states[:, 9]]), road, commands


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    channels, road, commands = shut(12.0)
    path = tmp_path_factory.mktemp("shut") / "shut.mcap"
    return write_log(path, noisy(channels, 3), road, commands, [load_rig().to_yaml()])


def test_a_piece_that_begins_in_motion_is_predicted_to_the_noise(log: Path) -> None:
    """Sixty milliseconds of a wheel on a class D road are no cubic; its miss must not bind the start."""
    signals, model = read_signals(log), RigModel(load_rig())
    nominal = np.array([p.nominal for p in model.parameters])
    for begin in (2.0, 4.5, 7.0):
        piece = signals.slice(round(begin * RATE), round((begin + 4.0) * RATE))
        error = (free_run(model, piece, nominal, ()) - piece.measured) / piece.noise
        assert float(np.sqrt(np.mean(error**2))) < 1.3, begin


@pytest.mark.slow
def test_shut_valves_on_a_rough_road_are_no_effect(log: Path, tmp_path: Path) -> None:
    """A session that tripped after a second: the rest of its log is of the nominal rig, and is read as that."""
    done = CliRunner().invoke(app, [str(log), "-o", str(tmp_path / "out")], env={"COLUMNS": "80"})
    assert done.exit_code == 0, done.output
    said = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert said["verdict"] == "none" and said["gap"]["refit"] < 1.3 * said["gap"]["noise_floor"]
    assert "none (nothing to name)" in done.output
