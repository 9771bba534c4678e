# SPDX-License-Identifier: Apache-2.0
"""A part that swings against the ground: what its plates feel is its momentum, and its weight."""

from __future__ import annotations

import math

import pytest

from pneumo_ros.effects.hooks import Air, Strut, Tyre
from pneumo_ros.effects.shapes import mode

STEP = 1e-4  # s
AIR = Air(*([1e5] * 11))


def strut_at(middle: float, rate: float) -> Strut:
    return Strut(0.045, 0.0, 2e5, 5e-3, 1e3, middle, rate)


def on_both(middle: float, rate: float, z: tuple[float, float], p: mode.Values) -> tuple[float, float]:
    """N upwards on body and axle: a strut pushes them apart, a tyre lifts the axle alone."""
    strut = mode.force(strut_at(middle, rate), z, p)
    return strut, mode.tyre(Tyre(0.0, 0.0, 0.0, middle, rate, 0.02, 300.0, 0.0, 0.0), z, p) - strut


def test_at_rest_each_plate_carries_half_of_the_weight() -> None:
    assert on_both(0.1, 0.0, (0.1, 0.0), (0.3, 12.0, 0.05, 4.0, 0.5)) == pytest.approx((-2.0, -2.0))


@pytest.mark.parametrize("share", [0.0, 0.6])
def test_what_the_plates_feel_is_the_momentum_that_the_part_loses_but_for_the_grounds(share: float) -> None:
    p = (0.3, 12.0, 0.05, 0.0, share)
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
