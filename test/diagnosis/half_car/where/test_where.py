# SPDX-License-Identifier: Apache-2.0
"""Where the gap lives: equation residuals, the smallest set of places, regimes and conditional runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.practice import labels
from helpers.rig_logs import channels_of, excitation, noisy, signals_of, simulated, topics_of_channels
from scipy.optimize import lsq_linear

from pneumo_ros.diagnosis.fit.box import box_minimum
from pneumo_ros.diagnosis.half_car.signals import MEASURED, Signals, TopicData, prepare, read_signals
from pneumo_ros.diagnosis.half_car.where import (
    Start,
    conditional_gaps,
    flexible_gain,
    locate,
    occurrence,
    place_gaps,
    predict_located,
)
from pneumo_ros.diagnosis.half_car.where.design import car_of, design_of, inputs_of, sensor_noise
from pneumo_ros.diagnosis.half_car.where.locate import corrected_residual
from pneumo_ros.diagnosis.half_car.where.path_share import explained
from pneumo_ros.diagnosis.half_car.where.regimes import bands, harmonics, regimes
from pneumo_ros.diagnosis.half_car.where.sets import best_subset, rivals, shapley, smallest
from pneumo_ros.diagnosis.half_car.where.solve import Rows, forms_of
from pneumo_ros.diagnosis.half_car.where.weak import EQUATIONS, Inputs, make_windows, weak_residuals
from pneumo_ros.effects.composition import CORRECTIONS
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig

SECONDS = 12.0


@pytest.fixture(scope="module")
def model() -> RigModel:
    return RigModel(load_rig())


def log_with(model: RigModel, active: tuple[Active, ...], seed: int) -> Signals:
    """A log of the rig with effects in it, driven by the excitation of this seed."""
    clean, road, commands = simulated(SECONDS, seed)
    carrier = signals_of(clean, road, commands, seed)
    return signals_of(model.simulate(carrier, active=active), road, commands, seed)


def test_the_nominal_rig_leaves_noise_in_every_equation(model: RigModel) -> None:
    log = log_with(model, (), 1)
    car, inputs = car_of(model), inputs_of(log)
    windows = make_windows(len(log.measured), log.period)
    level = np.sqrt(np.mean(weak_residuals(car, inputs, windows) ** 2, axis=0))
    np.testing.assert_allclose(level / sensor_noise(car, inputs, windows, log.noise), 1.0, atol=0.25)


def test_without_noise_the_residual_vanishes(model: RigModel) -> None:
    """Against the weight, tyre load and flow the equations balance: what remains is the integration of the windows."""
    clean, road, commands = simulated(6.0, 2)
    inputs = Inputs(clean, commands, road, 0.002)
    left = np.abs(weak_residuals(car_of(model), inputs, make_windows(len(clean), 0.002))).max(axis=0)
    assert np.all(left[:4] < [0.5, 0.1, 0.3, 0.3])
    assert np.all(left[4:] < 2e-5)


def test_a_residual_is_the_force_that_is_missing() -> None:
    """20 N s/m more damping at the front shows in the front axle's equation as 20 dh/dt, in newtons."""
    rig = load_rig()
    nominal, trim = nominal_half_car(rig)
    stiffer = HalfCar(nominal.body._replace(damping_front=70.0), nominal.front, nominal.rear, nominal.surface)
    road, commands = excitation(6.0, 3)
    states = stiffer.simulate(trim.state, commands[:-1], road, 0.002)
    windows = make_windows(len(states), 0.002)
    inputs = Inputs(channels_of(states, rig), commands, road, 0.002)
    residual = weak_residuals(nominal, inputs, windows)[:, EQUATIONS.index("front_axle")]
    rate = (states[:, 4] + rig.front_arm.value * states[:, 5] - states[:, 6])[windows.centres]
    slope = float(rate @ residual / (rate @ rate))
    assert slope == pytest.approx(20.0, rel=0.1)
    assert np.std(residual - slope * rate) < 0.2 * np.std(residual)


def test_box_minimum_agrees_with_a_library_solver() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        a, b = rng.normal(size=(30, 6)), rng.normal(size=30)
        reference = lsq_linear(a, b, bounds=(-0.1, 0.1)).x
        limit = np.full(6, 0.1)
        np.testing.assert_allclose(box_minimum(a.T @ a, a.T @ b, -limit, limit), reference, atol=1e-3)


def test_shares_add_up_and_equals_share_equally() -> None:
    """Fair shares sum to what all places close; two places with the same shape get the same."""
    rng = np.random.default_rng(1)
    shape, other = rng.normal(size=(2, 400))
    columns = np.column_stack([rng.normal(size=400), shape, shape, other])
    forms = forms_of(
        Rows(-3.0 * shape - other, columns, {}), Rows(-3.0 * shape - other, columns, {}), np.zeros(1), ["a", "b", "c"]
    )
    shares = shapley(forms, ["a", "b", "c"])
    assert sum(shares.values()) == pytest.approx(forms.value(()) - forms.value(["a", "b", "c"]), rel=1e-9)
    assert shares["a"] == pytest.approx(shares["b"], rel=1e-3) and shares["a"] > shares["c"] > 0.0


def test_exchange_finds_two_places_that_only_work_together() -> None:
    """The best single place is a decoy: growth alone would keep it."""
    rng = np.random.default_rng(2)
    left, right = rng.normal(size=(2, 500))
    decoy = left + right + 0.3 * rng.normal(size=500)
    residual = -10.0 * (left + right)
    columns = np.column_stack([1e-6 * rng.normal(size=500), left, right, decoy])
    forms = forms_of(Rows(residual, columns, {}), Rows(residual, columns, {}), np.zeros(1), ["left", "right", "decoy"])
    names = ["left", "right", "decoy"]
    assert best_subset(forms, 1, [], names) == ["decoy"]
    assert set(best_subset(forms, 2, ["decoy"], names)) == {"left", "right"}


class Left:
    """What is left of 100 by each set of places, as a table."""

    def __init__(self, left: dict[frozenset[str], float]) -> None:
        self.left = left

    def value(self, places: Iterable[str]) -> float:
        return self.left.get(frozenset(places), 100.0)


def test_a_second_place_must_be_worth_it() -> None:
    closing = Left({frozenset("a"): 5.0, frozenset("ab"): 2.0})
    assert smallest(closing, ["a", "b"], 2) == ["a", "b"]
    assert smallest(closing, ["a", "b"], 2, least=0.1) == ["a"]


def test_both_ends_may_do_what_one_place_for_both_does() -> None:
    pair = ("front_air", "rear_air")
    closing = Left({frozenset(["supply"]): 1.0, frozenset(pair): 1.1, frozenset(["front_air"]): 40.0})
    assert [places for places, _ in rivals(closing, ["supply"], ["supply", *pair])] == [pair]


CASES = {
    "none": ((), set()),
    "friction rear": ((("coulomb_friction", "rear", (8.0,)),), {"rear_force"}),
    "leak front": ((("leak", "front", (4e-7,)),), {"front_air"}),
    "tyre damping front": ((("tyre_damping", "front", (40.0,)),), {"front_tyre"}),
    "lvdt scale": ((("lvdt_scale", "unsprung_front", (0.04,)),), {"sensor:unsprung_front"}),
    "friction and leak": (
        (("coulomb_friction", "rear", (8.0,)), ("leak", "front", (4e-7,))),
        {"rear_force", "front_air"},
    ),
}


def active_of(model: RigModel, entries: tuple[tuple[str, str, tuple[float, ...]], ...]) -> tuple[Active, ...]:
    """Effects with their size given and every other parameter at its typical value."""
    out = []
    for effect, site, sizes in entries:
        typical = [parameter.typical for parameter in model.effects[effect].parameters]
        out.append(Active(effect, site, (*sizes, *typical[len(sizes) :])))
    return tuple(out)


@pytest.mark.parametrize("case", CASES)
def test_the_right_places_are_found(model: RigModel, case: str) -> None:
    entries, places = CASES[case]
    active = active_of(model, entries)
    location = locate(model, [log_with(model, active, 4)], log_with(model, active, 5))
    assert set(location.chosen) == places
    assert location.flat == (not places)
    if places:
        assert location.shares[0][0] in places and sum(share for _, share in location.shares) > 0.9
        assert location.level["chosen"] < 0.4 * location.level["refit"]


def test_the_right_effect_leaves_nothing_to_locate(model: RigModel) -> None:
    """Starting from the true effect the search finds no place; starting from a wrong one it finds the rest."""
    truth = active_of(model, CASES["friction and leak"][0])
    fit, holdout = log_with(model, truth, 6), log_with(model, truth, 7)
    nominal = np.array([p.nominal for p in model.parameters])
    assert locate(model, [fit], holdout, Start(nominal, truth)).flat
    assert locate(model, [fit], holdout, Start(nominal, truth[:1])).chosen == ("front_air",)


def log_with_force(model: RigModel, carrier: str, phase: float, seed: int) -> Signals:
    """A log of the rig with 12 N of a 7 Hz force at a place: no function of the motion, another phase each time."""
    clean, road, commands = simulated(SECONDS, seed)
    held = np.zeros((len(road), len(CORRECTIONS)))
    held[:, CORRECTIONS.index(carrier)] = 12.0 * np.sin(2.0 * np.pi * 7.0 * np.arange(len(road)) * 0.002 + phase)
    driven = model.simulate(signals_of(clean, road, commands, seed), correction=held)
    return signals_of(driven, road, commands, seed)


@pytest.mark.parametrize("place", ["front_tyre", "rear_force", "body_pitch"])
def test_a_force_that_follows_no_motion_is_known_by_the_equations_it_moves(model: RigModel, place: str) -> None:
    location = locate(model, [log_with_force(model, place, 0.0, 4)], log_with_force(model, place, 2.0, 5))
    assert location.chosen == (place,) and location.shares[0][1] > 0.7


def test_a_sensor_with_a_course_of_its_own_is_told_from_a_force(model: RigModel) -> None:
    logs = []
    for seed in (4, 5):
        log = log_with(model, (), seed)
        rng = np.random.default_rng(seed)
        knots = np.arange(0.0, SECONDS + 1.0, 0.15)
        wander = np.interp(np.arange(len(log.measured)) * log.period, knots, rng.normal(size=len(knots)))
        measured = log.measured.copy()
        measured[:, MEASURED.index("unsprung_rear")] += 3e-4 * wander
        logs.append(replace(log, measured=measured))
    location = locate(model, logs[:1], logs[1])
    assert location.shares[0][0] == "sensor:unsprung_rear" and not location.followed


def test_a_wrong_structure_keeps_the_gap_and_the_right_one_does_not(model: RigModel) -> None:
    """Viscous damping in place of dry friction brings the free run closer; the equations tell."""
    friction = active_of(model, CASES["friction rear"][0])
    fit, holdout = log_with(model, friction, 6), log_with(model, friction, 7)
    nominal = np.array([p.nominal for p in model.parameters])
    before = locate(model, [fit], holdout)
    right = flexible_gain(before, locate(model, [fit], holdout, Start(nominal, tuple(friction))))
    damping = (Active("viscous_damping", "rear", (40.0, 0.0)),)
    wrong = flexible_gain(before, locate(model, [fit], holdout, Start(nominal, damping)))
    assert right.kept < 0.05 and right.log_ratio == pytest.approx(0.0, abs=0.1) and right.places == ()
    assert wrong.kept > 0.3 and wrong.log_ratio > 1.0 and wrong.places == ("rear_force",)
    assert 0.0 < wrong.spread < 0.5 * wrong.log_ratio
    nothing = log_with(model, (), 6), log_with(model, (), 7)
    same = locate(model, nothing[:1], nothing[1])
    assert flexible_gain(same, locate(model, nothing[:1], nothing[1], Start(nominal))).log_ratio == 0.0


def test_effects_act_along_the_measured_motion(model: RigModel) -> None:
    """A leak that the model lacks makes it sink; the friction in it is nevertheless taken where the rig was."""
    truth = active_of(model, CASES["friction and leak"][0])
    log = log_with(model, truth, 6)
    nominal = np.array([p.nominal for p in model.parameters])
    design = design_of(model, log)
    missing = design.residual * design.null
    known = explained(model, design, nominal, truth[:1])
    left = np.sqrt(np.mean((missing - known) ** 2, axis=0)) / np.sqrt(np.mean(missing**2, axis=0))
    assert left[EQUATIONS.index("rear_axle")] < 0.2
    assert left[EQUATIONS.index("front_air")] == pytest.approx(1.0, abs=0.02)


def test_mending_the_right_place_closes_the_free_run(model: RigModel) -> None:
    active = active_of(model, CASES["leak front"][0])
    fit, holdout = log_with(model, active, 8), log_with(model, active, 9)
    gaps = place_gaps(model, [fit], holdout)
    nominal = float(np.sqrt(np.mean(((holdout.measured - model.simulate(holdout)) / holdout.scale) ** 2)))
    assert min(gaps, key=lambda place: gaps[place]) == "front_air"
    assert gaps["front_air"] < 0.1 * nominal
    location = locate(model, [fit], holdout)
    predicted = predict_located(model, location, location.judge)
    assert np.sqrt(np.mean(((holdout.measured - predicted) / holdout.scale) ** 2)) == pytest.approx(
        gaps["front_air"], rel=0.5
    )


def test_a_missing_channel_leaves_the_equations_that_do_not_need_it(model: RigModel) -> None:
    active = active_of(model, CASES["leak front"][0])
    logs = []
    for seed in (4, 5):
        log = log_with(model, active, seed)
        weight = log.weight.copy()
        weight[:, MEASURED.index("rear_pressure")] = 0.0
        logs.append(replace(log, weight=weight))
    design = design_of(model, logs[0])
    used = {name for e, name in enumerate(EQUATIONS) if design.weight[:, e].any()}
    assert used == {"front_axle", "front_air"}
    assert locate(model, [logs[0]], logs[1]).shares[0][0] == "front_air"


def test_a_gap_in_the_log_leaves_the_windows_beside_it_as_they_are(model: RigModel) -> None:
    """Forty milliseconds without samples, filled by straight lines: no window that weighs them counts as a residual."""
    log = log_with(model, (), 3)
    lost = slice(2012, 2032)
    measured, weight = log.measured.copy(), log.weight.copy()
    for column in range(measured.shape[1]):
        measured[lost, column] = np.interp(np.arange(2012, 2032), [2011, 2032], measured[[2011, 2032], column])
    weight[lost] = 0.0
    whole, holed = design_of(model, log), design_of(model, replace(log, measured=measured, weight=weight))
    left_out = ~holed.weight.all(axis=1)
    touched = np.abs(holed.windows.centres - 2021.5) < 30.0
    assert left_out.any() and not left_out[~touched].any()
    assert np.abs(holed.residual).max() < 1.2 * np.abs(whole.residual).max()


@pytest.mark.parametrize("lost", [("sprung_front",), ("front_pressure",), MEASURED[:4], MEASURED])
def test_channels_that_are_not_there_do_no_harm(model: RigModel, lost: tuple[str, ...]) -> None:
    """From what is left something finite is said, and a place that needs the lost channel is not blamed."""
    active = active_of(model, CASES["tyre damping front"][0])
    logs = []
    for seed in (4, 5):
        clean, road, commands = simulated(6.0, seed)
        channels = model.simulate(signals_of(clean, road, commands, seed), active=active)
        full = topics_of_channels(noisy(channels, seed), road, commands)
        logs.append(prepare({name: without(data, name, lost) for name, data in full.items()}, load_rig()))
    location = locate(model, [logs[0]], logs[1])
    assert all(np.isfinite(value) for value in location.level.values())
    assert all(0.0 <= share <= 1.5 for _, share in location.shares)
    assert not {f"sensor:{name}" for name in lost} & set(location.chosen)
    if len(lost) > 1:
        assert location.flat


def without(data: TopicData, topic: str, lost: tuple[str, ...]) -> TopicData:
    """A topic with the samples of lost channels turned into NaN, as a log without them reads."""
    own = {"/rig/front/pressure": "front_pressure", "/rig/rear/pressure": "rear_pressure"}.get(topic)
    gone = {name: np.full_like(v, np.nan) for name, v in data.channels.items() if (own or name) in lost}
    return data._replace(channels={**data.channels, **gone})


def test_friction_shows_as_a_force_that_turns_with_velocity(model: RigModel) -> None:
    active = active_of(model, CASES["friction rear"][0])
    location = locate(model, [log_with(model, active, 4)], log_with(model, active, 5))
    judge = location.judge
    residual = corrected_residual(judge, location.refit_nuisance, np.zeros(len(judge.columns)))
    mean = {r.label: r.mean for r in regimes(judge, residual, "rear_axle")}
    assert mean["fast extension"] > 2.0 and mean["fast compression"] < -2.0
    assert occurrence(location).place == "rear_force" and occurrence(location).equation == "rear_axle"


def test_the_subsystem_with_the_fault_leaves_the_log_when_run_alone(model: RigModel) -> None:
    active = active_of(model, CASES["leak front"][0])
    sound, faulty = (conditional_gaps(car_of(model), log_with(model, on, 4)) for on in ((), active))
    assert max(sound.values()) < 0.05
    assert max(faulty, key=lambda name: faulty[name]) == "front_air" and faulty["front_air"] > 0.3


def test_bands_hold_all_of_the_error() -> None:
    t = np.arange(5000) * 0.002
    found = bands(np.column_stack([np.sin(2 * np.pi * 2.0 * t), 0.1 * np.sin(2 * np.pi * 9.0 * t)]), 0.002)
    assert sum(share for *_, share in found) == pytest.approx(1.0, abs=1e-6)
    assert max(found, key=lambda band: band[2])[:2] == (1.0, 4.0)


def test_symmetric_laws_give_odd_harmonics_and_one_sided_ones_even() -> None:
    t = np.arange(6000) * 0.002
    wave = np.sin(2 * np.pi * 1.7 * t)
    road = np.column_stack([wave, wave]) * 5e-3
    symmetric = harmonics(road, np.sign(wave)[:, None], 0.002)
    one_sided = harmonics(road, np.maximum(wave, 0.0)[:, None], 0.002)
    assert symmetric is not None and one_sided is not None
    assert symmetric.frequency == pytest.approx(1.7, rel=1e-3)
    assert symmetric.odd > 0.3 and symmetric.even < 0.02
    assert one_sided.even > 0.3 and one_sided.odd < 0.02
    assert harmonics(np.random.default_rng(0).normal(size=(6000, 2)), wave[:, None], 0.002) is None


PLACES = {
    "coulomb_friction": "{end}_force",
    "valve_lag": "{end}_air",
    "leak": "{end}_air",
    "tyre_damping": "{end}_tyre",
}


def true_places(label: dict) -> set[str]:  # type: ignore[type-arg]
    out = set()
    for truth in label["truth"]:
        if truth["kind"] == "lvdt_scale":
            out.add(f"sensor:{MEASURED[int(truth['sens']['lvdt'][0])]}")
        elif truth["kind"] != "none":
            ends = ("front", "rear") if truth["side"] is None else (("front", "rear")[truth["side"]],)
            out |= {PLACES[truth["kind"]].format(end=end) for end in ends}
    return out


@pytest.mark.slow
def test_the_practice_logs_are_located_exactly(practice: Callable[[str], Path]) -> None:
    """Made by other software with other laws: each pair's places and no others; flat where nothing is wrong."""
    for label in labels():
        fit, holdout = (read_signals(practice(f"{label['name']}-{part}")) for part in ("fit", "holdout"))
        location = locate(RigModel(fit.rig), [fit], holdout)
        assert set(location.chosen) == true_places(label), label["name"]
        assert location.flat == (not true_places(label)), label["name"]
