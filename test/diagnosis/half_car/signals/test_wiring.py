# SPDX-License-Identifier: Apache-2.0
"""Mistakes of wiring and clocks are said by name, and what effects do is none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from helpers.own_logs import log

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.signals import MEASURED, Signals
from pneumo_ros.diagnosis.half_car.signals.wiring import check_wiring
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.rig import load_rig

MODEL = RigModel(load_rig())
SOUND = log(MODEL, 3)


def with_columns(one: Signals, change: Callable[[Array], None]) -> Signals:
    """The log with other measurements, its first state estimated from them."""
    measured = one.measured.copy()
    change(measured)
    return replace(one, measured=measured).slice(0, len(measured))


def turned(measured: Array) -> None:
    measured[:, MEASURED.index("sprung_rear")] *= -1.0


def turned_about_its_middle(measured: Array) -> None:
    column = measured[:, MEASURED.index("unsprung_front")]
    column[:] = 2.0 * column.mean() - column


def exchanged(one: str, other: str) -> Callable[[Array], None]:
    def change(measured: Array) -> None:
        pair = [MEASURED.index(one), MEASURED.index(other)]
        measured[:, pair] = measured[:, pair[::-1]]

    return change


def gauge(measured: Array) -> None:
    measured[:, MEASURED.index("front_pressure")] -= 101325.0


def late_pressure(measured: Array) -> None:
    column = measured[:, MEASURED.index("rear_pressure")]
    column[100:] = column[:-100].copy()


@pytest.mark.parametrize(
    ("change", "code", "word", "cap"),
    [
        (turned, "turned", "sprung_rear", 0.0),
        (turned_about_its_middle, "turned", "unsprung_front", 0.0),
        (exchanged("sprung_front", "sprung_rear"), "exchanged", "sprung_front and sprung_rear", 0.0),
        (exchanged("sprung_rear", "unsprung_rear"), "exchanged", "sprung_rear and unsprung_rear", 0.0),
        (exchanged("front_pressure", "rear_pressure"), "exchanged", "front_pressure and rear_pressure", 0.0),
        (gauge, "maybe_gauge", "front_pressure", 0.5),
        (late_pressure, "maybe_clock", "/rig/rear/pressure is near the model with stamps 200 ms earlier", 0.5),
    ],
)
def test_a_mistake_is_named(change: Callable[[Array], None], code: str, word: str, cap: float) -> None:
    (found,) = check_wiring(with_columns(SOUND, change), MODEL.simulate)
    assert (found.code, found.cap) == (code, cap) and word in found.text


@pytest.mark.parametrize(("rows", "word"), [(100, "200 ms earlier: its clock is late"), (-100, "200 ms later")])
def test_commands_with_other_stamps_are_named(rows: int, word: str) -> None:
    at = np.clip(np.arange(len(SOUND.commands)) - rows, 0, len(SOUND.commands) - 1)
    (found,) = check_wiring(replace(SOUND, commands=SOUND.commands[at]), MODEL.simulate)
    assert found.code == "maybe_clock" and found.text.startswith("/valve/command") and word in found.text


@pytest.mark.slow
def test_no_effect_of_the_library_is_a_mistake_of_wiring() -> None:
    assert check_wiring(SOUND, MODEL.simulate) == []
    for name, effect in MODEL.effects.items():
        if "." not in name:
            for site in effect.sites:
                values = tuple(3.0 * p.typical if p.size else p.typical for p in effect.parameters)
                values = tuple(min(max(v, p.low), p.high) for v, p in zip(values, effect.parameters, strict=True))
                one = log(MODEL, 4, active=(Active(name, site, values),))
                assert check_wiring(one, MODEL.simulate) == [], (name, site)


def test_a_missing_channel_is_no_mistake() -> None:
    weight = SOUND.weight.copy()
    weight[:, [0, 4]] = 0.0
    assert check_wiring(replace(SOUND, weight=weight), MODEL.simulate) == []
