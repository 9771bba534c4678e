# SPDX-License-Identifier: Apache-2.0
"""Sensor noise out of logs whose valves chatter: the loop is closed, so the command carries noise into the pressure."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers.rig_logs import DISPLACEMENT_NOISE, PRESSURE_NOISE, topics_of_channels

from pneumo_ros.control.half_car import build_controller
from pneumo_ros.control.loop import Run, close_loop
from pneumo_ros.diagnosis.half_car.signals import Signals, prepare
from pneumo_ros.diagnosis.judge.held_out import channel_gaps, noise_floor, total_gap
from pneumo_ros.diagnosis.signals.noise import white_noise
from pneumo_ros.effects.corrected_rig import diagnosed_rig
from pneumo_ros.estimation.half_car import build_estimator
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import NamedEffect, load_rig
from pneumo_ros.road import build_road
from pneumo_ros.session.rerun import close_stepped
from pneumo_ros.session.stages import ControllerStage, EstimatorStage

PERIOD, SECONDS = 2e-3, 8.0
STATED = np.array([DISPLACEMENT_NOISE] * 4 + [PRESSURE_NOISE] * 2)
CHATTERING = ("first_order_smflc", "flc", "third_order_integral_smc")


@cache
def driven(controller: str, delay: int = 0, seed: int = 2) -> Run:
    rig = load_rig()
    car, _ = nominal_half_car(rig)
    times = np.arange(round(SECONDS / PERIOD) + 1) * PERIOD
    road = build_road({"kind": "iso", "iso_class": "D", "seed": seed}, wheelbase=rig.wheelbase).sample(times)[0]
    estimator, law = build_estimator(rig, PERIOD), build_controller(rig, PERIOD, {"controller": controller})
    return close_loop(car, rig, estimator, law, road, seed=seed, delay=delay)


def signals(run: Run) -> Signals:
    count = len(run.measurements)
    return prepare(topics_of_channels(run.measurements, run.road[:count], run.commands), load_rig())


@pytest.mark.parametrize("controller", ["passive", *CHATTERING])
@pytest.mark.parametrize("delay", [0, 4])
def test_a_closed_loop_tells_the_sensors_noise(controller: str, delay: int) -> None:
    """Commands that arrive 8 ms late are found as well."""
    found = signals(driven(controller, delay))
    ratio = found.noise / STATED
    assert np.all((ratio > 0.9) & (ratio < 1.3)), ratio
    assert not any(limit.code == "noise_differs" for limit in found.limitations)


@pytest.mark.parametrize("late", [0.015, 0.0075, 0.022])
def test_commands_late_by_part_of_a_sample_leave_the_sensors_noise(late: float) -> None:
    """A session on a rig whose valves are 15 ms late: its noise was 15 to 30 % too high, and the gap of the rig as
    diagnosed lay below it."""
    nominal = load_rig()
    rig = replace(nominal, effects=(NamedEffect("transport_delay", "both", (("delay", late),)),))
    times = np.arange(round(SECONDS / PERIOD) + 1) * PERIOD
    road = build_road({"kind": "iso", "iso_class": "D", "seed": 2}, wheelbase=rig.wheelbase).sample(times)[0]
    stages = EstimatorStage(nominal, PERIOD, {}), ControllerStage(nominal, PERIOD, {})
    noise = np.random.default_rng(2).standard_normal((len(road), 6)) * STATED
    channels, commands = close_stepped(diagnosed_rig(rig, PERIOD), stages, road, noise)
    count = len(commands)
    found = prepare(topics_of_channels(channels[:count], road[:count], commands), nominal)
    ratio = found.noise / STATED
    assert np.all((ratio > 0.9) & (ratio < 1.1)), ratio


def test_the_loop_would_deceive_differences_alone() -> None:
    """What the regression on the command is for: without it the rear pressure's noise is several times too high."""
    run = driven("first_order_smflc")
    rear, whole = run.measurements[:, 5], np.ones(len(run.measurements))
    assert white_noise(rear, whole) > 3.0 * PRESSURE_NOISE
    assert white_noise(rear, whole, run.commands[:, [1, 3]]) < 1.1 * PRESSURE_NOISE


@pytest.mark.parametrize("controller", CHATTERING)
def test_no_gap_lies_below_the_floor(controller: str) -> None:
    """The true motion leaves the noise and nothing else: a floor above that gap is an error of ours."""
    run = driven(controller)
    found = signals(run)
    states = run.states[: len(run.measurements)]
    rig = load_rig()
    true = np.column_stack([
        states[:, 0] + rig.front_arm.value * states[:, 1], states[:, 0] - rig.rear_arm.value * states[:, 1],
        states[:, 2], states[:, 3], states[:, 8], states[:, 9],
    ])  # fmt: skip
    left, floor = channel_gaps(found, true[: len(found.measured)]), noise_floor(found)
    assert np.all(floor < 1.3 * left) and total_gap(floor) < 1.1 * total_gap(left)


def test_a_drive_that_explains_nothing_changes_nothing() -> None:
    rng = np.random.default_rng(4)
    smooth = np.sin(np.arange(4000) * 0.02)
    values, whole = smooth + 1e-3 * rng.normal(size=4000), np.ones(4000)
    assert white_noise(values, whole, rng.normal(size=(4000, 2))) == white_noise(values, whole)


def test_a_gap_in_the_channel_is_left_out() -> None:
    run = driven("first_order_smflc")
    rear, whole = run.measurements[:, 5].copy(), np.ones(len(run.measurements))
    rear[1000:1400], whole[1000:1400] = 0.0, 0.0
    assert white_noise(rear, whole, run.commands[:, [1, 3]]) == pytest.approx(PRESSURE_NOISE, rel=0.1)
