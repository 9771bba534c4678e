# SPDX-License-Identifier: Apache-2.0
"""A part that swings against the ground: what its plates feel is its momentum, and its weight."""

from __future__ import annotations

import math

import numpy as np
import pytest
from helpers.rig_logs import signals_of, simulated

from pneumo_ros.effects.hooks import Air, Strut, Tyre
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.effects.shapes import mode
from pneumo_ros.rig import load_rig

STEP = 1e-4  # s
AIR = Air(*([1e5] * 11))


def strut_at(middle: float, rate: float) -> Strut:
    return Strut(0.045, 0.0, 2e5, 5e-3, 1e3, middle, rate)


def on_both(middle: float, rate: float, z: tuple[float, float], p: mode.Values) -> tuple[float, float]:
    """N upwards on body and axle: a strut pushes them apart, a tyre lifts the axle alone."""
    strut = mode.force(strut_at(middle, rate), z, p)
    return strut, mode.tyre(Tyre(0.0, 0.0, 0.0, middle, rate, 0.02, 300.0, 0.0, 0.0), z, p) - strut


def test_at_rest_each_plate_carries_half_of_the_weight() -> None:
    assert on_both(0.1, 0.0, (0.1, 0.0), (0.3, 12.0, 0.05, 4.0, 0.5, 1.0, 0.0)) == pytest.approx((-2.0, -2.0))


@pytest.mark.parametrize("share", [0.0, 0.6])
def test_what_the_plates_feel_is_the_momentum_that_the_part_loses_but_for_the_grounds(share: float) -> None:
    p = (0.3, 12.0, 0.05, 0.0, share, 1.0, 0.0)
    tyre = Tyre(0.0, 0.0, 0.0, 0.0, 0.0, 0.02, 300.0, 0.0, 0.0)
    shaken = 2.0 * math.pi * 4.0  # rad/s
    before, impulse = 0.01 * shaken, 0.0
    z = first = mode.start(strut_at(0.0, before), AIR, tyre, p)
    for i in range(4700):
        middle, rate = 0.01 * math.sin(shaken * i * STEP), 0.01 * shaken * math.cos(shaken * i * STEP)
        later = mode.advance(z, strut_at(middle, rate), AIR, tyre, STEP, p)
        body, axle = on_both(middle, rate, (0.5 * (z[0] + later[0]), 0.5 * (z[1] + later[1])), p)  # half a step apart
        z = later
        assert body == pytest.approx(axle)
        impulse += (body + axle) * STEP
    ground = 2.0 * p[2] * (2.0 * math.pi * p[1]) * share * (z[0] - first[0])
    assert abs(z[1] - before) > 0.03 and abs(ground) >= 0.05 * share  # or nothing was asked
    assert impulse == pytest.approx(-p[0] * (z[1] - before + ground), rel=0.02)


def test_inside_the_strut_and_on_a_constant_spring_it_is_the_librarys_law() -> None:
    log, model = signals_of(*simulated(seconds=3.0)), RigModel(load_rig())
    law = Active("bellows_mode", "front", (0.3, 9.0, 0.06, 0.4))
    shape = Active("bellows_mode.shape", "front", (0.3, 9.0, 0.06, 0.0, 0.4, 0.0, 0.0))
    bare, one, other = (model.simulate(log, active=active) for active in ((), (law,), (shape,)))
    moved = np.abs(one - bare).max(axis=0)
    assert np.all(moved[:4] > 1e-5) and np.all(np.abs(one - other).max(axis=0) < 1e-6 * moved)


@pytest.mark.parametrize("size, stiffening", [(1e-3, 1e5), (2e-3, 5e4)])
def test_a_spring_that_stiffens_rings_faster_the_farther_it_swings(size: float, stiffening: float) -> None:
    """Duffing: w^2 (1 + 3/4 s a^2) for a swing of a, to the first order."""
    p = (0.3, 10.0, 1e-9, 0.0, 0.0, 0.0, stiffening)
    strut, tyre = Strut(0.045, 0.0, 2e5, 5e-3, 1e3, 0.0, 0.0), Tyre(0.0, 0.0, 0.0, 0.0, 0.0, 0.02, 300.0, 0.0, 0.0)
    z, crossings = (0.045 + size, 0.0), []
    for i in range(20000):
        later = mode.advance(z, strut, AIR, tyre, STEP, p)
        if z[0] < 0.045 <= later[0]:
            crossings.append((i + (0.045 - z[0]) / (later[0] - z[0])) * STEP)
        z = later
    rings = (len(crossings) - 1) / (crossings[-1] - crossings[0])
    assert rings == pytest.approx(10.0 * math.sqrt(1.0 + 0.75 * stiffening * size**2), rel=2e-3)


def test_what_hangs_between_ground_and_strut_does_no_work_of_its_own() -> None:
    """Virtual work: the forces on both plates times their motion are the pull times that of what it hangs on."""
    p, z = (0.3, 12.0, 0.05, 0.0, 0.5, 0.3, 4e4), (0.02, 0.1)
    top, axle = 0.07, 0.03
    strut = Strut(top - axle, 0.0, 2e5, 5e-3, 1e3, 0.5 * (top + axle), 0.0)
    tyre = Tyre(0.0, 0.0, 0.0, 0.5 * (top + axle), 0.0, 0.02, 300.0, 0.0, 0.0, top - axle, 0.0)
    body = mode.force(strut, z, p)
    on_axle = mode.tyre(tyre, z, p) - body
    up, down = 2e-3, -1e-3  # m, of body and axle
    along = (1.0 - p[5]) * (up - down) + p[5] * 0.5 * (up + down)
    at = (1.0 - p[5]) * (top - axle) + p[5] * 0.5 * (top + axle) - z[0]
    w = 2.0 * math.pi * p[1]
    pull = p[0] * (w * w * at * (1.0 + p[6] * at * at) - 2.0 * p[2] * w * (1.0 - p[4]) * z[1])
    assert body * up + on_axle * down == pytest.approx(-pull * along)
