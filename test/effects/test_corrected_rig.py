# SPDX-License-Identifier: Apache-2.0
"""A rig with effects, stepped: the numbers of the whole-log simulation, for every effect; and its file form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.own_logs import QUICK
from helpers.rig_logs import signals_of, simulated
from helpers.sessions import run

from pneumo_ros.daq.calibration_file import load_calibration
from pneumo_ros.daq.emulator.board import board_identity
from pneumo_ros.daq.emulator.simulation import RigSimulation, SimulationSettings
from pneumo_ros.diagnosis.diagnose import Options
from pneumo_ros.diagnosis.half_car.from_logs import prepared
from pneumo_ros.diagnosis.half_car.saved_rig import corrected_rig, save_corrected_rig
from pneumo_ros.diagnosis.half_car.signals import Signals, check_pair
from pneumo_ros.diagnosis.judge.held_out_runs import held_out
from pneumo_ros.diagnosis.result import Diagnosis, Estimate, Gap
from pneumo_ros.effects import library
from pneumo_ros.effects.corrected_rig import CorrectedRig, diagnosed_rig
from pneumo_ros.effects.loading import load_library
from pneumo_ros.effects.nuisance import COMMAND_DELAY
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.effects.stepping import stepped_rig
from pneumo_ros.errors import InputError, PneumoError
from pneumo_ros.log.reading import read_log
from pneumo_ros.plant.stepping import PlainRig, SteppedRig
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import NamedEffect, Rig, load_rig, parse_rig
from pneumo_ros.road import build_road
from pneumo_ros.session.rerun import compare_channels, rerun

LIBRARY = load_library()
VARIANTS = [(effect.id, site) for effect in LIBRARY.values() for site in effect.sites]
NOMINAL = load_rig()
LAG = NamedEffect("valve_lag", "rear", (("valve_lag", 0.015), ("valve_damping_ratio", 0.86)))
FRICTION = NamedEffect(
    "coulomb_friction", "front", (("friction_force", 6.0), ("bristle_length", 2e-4), ("stribeck_excess", 0.25))
)


@pytest.fixture(scope="module")
def model() -> RigModel:
    return RigModel(load_rig(), LIBRARY, step=1e-3)


@pytest.fixture(scope="module")
def record() -> Signals:
    """Rough enough for stops and lift-off to act."""
    channels, road, commands = simulated(2.2, 5)
    return signals_of(channels, road * [2.5, 7.0], commands, seed=5)


def typical(effect: str, site: str) -> Active:
    return Active(effect, site, tuple(p.typical for p in LIBRARY[effect].parameters))


def stepped(rig: SteppedRig, record: Signals) -> np.ndarray:
    state = rig.init()
    shown = [rig.read(state)]
    for i in range(len(record.measured) - 1):
        state = rig.step(state, record.commands[i], record.road[i : i + 2])
        shown.append(rig.read(state))
    return np.array(shown)


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference over each channel's standard deviation."""
    return float(np.max(np.abs(one - other) / np.std(other, axis=0)))


@pytest.mark.parametrize(("effect", "site"), VARIANTS)
def test_stepping_gives_the_numbers_of_the_whole_log(model: RigModel, record: Signals, effect: str, site: str) -> None:
    active = (typical(effect, site),)
    start = trim(model.rig).state
    whole = model.simulate(record, initial=start, active=active)
    assert apart(stepped(CorrectedRig(model, record.period, None, active), record), whole) < 1e-9
    assert apart(whole, model.simulate(record, initial=start)) > 1e-4


def with_effects(*effects: NamedEffect, **ends: float) -> Rig:
    return replace(NOMINAL, effects=effects, ends=tuple(ends.items()))


# -- the file ----------------------------------------------------------------------------------------------------------


def test_a_rig_keeps_its_effects_through_the_text_that_logs_carry() -> None:
    rig = with_effects(LAG, FRICTION, bushing_damping_front=57.25, outlet_area_rear=1.9e-6)
    assert parse_rig(rig.to_yaml()) == rig and rig.diagnosed
    assert rig.findings[0].startswith("valve_lag (rear): valve_lag 0.015")
    assert parse_rig(NOMINAL.to_yaml()) == NOMINAL and not NOMINAL.diagnosed
    assert set(NOMINAL.to_yaml().splitlines()) <= set(rig.to_yaml().splitlines())


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("effects: leak", "not a list"),
        ("effects: [{effect: leak}]", "needs effect, site and parameters"),
        ("effects: [{effect: leak, parameters: {leak_area: much}}]", "not a finite number"),
        ("ends: {sprung_mass_front: {value: 1.0}}", "unknown value of an end"),
        ("ends: {volume_scale_front: 1.0}", "needs a mapping"),
        ("ends: {volume_scale_front: {value: 1.0, unit: m3}}", "needs a mapping with value and unit"),
        ("ends: {volume_scale_front: {value: 99.0}}", "out of range"),
    ],
)
def test_a_broken_list_is_one_line(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        parse_rig(f"rig: {{}}\n{text}\n")


@pytest.mark.parametrize(
    ("effect", "words"),
    [
        (NamedEffect("gremlins", "", ()), "unknown effect"),
        (NamedEffect("valve_lag", "sprung_front", LAG.parameters), "cannot act there"),
        (NamedEffect("valve_lag", "rear", LAG.parameters[:1]), "wrong parameters"),
        (NamedEffect("valve_lag", "rear", (("valve_lag", 3.0), LAG.parameters[1])), "out of range"),
    ],
)
def test_an_effect_that_cannot_be_is_refused(effect: NamedEffect, words: str) -> None:
    with pytest.raises(InputError, match=words):
        stepped_rig(with_effects(effect), 2e-3)


def test_one_kind_of_term_acts_once_at_an_end() -> None:
    with pytest.raises(InputError, match="twice"):
        diagnosed_rig(with_effects(FRICTION, replace(FRICTION, site="both")), 2e-3)


def found_in(model: RigModel, nuisance: np.ndarray, *active: Active) -> Diagnosis:
    """A diagnosis as far as the rig file looks at it."""
    estimates = {p.name: Estimate(float(v), p.std, p.unit) for p, v in zip(model.parameters, nuisance, strict=True)}
    return Diagnosis("leak", 1.0, (), (), (), Gap(1.0, 1.0, 1.0, 1.0, {}), nuisance=estimates, active=active)


def test_the_saved_rig_is_the_fitted_structure(record: Signals, tmp_path: Path) -> None:
    """Numbers, ends, effects that became numbers and effects that stayed: together what was fitted, in another form."""
    model = RigModel(NOMINAL, LIBRARY)
    rng = np.random.default_rng(4)
    nuisance = np.array([p.nominal + rng.normal() * p.std * (p.name != COMMAND_DELAY) for p in model.parameters])
    active = (
        typical("payload", ""), typical("viscous_damping", "both"), typical("valve_lag", "rear"),
        typical("coulomb_friction", "front"), typical("pressure_lag", "both"),
    )  # fmt: skip
    saved = load_rig(save_corrected_rig(found_in(model, nuisance, *active), model, tmp_path / "rig.yaml"))
    assert [one.effect for one in saved.effects] == ["viscous_damping", "valve_lag", "coulomb_friction", "pressure_lag"]
    assert saved.sprung_mass.value == pytest.approx(nuisance[0] + active[0].values[0])
    assert saved.outlet_area_front == NOMINAL.outlet_area_front
    start = trim(NOMINAL).state
    fitted = model.simulate(record, nuisance, start, active)
    assert apart(RigModel(saved, LIBRARY).simulate(record, initial=start), fitted) < 1e-9
    again = found_in(RigModel(saved, LIBRARY), np.array([p.nominal for p in RigModel(saved).parameters]))
    assert corrected_rig(again, RigModel(saved, LIBRARY)) == saved


def test_an_effect_of_ones_own_travels_as_a_file_beside_the_rig(record: Signals, tmp_path: Path) -> None:
    """Saved with its source beside the rig file; a log has id and hash only, and asks for the file."""
    file = tmp_path / "own" / "tilted.py"
    file.parent.mkdir()
    source = Path(library.__path__[0], "lvdt_offset.py").read_text()
    file.write_text(source.replace('id="lvdt_offset"', 'id="tilted"'))
    model = RigModel(NOMINAL, load_library([file]))
    found = found_in(model, np.array([p.nominal for p in model.parameters]), Active("tilted", "sprung_rear", (1e-3,)))
    rig = load_rig(save_corrected_rig(found, model, tmp_path / "rig.yaml"))
    assert rig.effects[0].file == str(tmp_path / "tilted.py") and rig == corrected_rig(found, model)
    shown = stepped(stepped_rig(rig, record.period), record)
    np.testing.assert_allclose(
        shown[:, 1] - stepped(stepped_rig(NOMINAL, record.period), record)[:, 1], 1e-3, atol=1e-9
    )
    with pytest.raises(InputError, match=r"unknown effect.*--effect FILE"):
        stepped_rig(parse_rig(rig.to_yaml()), record.period)
    (tmp_path / "tilted.py").write_text("EFFECT = None\n")
    with pytest.raises(InputError, match="changed while it was in use"):
        save_corrected_rig(found, model, tmp_path / "rig.yaml")
    load_library([file])
    with pytest.raises(InputError, match="another file of this name stands there"):
        save_corrected_rig(found, model, tmp_path / "rig.yaml")


# -- corrected rigs in sessions, emulator and replay -----------------------------------------------------------------


def test_a_rig_without_findings_is_the_plain_one(record: Signals) -> None:
    plain = stepped_rig(NOMINAL, record.period)
    assert isinstance(plain, PlainRig)
    whole = plain.car.simulate(plain.start, record.commands[:-1], record.road, record.period)
    np.testing.assert_array_equal(stepped(plain, record), [plain.read(x) for x in whole])


def test_truth_holds_what_the_effects_do(record: Signals) -> None:
    """Accelerations are the rates' derivative, and a tyre is a spring whatever acts in the strut."""
    corrected = diagnosed_rig(with_effects(FRICTION, LAG, bushing_damping_rear=60.0), record.period)
    state, known, rates = corrected.init(), [], []
    for i in range(400):
        state = corrected.step(state, record.commands[i], record.road[i : i + 2])
        known.append(corrected.truth(state, record.commands[i], record.road[i + 1]))
        rates.append(corrected.plant_state(state)[4:6])
    slopes = (np.array(rates)[2:] - np.array(rates)[:-2]) / (2.0 * record.period)
    truths = np.array(known)
    assert np.sqrt(np.mean((truths[1:-1, 10:12] - slopes) ** 2)) < 0.02 * np.std(slopes)
    stiffness = [NOMINAL.tyre_stiffness_front.value, NOMINAL.tyre_stiffness_rear.value]
    forces = stiffness * (record.road[1:401] - truths[:, 2:4])
    np.testing.assert_allclose(truths[:, 14:16], forces, atol=1e-3 * np.std(forces))


def test_a_rig_that_runs_away_says_so(record: Signals) -> None:
    corrected = diagnosed_rig(with_effects(NamedEffect("bellows_mode", "both", (
        ("mode_mass", 2.0), ("mode_frequency", 3.0), ("mode_damping_ratio", 0.01), ("wall_share", 0.0),
    ))), record.period)  # fmt: skip
    with pytest.raises(PneumoError, match=r"ran away.*bellows_mode"):
        stepped(corrected, replace(record, road=1e3 * record.road))


def test_the_emulated_board_has_the_effects() -> None:
    droop = NamedEffect("supply_droop", "", (("supply_resistance", 1e7), ("supply_time_constant", 0.03)))
    offset = NamedEffect("lvdt_offset", "sprung_front", (("offset", 2e-3),))
    hello, rig = board_identity(), with_effects(droop, offset)
    road = build_road({"kind": "flat"}, wheelbase=rig.wheelbase)
    shown = []
    for one in (NOMINAL, rig):
        board = RigSimulation(one, road, hello, load_calibration("appendix_c"), SimulationSettings(),
                              stepped_rig(one, hello.sample_period_us * 1e-6))  # fmt: skip
        board._areas = trim(NOMINAL).command
        for _ in range(300):
            board.advance()
        shown.append(board.values())
    plain, corrected = shown
    assert plain[6] == NOMINAL.supply_pressure.value
    assert 5e3 < plain[6] - corrected[6] < 5e4
    board.set_supply(6e5)
    board.advance()
    assert 5.5e5 < board.values()[6] < 6e5
    assert corrected[0] - board.state[0] - rig.front_arm.value * board.state[1] == pytest.approx(2e-3, abs=5e-4)


# -- diagnosing with it ------------------------------------------------------------------------------------------------


def test_what_the_configuration_names_is_in_the_model_and_leaves_the_contest(record: Signals) -> None:
    model = RigModel(with_effects(FRICTION, LAG), LIBRARY)
    active = tuple(Active(e.effect, e.site, tuple(v for _, v in e.parameters)) for e in (FRICTION, LAG))
    start = trim(NOMINAL).state
    named = model.simulate(record, initial=start)
    np.testing.assert_array_equal(named, RigModel(NOMINAL, LIBRARY).simulate(record, initial=start, active=active))
    assert model.effects["coulomb_friction"].sites == ("rear",)
    assert model.effects["valve_lag"].sites == LIBRARY["valve_lag"].sites
    assert "supply_droop" not in RigModel(with_effects(NamedEffect("supply_droop", "", (
        ("supply_resistance", 4e7), ("supply_time_constant", 0.03)))), LIBRARY).effects  # fmt: skip


def test_logs_of_a_rig_with_and_without_an_effect_are_of_two_rigs(record: Signals) -> None:
    other = replace(record, rig=with_effects(LAG), measured=record.measured + 1.0)
    with pytest.raises(InputError, match=r"two rigs.*effects.*valve_lag \(rear\)"):
        check_pair([record], other)


@pytest.mark.slow
def test_a_session_of_a_corrected_rig_is_diagnosed_as_what_it_is(tmp_path: Path) -> None:
    """Saved rig to session to diagnosis: the effect comes back, and its own rig leaves nothing to explain."""
    (tmp_path / "rig.yaml").write_text(with_effects(LAG, outlet_area_front=1.97e-6).to_yaml())
    logs = [tmp_path / "fit.mcap", tmp_path / "held.mcap"]
    for seed, log in enumerate(logs, 1):
        code, said = run("--rig", str(tmp_path / "rig.yaml"), "--duration", "10", "--seed", str(seed),
                         "--single-process", "--no-report", "--no-picture", "--output", str(log))  # fmt: skip
        assert code == 0 and "the simulated rig has these effects: valve_lag (rear)" in said, said
    config = read_log(logs[0]).config
    assert config is not None and config.effects == (LAG,)
    again = rerun(read_log(logs[0]), build=stepped_rig)
    assert "valve_lag (rear)" in again.notes[0]
    assert all(row[-1] < 0.01 for row in compare_channels(again))
    found = prepared(logs[:1], logs[1], NOMINAL).diagnose(Options(effort=QUICK, pairs=False))
    best = found.ranking[0]
    assert found.verdict == "valve_lag" and best.side == "rear" and best.shrink > 0.95
    assert best.parameters["valve_lag"].value == pytest.approx(0.015, rel=0.01)
    own = prepared(logs[:1], logs[1])
    assert "valve_lag (rear)" in own.notes[0]
    nominal = np.array([p.nominal for p in own.model.parameters])
    assert held_out(own.model, own.holdout, nominal, ()).total < 1.2 * found.gap.noise_floor
