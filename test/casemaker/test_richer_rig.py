# SPDX-License-Identifier: Apache-2.0
"""The richer rig: its nominal limit is the contract's plant; its own laws behave as physics says."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.folders import PACKAGE

from pneumo_ros.casemaker import catalogue, contact, registry
from pneumo_ros.casemaker.bench import bench
from pneumo_ros.casemaker.controller import ACTIVE, LEVELLING, Controller
from pneumo_ros.casemaker.excitation import ROADS, road, valve_steps
from pneumo_ros.casemaker.gap_size import free_run, gap, refit
from pneumo_ros.casemaker.parameters import End, RicherRig, richer_rig
from pneumo_ros.casemaker.scene import PERIOD, Scene, observation, play
from pneumo_ros.casemaker.simulate import Run, simulate
from pneumo_ros.casemaker.trim import prepared, residual, rest_of
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig

RIG = load_rig()
CAR, TRIM = nominal_half_car(RIG)
RICHER = richer_rig(RIG, TRIM.pressures)
SCENE = Scene("iso_c", 0.9, "levelling", "steps", 0.25, 5)


def short_run(rig: RicherRig, gains: Controller = LEVELLING, seconds: float = 3.0, flat: bool = False) -> Run:
    """A noiseless run from rest."""
    time = PERIOD * np.arange(int(seconds / PERIOD) + 1)
    rest = rest_of(rig, TRIM.outlets, CAR.surface)
    ground = road("iso_c", time, RIG.wheelbase, 0.0 if flat else 1.0, 3)
    shake = valve_steps(time, 0.0 if flat else 0.3, 4)
    return simulate(prepared(rig, rest), rest, ground, shake, np.zeros((len(time), 6)), CAR.surface, gains, PERIOD)


@pytest.mark.parametrize("gains", [LEVELLING, ACTIVE], ids=["levelling", "active"])
def test_without_extras_it_is_the_plant_of_the_contract(gains: Controller) -> None:
    run = short_run(RICHER, gains)
    time = PERIOD * np.arange(len(run.inlets))
    commands = np.hstack([run.inlets[:-1], np.tile(TRIM.outlets, (len(time) - 1, 1))])
    states = CAR.simulate(TRIM.state, commands, road("iso_c", time, RIG.wheelbase, 1.0, 3), PERIOD)
    assert np.all(np.abs(states - run.states[:, :10]).max(axis=0) < 1e-4 * states.std(axis=0))


def test_closed_chamber_with_its_own_energy_balance_is_adiabatic() -> None:
    """No flow and no wall heat: the first law gives P V^n constant, the contract's law too."""
    sealed = registry.at_ends(RICHER, "both", inlet_scale=1e-12, outlet_scale=1e-12, open_energy=1.0)
    rest = rest_of(RICHER, TRIM.outlets, CAR.surface)
    time = PERIOD * np.arange(1501)
    ground = road("multisine", time, RIG.wheelbase, 1.5, 3)
    still = np.zeros((len(time), 2)), np.zeros((len(time), 6))
    run = simulate(sealed, rest, ground, *still, CAR.surface, LEVELLING, PERIOD)
    height = run.states[:, 0] + sealed.front.arm * run.states[:, 1] - run.states[:, 2]
    invariant = run.states[:, 8] * (sealed.front.volume_offset + sealed.front.mean_area * height) ** 1.4
    assert np.ptp(height) > 1e-3
    assert np.ptp(invariant) < 1e-5 * invariant.mean()


def test_heat_to_the_wall_turns_the_sealed_chamber_isothermal() -> None:
    sealed = registry.at_ends(RICHER, "both", inlet_scale=1e-12, outlet_scale=1e-12, heat=60.0)
    rest = rest_of(RICHER, TRIM.outlets, CAR.surface)
    time = PERIOD * np.arange(1501)
    ground = road("multisine", time, RIG.wheelbase, 1.5, 3)
    run = simulate(sealed, rest, ground, np.zeros((1501, 2)), np.zeros((1501, 6)), CAR.surface, LEVELLING, PERIOD)
    height = run.states[:, 0] + sealed.front.arm * run.states[:, 1] - run.states[:, 2]
    volume = sealed.front.volume_offset + sealed.front.mean_area * height
    assert np.ptp(run.states[:, 8] * volume) < 0.06 * np.ptp(run.states[:, 8]) * volume.mean()


def test_bristles_hold_below_the_static_level_and_slip_at_the_coulomb_level() -> None:
    end = RICHER.front._replace(coulomb=10.0, static=12.0, stribeck=0.01, bristle_stiffness=4e4, bristle_damping=0.0)
    bristle = 0.0
    for _ in range(20000):
        force, rate = contact.lugre(bristle, 0.2, end)
        bristle += 1e-5 * rate
    assert force == pytest.approx(10.0, rel=1e-3)
    assert contact.lugre(1e-4, 0.0, end) == pytest.approx((4.0, 0.0))


def test_bellows_loop_dissipates_and_closes() -> None:
    end = RICHER.front._replace(bouc_stiffness=5e3, bouc_yield=1e-3, bouc_power=1.0)
    time, memory, work = np.linspace(0.0, 2.0, 40001), 0.0, 0.0
    dt = time[1]
    for t in time:
        speed = 4e-3 * 2.0 * np.pi * np.cos(2.0 * np.pi * t)
        memory += dt * contact.bouc_wen_rate(memory, speed, end)
        work += dt * end.bouc_stiffness * memory * speed if t > 1.0 else 0.0
    assert abs(memory) <= 1e-3 * 1.001
    assert 0.5 * 4 * 4e-3 * 5.0 < work < 4 * 4e-3 * 5.0  # below the full rectangle of slip force times stroke


def test_tyre_leaves_the_ground_and_stop_never_pulls() -> None:
    end = RICHER.front._replace(unilateral=1.0, tyre_damping=50.0, contact_stiffness=5e5, contact_height=0.04,
                              contact_damping=0.5)  # fmt: skip
    x, rows = np.zeros(1), RICHER.rows[0]
    assert contact.lossy_tyre(x, x, 0, -1e-3, 0.0, 0.016, rows, end) == 0.0
    assert contact.lossy_tyre(x, x, 0, 1e-4, -1.0, 0.016, rows, end) == 0.0
    assert contact.hunt_crossley(0.039, 5.0, end) == 0.0
    assert contact.hunt_crossley(0.041, -1.0, end) == 0.0
    assert contact.hunt_crossley(0.035, 0.0, end) > 0.0


@pytest.mark.parametrize("name", [*catalogue.known_effects(), *catalogue.unknown_kinds()])
def test_every_effect_starts_at_rest_and_moves_its_own_end(name: str) -> None:
    effect = catalogue.get(name)
    for side in effect.sides:
        applied = effect.apply(RICHER, 0.4, side, np.random.default_rng(1))
        rest = rest_of(applied.rig, TRIM.outlets, CAR.surface)
        rates = residual(applied.rig, rest, CAR.surface)
        if name != "wheel_imbalance":  # a rotating force is never at rest
            assert np.abs(rates[[*range(8), 16, 17]]).max() < 1e-6
            assert np.abs(rates[8:10]).max() < 1.0  # Pa/s
        changed = {end for end in ("front", "rear") if getattr(applied.rig, end) != getattr(RICHER, end)}
        assert changed <= set(registry.ends_of(side))
        ends = {p.split(":")[-1].replace("sprung_", "").replace("un", "").split("_")[0] for p in applied.places}
        if side in ("front", "rear") and not ends & {"road", "body", "supply"}:
            assert ends == {side}


def test_known_effects_are_the_contracts() -> None:
    listed = """coulomb_friction viscous_damping bellows_hysteresis bellows_mode valve_lag valve_deadband leak
        transport_delay supply_droop heat_transfer effective_area_error dead_volume tyre_damping tyre_liftoff payload
        cg_shift bump_stop orifice_coefficient exciter_lag lvdt_scale lvdt_offset pressure_scale pressure_offset
        pressure_lag"""
    assert set(catalogue.known_effects()) == set(listed.split())
    assert len(catalogue.unknown_kinds()) >= 8


@pytest.mark.parametrize("name", ["coulomb_friction", "valve_lag", "leak", "tyre_damping", "pressure_lag"])
def test_gap_grows_with_size(name: str) -> None:
    on = bench()
    gaps = []
    for size in (0.05, 0.2, 0.6):
        rig = catalogue.get(name).apply(RICHER, size, "front", np.random.default_rng(1)).rig
        seen = observation(play(rig, RIG, SCENE, CAR.surface), RIG)
        gaps.append(gap(free_run(on.car, seen), seen))
    assert gaps[0] < gaps[1] < gaps[2]


def test_refit_takes_back_a_rig_inside_its_tolerances() -> None:
    values = {"sprung_mass": 50.33 * 1.006, "tyre_stiffness_rear": 14000.0 * 0.95, "bushing_damping": 56.0}
    real = richer_rig(RIG.with_values(**values), TRIM.pressures)
    seen = observation(play(real, RIG, SCENE, CAR.surface), RIG)
    noise = float(np.sqrt(np.mean((seen.noise / seen.measured.std(axis=0)) ** 2)))
    left, _ = refit(CAR, seen)
    assert gap(free_run(CAR, seen), seen) > 10.0 * noise
    assert left < 1.3 * noise


@pytest.mark.parametrize("kind", ROADS)
def test_roads_start_still_and_the_rear_follows(kind: str) -> None:
    time = PERIOD * np.arange(7500)
    ground = road(kind, time, RIG.wheelbase, 1.0, 9)
    assert np.all(ground[time < 0.5] == 0.0)
    assert 0.8e-3 < ground[:, 0].std() < 5e-3
    lags = range(220)
    match = [np.corrcoef(ground[: 7500 - k, 0], ground[k:, 1])[0, 1] for k in lags]
    assert max(match) > 0.98
    assert 0.02 <= PERIOD * int(np.argmax(match)) <= 0.4


def test_delay_and_overlap_act_between_command_and_flow() -> None:
    late = short_run(registry.at_ends(RICHER, "front", valve_delay=0.05), flat=True)
    assert np.allclose(late.states[:, 8], late.states[0, 8], rtol=1e-9)
    overlap = registry.at_ends(RICHER, "front", valve_overlap=2e-7)
    rest = rest_of(overlap, TRIM.outlets, CAR.surface)
    assert rest.inlets[0] == pytest.approx(TRIM.inlets[0] + 2e-7)


def test_neither_side_of_the_check_imports_the_other() -> None:
    for here, there in (("casemaker", "diagnosis"), ("diagnosis", "casemaker")):
        for path in (PACKAGE / here).rglob("*.py"):
            assert f"pneumo_ros.{there}" not in path.read_text(encoding="utf-8"), path


def test_end_defaults_are_off() -> None:
    assert all(getattr(RICHER.front, name) == default for name, default in End._field_defaults.items())
