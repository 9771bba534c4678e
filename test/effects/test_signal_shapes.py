# SPDX-License-Identifier: Apache-2.0
"""Shapes of signals: a zero that creeps, a follower that is slow in its own way."""

from __future__ import annotations

import numpy as np
import pytest

from pneumo_ros.effects.contract import Ends, Inputs
from pneumo_ros.effects.hooks import Air, Strut, Tyre
from pneumo_ros.effects.shapes import air
from pneumo_ros.effects.shapes.families import SHAPES
from pneumo_ros.effects.shapes.signals import CORNERS, CREEPS, EXCITER_LAGS
from pneumo_ros.plant.air_spring import MEAN_AREA
from pneumo_ros.units import GAS_CONSTANT

PERIOD = 2e-3  # s
ROWS = 4000


def test_a_zero_creeps_from_where_the_log_began_whatever_the_blocks() -> None:
    hook = SHAPES["lvdt_offset.shape"].outputs
    assert hook is not None
    values = (0.0, 2e-3, -1e-3, 0.0)
    whole, _ = hook(np.zeros((ROWS, 6)), PERIOD, (2,), values, None)
    first, memory = hook(np.zeros((1700, 6)), PERIOD, (2,), values, None)
    nothing, memory = hook(np.zeros((0, 6)), PERIOD, (2,), values, memory)
    second, _ = hook(np.zeros((ROWS - 1700, 6)), PERIOD, (2,), values, memory)
    assert np.array_equal(np.vstack([first, nothing, second])[:, 2], whole[:, 2])
    time = PERIOD * np.arange(ROWS)
    wanted = 2e-3 * (1.0 - np.exp(-time / CREEPS[1])) - 1e-3 * (1.0 - np.exp(-time / CREEPS[2]))
    assert np.allclose(whole[:, 2], wanted, atol=1e-12) and whole[0, 2] == 0.0
    assert not whole[:, [0, 1, 3, 4, 5]].any()


def road_after(road: np.ndarray, slew: float, rising: float, falling: float) -> np.ndarray:
    """The front's road (m) behind a follower alone."""
    hook = SHAPES["exciter_lag.shape"].inputs
    assert hook is not None
    values = (0.0, *([0.0] * len(EXCITER_LAGS)), 1.0, slew, rising, falling)
    given = Inputs(np.zeros((len(road), 4)), np.column_stack([road, road]))
    after, _ = hook(given, PERIOD, Ends(True, False), values, None)
    assert np.array_equal(after.road[:, 1], road), "the other end follows as before"
    return after.road[:, 0]


def test_a_follower_has_a_lag_each_way_and_a_rate_limit() -> None:
    step = np.r_[np.zeros(1), np.full(ROWS - 1, 0.01)]
    up, down = road_after(step, 1e3, 0.05, 0.2), road_after(0.01 - step, 1e3, 0.05, 0.2)
    time = PERIOD * np.arange(ROWS)
    assert np.allclose(up, 0.01 * (1.0 - np.exp(-time / 0.05)), atol=1e-9)
    assert np.allclose(down, 0.01 * np.exp(-time / 0.2), atol=1e-9)
    limited = road_after(step, 0.02, 1e-4, 1e-4)
    assert np.max(np.diff(limited)) == pytest.approx(0.02 * PERIOD)
    assert np.argmax(limited >= 0.0099) * PERIOD == pytest.approx(0.495, abs=2 * PERIOD)


def test_any_corner_of_a_dead_zone_may_be_as_wide_as_the_widest() -> None:
    """Of a narrow corner's zone 3.4 times is no limit that a valve has."""
    shape = SHAPES["valve_deadband.shape"]
    widest = [p.high * width for p, width in zip(shape.parameters, CORNERS, strict=False)]
    assert widest == pytest.approx([2.0 * CORNERS[-1]] * len(CORNERS))
    command, narrow = np.full((3, 4), 1e-6), CORNERS[0]
    values = (3.4, *[0.0] * (len(shape.parameters) - 1))
    assert shape.inputs is not None
    passed = shape.inputs(Inputs(command, np.zeros((4, 2))), 2e-3, Ends(True, False), values, None)[0].commands
    assert passed[:, 0] == pytest.approx(1e-6 - 3.4 * narrow)


def test_a_spool_sticks_until_its_command_is_a_band_away_then_jumps_to_it() -> None:
    command = 1e-6 + 3e-7 * np.sin(np.arange(2000) * 0.01)
    shape, band = SHAPES["valve_deadband.shape"], 1e-7
    values = tuple({"sticking": 1.0, "band": band}.get(p.name, 0.0) for p in shape.parameters)
    given = Inputs(np.tile(command[:, None], (1, 4)), np.zeros((2001, 2)))
    assert shape.inputs is not None
    whole = shape.inputs(given, 2e-3, Ends(True, False), values, None)[0].commands
    moved = np.flatnonzero(np.diff(whole[:, 0]))
    assert np.all(whole[moved + 1, 0] == command[moved + 1])  # it jumps to the command
    assert np.abs(np.diff(whole[:, 0])[moved]).min() >= band and np.abs(whole[:, 0] - command).max() < band
    assert np.array_equal(whole[:, 1:], given.commands[:, 1:])  # the other inlet and the outlets are as they were
    memory, parts = None, []
    for rows in (slice(0, 700), slice(700, 701), slice(701, 2000)):
        block, memory = shape.inputs(Inputs(given.commands[rows], given.road[rows]), 2e-3, Ends(True, False), values,
                                     memory)  # fmt: skip
        parts.append(block.commands)
    assert np.array_equal(np.concatenate(parts), whole)


def test_an_exponent_lower_by_d_takes_its_share_of_the_squeeze() -> None:
    n, volume, pressure, rate = 1.4, 3e-4, 3e5, -1e-3
    gas = Air(pressure, 0.0457, rate, volume, 293.0, 0.0, 0.0, n, 293.0, 0.0, 6e5)
    strut, tyre = (
        Strut(0.0457, rate, 2e5, MEAN_AREA, 0.0, 0.0, 0.0),
        Tyre(0.0, 0.0, 0.0, 0.0, 0.0, 0.02, 300.0, 0.0, 0.0),
    )
    p = [0.0] * len(air.ATOMS)
    p[[atom.name for atom in air.ATOMS].index("exponent 0.05 m/s")] = 0.2
    z = air.start(strut, gas, tyre, tuple(p))
    squeeze = -pressure * MEAN_AREA * rate / volume  # Pa/s for each unit of the exponent
    assert air.air(gas, z, tuple(p)) == pytest.approx(-0.2 * squeeze, rel=1e-3)


def test_an_outlet_that_ices_lets_out_less_the_longer_it_lasts() -> None:
    flow = 1e-3
    gas = Air(3e5, 0.0457, 0.0, 3e-4, 293.0, 0.0, flow, 1.4, 293.0, 0.0, 6e5)
    strut, tyre = (
        Strut(0.0457, 0.0, 2e5, MEAN_AREA, 0.0, 0.0, 0.0),
        Tyre(0.0, 0.0, 0.0, 0.0, 0.0, 0.02, 300.0, 0.0, 0.0),
    )
    p = [0.0] * len(air.ATOMS)
    p[[atom.name for atom in air.ATOMS].index("later outlet 3 s")] = -0.3
    z, seen = air.start(strut, gas, tyre, tuple(p)), []
    for step in range(3001):
        if step in (0, 3000):
            seen.append(air.air(gas, z, tuple(p)) * gas.volume / (1.4 * GAS_CONSTANT * 293.0) / flow)
        z = air.advance(z, strut, gas, tyre, 1e-3, tuple(p))
    assert seen == pytest.approx([0.0, 0.3 * (1.0 - np.exp(-1.0))], abs=1e-9)  # share of the outflow that stays
