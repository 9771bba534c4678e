# SPDX-License-Identifier: Apache-2.0
"""Laws and atoms at slots: what they say by hand, and that nothing is missing from a ceiling."""

from __future__ import annotations

import numpy as np
import pytest

from pneumo_ros.effects.guide import displayed
from pneumo_ros.effects.loading import laws_of, load_library
from pneumo_ros.effects.parameters import family_of
from pneumo_ros.effects.sheet import check_words
from pneumo_ros.slots import Contact, Flow, Force, Input, Sensor
from pneumo_ros.slots import force as fo
from pneumo_ros.slots import signal as si
from pneumo_ros.slots.guides import GUIDES
from pneumo_ros.slots.half_car import PARAMETERS_OF_THE_EQUATIONS, SLOT_FAMILIES
from pneumo_ros.slots.kinds import Slot
from pneumo_ros.slots.laws import LAWS, Law, Measures
from pneumo_ros.slots.library import SlotEffect, effects_of, families_of
from pneumo_ros.slots.shapes import CONES, ROWS

SCALES = fo.scales_of(np.linspace(-0.01, 0.01, 200), np.linspace(-0.1, 0.1, 200), np.zeros(200), 1.0)
MEASURES = Measures(2.0, 0.1, 0.01, -0.01, 0.01, 5.0, 1.0, 10.0, "N", "m")
KINDS: tuple[Slot, ...] = (Force("a"), Contact("b"), Flow("c"), Input("d"), Sensor("e"))


def force_at(travel: float, rate: float, **values: float) -> float:
    P, z = np.zeros(fo.VALUES), np.zeros(fo.MEMORIES)
    for name, value in values.items():
        P[getattr(fo, name)] = value
    P[fo.ATOMS_AT_WORK] = float(P[fo.LAWS : fo.ATOMS_AT_WORK].any())
    c = np.array([travel, rate, 0.0])
    fo.start(c, z, SCALES)
    return fo.force(c, z, P, SCALES)


def test_what_opposes_a_motion_is_negative_at_positive_rate() -> None:
    assert force_at(0.0, 0.1, COULOMB=3.0) == pytest.approx(-3.0)
    assert force_at(0.0, -0.1, VISCOUS=20.0) == pytest.approx(2.0)
    assert force_at(0.005, 0.0, SPRING=100.0) == pytest.approx(-0.5, abs=1e-3)
    assert force_at(0.0099, 0.0, STOP_ABOVE=1e4, STOP_ABOVE_DEPTH=0.001) == pytest.approx(-9.4, abs=1e-6)
    assert force_at(-0.0099, 0.0, STOP_BELOW=1e4, STOP_BELOW_DEPTH=0.001) == pytest.approx(9.4, abs=1e-6)


def test_backlash_takes_the_spring_away_within_its_gap_only() -> None:
    assert force_at(0.002, 0.0, BACKLASH=500.0, BACKLASH_HALF=0.004) == pytest.approx(1.0)
    assert force_at(0.009, 0.0, BACKLASH=500.0, BACKLASH_HALF=0.004) == pytest.approx(2.0)


@pytest.mark.parametrize(("size", "travel"), [("BOUC_WEN", "BOUC_WEN_TRAVEL"), ("PRESLIDING", "PRESLIDING_TRAVEL"),
                                              ("SLIDERS", "SLIDERS_TRAVEL")])  # fmt: skip
def test_hysteresis_takes_energy_whatever_the_rate(size: str, travel: str) -> None:
    """The loop's area over a cycle of travel is the same driven fast or slowly, and never given back."""

    def lost(rate: float) -> float:
        P, z = np.zeros(fo.VALUES), np.zeros(fo.MEMORIES)
        P[getattr(fo, size)], P[getattr(fo, travel)] = 2.0, 0.003
        path = 0.01 * np.sin(np.linspace(0.0, 6.0 * np.pi, 3000))
        fo.start(np.array([path[0], 0.0, 0.0]), z, SCALES)
        force = []
        for x in path:
            c = np.array([x, rate, 0.0])
            fo.advance(c, z, 1e-3, P, SCALES)
            force.append(fo.force(c, z, P, SCALES))
        return -float(np.sum(np.array(force)[1000:] * np.diff(path, prepend=0.0)[1000:]))

    assert lost(0.1) > 0.05
    assert lost(0.1) == pytest.approx(lost(10.0), rel=1e-9)


def test_friction_is_widened_only_as_far_as_a_step_needs() -> None:
    P, S = np.zeros(fo.VALUES), SCALES.copy()
    P[fo.COULOMB] = 3.0
    assert fo.steadied(P, S, 0.5, 1e-6)[1][fo.S_TURNOVER] == S[fo.S_TURNOVER]
    assert fo.steadied(P, S, 0.5, 1e-2)[1][fo.S_TURNOVER] == pytest.approx(0.015)


def test_a_signal_without_values_passes_as_it_is_and_errors_are_undone() -> None:
    u = np.sin(np.linspace(0.0, 20.0, 500))
    S, P = si.scales_of(u, 1.0), np.zeros(si.VALUES)
    assert np.array_equal(si.passed(u, 0.01, P, S), u)
    P[si.GAIN], P[si.OFFSET], P[si.SQUARE] = 0.1, 0.05, 0.03
    assert np.allclose(si.undone(si.passed(u, 0.01, P, S), P, S), u, atol=1e-4)


def test_a_late_signal_is_late_and_a_limit_limits() -> None:
    u = np.sin(np.linspace(0.0, 20.0, 2001))
    S, P = si.scales_of(u, 1.0), np.zeros(si.VALUES)
    P[si.DELAY] = 0.05
    assert np.allclose(si.passed(u, 0.01, P, S)[5:], u[:-5])
    P[:] = 0.0
    P[si.CUT] = 0.3
    assert np.abs(si.passed(u, 0.01, P, S)).max() == pytest.approx(0.7, abs=0.01)


def test_a_zero_creeps_from_where_it_stood_to_its_end() -> None:
    u = np.sin(np.linspace(0.0, 20.0, 4001))
    S, P = si.scales_of(u, 0.5), np.zeros(si.VALUES)
    P[si.CREEPS + 1] = 0.02  # in four of the slowest periods
    crept = si.passed(u, 0.01, P, S) - u
    assert crept[0] == 0.0 and crept[200] == pytest.approx(0.02 * (1.0 - np.exp(-1.0))) and crept[-1] > 0.0199
    assert np.array_equal(si.undone(u, P, S), u), "what takes time is left"


@pytest.mark.parametrize("slot", KINDS, ids=lambda s: s.kind)
def test_every_cone_lies_in_the_ceiling_of_its_slot(slot: Slot) -> None:
    effects = effects_of([slot], {slot.place: MEASURES})
    ceiling = set(effects[f"anything.{slot.kind}"].columns[slot.place])
    for family in CONES[slot.kind]:
        assert set(effects[f"{family}.shape"].columns[slot.place]) <= ceiling, family
    assert {c for row in ROWS[slot.kind] for c in row.columns()} == ceiling


@pytest.mark.parametrize("slot", KINDS, ids=lambda s: s.kind)
def test_families_can_be_kept_from_a_slot(slot: Slot) -> None:
    first, second = families_of(slot.kind)[:2]
    kept = effects_of([slot], {slot.place: MEASURES}, {slot.place: [first]})
    assert {family_of(name) for name in kept} == {first, "anything"}
    assert second in {family_of(name) for name in effects_of([slot], {slot.place: MEASURES})}


def test_laws_have_one_id_each_and_sizes_that_vanish() -> None:
    ids = [(law.id, kind) for law in LAWS for kind in law.kinds]
    assert len(set(ids)) == len(ids)
    for law in LAWS:
        assert any(knob.size for knob in law.knobs), law.id
        for knob in law.knobs:
            typical = knob.typical(MEASURES)
            assert typical > 0.0 and knob.low <= 1.0 <= knob.high, (law.id, knob.name)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.id)
def test_every_family_says_how_to_check_it_by_hand(law: Law) -> None:
    guide = GUIDES[family_of(law.id)]
    assert guide.meaning.endswith(".") and len(guide.check) > 40 and guide.names() <= {"size"}
    assert guide.mistaken_for and set(guide.mistaken_for) <= set(GUIDES) - {family_of(law.id)}
    slot = next(slot for slot in KINDS if slot.kind in law.kinds)
    effect = effects_of([slot], {slot.place: MEASURES})[law.id]
    said = check_words(effect)
    assert "{" not in said and all(word in said for word in _size_of(effect)), "the law's own value, where one is told"


def _size_of(effect: SlotEffect) -> list[str]:
    told = effect.guide is not None and effect.guide.names()
    return [displayed(effect.parameters[0].typical, effect.parameters[0].unit)] if told else []


def test_an_actuator_that_cannot_be_faster_follows_at_its_rate() -> None:
    """A step of 3 V at 2 V/s arrives after 1.5 s; what is slower passes as it is."""
    P, S = np.zeros(si.VALUES), si.scales_of(np.array([0.0, 3.0]), 1.0)
    P[si.SLOWNESS] = 0.5  # s/V
    time = np.arange(0.0, 3.0, 0.01)
    step = np.where(time > 0.0, 3.0, 0.0)
    np.testing.assert_allclose(si.passed(step, 0.01, P, S), np.minimum(2.0 * time, 3.0), atol=1e-9)
    slow = 0.3 * np.sin(2.0 * time)
    np.testing.assert_allclose(si.passed(slow, 0.01, P, S), slow, atol=1e-12)


def test_every_effect_of_the_half_car_is_a_family_at_a_slot_or_a_parameter() -> None:
    assert set(SLOT_FAMILIES) | set(PARAMETERS_OF_THE_EQUATIONS) == set(laws_of(load_library()))
    for one in SLOT_FAMILIES.values():
        assert one.family in families_of(one.kind)
