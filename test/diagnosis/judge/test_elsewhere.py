# SPDX-License-Identifier: Apache-2.0
"""What looks alike comes from elsewhere: names are held against whatever may act at body, struts, ground and air."""

from __future__ import annotations

import math

import numpy as np
import pytest
from helpers.own_logs import drawn, log

from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.solver import fit
from pneumo_ros.diagnosis.judge.closable import Closable, EffectEvidence, closable, exchanges
from pneumo_ros.diagnosis.judge.held_out import total_floor
from pneumo_ros.diagnosis.judge.verdict import Calibration, HeldOutGaps, credit
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.rig import load_rig

BELLOWS = ("bellows_mode", "both")
FREQUENCY = 5.9  # Hz, of all three
RESONANCE = (0.15, FREQUENCY, 0.08, 0.5)


@pytest.fixture(scope="module")
def model() -> RigModel:
    return RigModel(load_rig())


def called(
    model: RigModel, truth: Active, names: tuple[Part, ...], start: tuple[float, ...], refit: float = 0.0
) -> Closable:
    """What is closable beside and instead of named effects, fitted from ``start`` to a rig that has ``truth``; with no
    gap of the refit whatever the structure leaves is much.
    """
    nuisance = drawn(model, 8)
    records = [log(model, seed, nuisance, (truth,)) for seed in (1, 2)]
    problem = Problem(model, (records[0],))
    candidate = Candidate(names)
    x = problem.start(candidate, np.zeros(problem.fixed), list(start))
    best = fit(problem, candidate, x, rows=np.ones(len(problem.measured), dtype=bool), iterations=20)
    return closable(problem, best, best, records[1], total_floor(records[1]), refit, [])


def likely(found: Closable, one: EffectEvidence | None = None) -> float:
    return credit(one or found.effects[0], HeldOutGaps(10.0, max(1.0, math.sqrt(found.own))), Calibration())


@pytest.mark.slow
@pytest.mark.parametrize(
    "truth, place",
    [
        (Active("anything.body", "", (5.5, FREQUENCY, 0.05, 0.4, 0.0, 5.5)), "body_heave"),
        (Active("anything.ground", "", (0.03, FREQUENCY, 0.08, 1500.0)), "road_input"),
    ],
    ids=["body", "ground"],
)
def test_what_rings_elsewhere_takes_the_name(model: RigModel, truth: Active, place: str) -> None:
    found = called(model, truth, (BELLOWS,), RESONANCE)
    assert found.remainders[0].places == (place,)
    assert found.effects[0].instead < 0.5 and found.effects[0].beside < 0.2
    assert likely(found) < 0.05
    rest = found.remainders[0]
    assert rest.fit.candidate.parts == rest.parts  # in its place, not beside it
    assert found.in_stead(4.0 * rest.gap) == [(place, pytest.approx(0.75))]


@pytest.mark.slow
def test_a_resonance_of_the_bellows_keeps_its_name(model: RigModel) -> None:
    found = called(model, Active("bellows_mode", "both", (0.4, FREQUENCY, 0.08, 0.5)), (BELLOWS,), RESONANCE)
    assert likely(found) > 0.9
    assert found.in_stead(1.0) == []


def icing(model: RigModel, share: float) -> tuple[float, ...]:
    """Atoms of a spring's air of which one is not zero: an outlet that closes within some seconds."""
    names = [p.name for p in model.effects["anything.air"].parameters]
    return tuple(share if name == "later outlet 3 s" else 0.0 for name in names)


@pytest.mark.slow
def test_a_bar_between_the_struts_is_no_stop(model: RigModel) -> None:
    stop = model.effects["bump_stop"].parameters
    found = called(model, Active("anything.bar", "", (3000.0, 0.0)), (("bump_stop", "both"),),
                   tuple(p.typical for p in stop))  # fmt: skip
    assert found.remainders[0].places == ("body_pitch",)
    assert likely(found) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("site, places", [("rear_pressure", ("rear_air",)), ("both", ("front_air", "rear_air"))])
def test_an_outlet_that_ices_is_no_sensor_that_is_off(model: RigModel, site: str, places: tuple[str, ...]) -> None:
    at = "rear" if site == "rear_pressure" else "both"
    found = called(model, Active("anything.air", at, icing(model, -0.05)), (("pressure_offset", site),), (2e3,))
    assert found.remainders[0].places == places
    assert likely(found) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("name", ["heat_transfer", "leak"])
def test_air_between_the_springs_is_no_loss_of_either(model: RigModel, name: str) -> None:
    start = tuple(p.typical for p in model.effects[name].parameters)
    found = called(model, Active("anything.pipe", "", (2e-7, 0.0)), ((name, "both"),), start)
    assert found.remainders[0].places == ("front_air", "rear_air")
    assert found.remainders[0].parts == (("anything.pipe", ""),)
    assert likely(found) < 0.05


@pytest.mark.slow
def test_an_outlet_that_ices_is_no_leak_with_heat(model: RigModel) -> None:
    names = ("leak", "rear"), ("heat_transfer", "rear")
    start = tuple(p.typical for name, _ in names for p in model.effects[name].parameters)
    found = called(model, Active("anything.air", "rear", icing(model, -0.05)), names, start)
    rest = found.remainders[0]
    assert rest.places == ("rear_air",) and rest.parts == (("anything.later", "rear"),)
    assert [likely(found, one) < 0.1 for one in found.effects] == [True, True]


@pytest.mark.slow
def test_a_leak_keeps_its_name_beside_air_between_the_springs(model: RigModel) -> None:
    name = ("leak", "both")
    assert likely(called(model, Active(*name, (3e-7, 0.5)), (name,), (2e-7, 0.6))) > 0.9


@pytest.mark.slow
def test_a_sensor_that_is_off_keeps_its_name(model: RigModel) -> None:
    name = ("pressure_offset", "rear_pressure")
    assert likely(called(model, Active(*name, (4e3,)), (name,), (2e3,))) > 0.9


@pytest.mark.slow
def test_what_two_names_share_between_them_is_exchanged_whole(model: RigModel) -> None:
    """A bar between the struts as a stop with an error of an area: the one bears what the other is denied."""
    truth = Active("anything.bar", "", (3000.0, 0.0))
    names = ("bump_stop", "both"), ("effective_area_error", "both")
    found = called(model, truth, names, tuple(p.typical for name, _ in names for p in model.effects[name].parameters))
    rest = found.remainders[0]
    assert rest.places == ("body_pitch",) and not rest.fit.candidate.laws
    assert [likely(found, one) < 0.1 for one in found.effects] == [True, True]


def test_effects_are_exchanged_alone_and_all_that_one_place_may_stand_for() -> None:
    stop, area, offset = ("bump_stop", "front"), ("effective_area_error", "front"), ("pressure_offset", "rear_pressure")
    body, air = ("body_heave",), ("rear_air",)
    asked = exchanges({stop: [body], area: [body], offset: [air], ("leak", "front"): []})
    assert asked == [((stop,), body), ((area,), body), ((offset,), air), ((stop, area), body)]


def test_another_place_is_asked_only_where_much_is_left(model: RigModel) -> None:
    truth = Active("anything.bar", "", (300.0, 0.0))
    start = tuple(p.typical for p in model.effects["bump_stop"].parameters)
    asked, not_asked = (called(model, truth, (("bump_stop", "both"),), start, refit) for refit in (0.0, 1e3))
    assert ("body_pitch",) in {one.places for one in asked.remainders}
    assert ("body_pitch",) not in {one.places for one in not_asked.remainders}
