# SPDX-License-Identifier: Apache-2.0
"""Every effect: nothing at zero size, the right sign and energy, and the kernel that composes them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.rig_logs import signals_of, simulated

from pneumo_ros.diagnosis.half_car.signals import Signals
from pneumo_ros.effects.loading import load_library
from pneumo_ros.effects.parameters import ANYTHING, Active, family_of, is_law
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.errors import InputError
from pneumo_ros.laws.filters import delayed_hold, first_order_line, lagged_hold, lagged_line
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig

CONTRACT = [
    "coulomb_friction", "viscous_damping", "bellows_hysteresis", "bellows_mode", "valve_lag", "valve_deadband",
    "transport_delay", "leak", "supply_droop", "heat_transfer", "effective_area_error", "dead_volume", "tyre_damping",
    "tyre_liftoff", "payload", "cg_shift", "bump_stop", "orifice_coefficient", "exciter_lag", "lvdt_scale",
    "lvdt_offset", "pressure_scale", "pressure_offset", "pressure_lag",
]  # fmt: skip
LIBRARY = load_library()
VARIANTS = [(effect.id, site) for effect in LIBRARY.values() for site in effect.sites]


@pytest.fixture(scope="module")
def model() -> RigModel:
    return RigModel(load_rig(), LIBRARY)


@pytest.fixture(scope="module")
def record() -> Signals:
    return signals_of(*simulated(3.0, 5), seed=5)


def predicted(model: RigModel, record: Signals, *active: Active) -> np.ndarray:
    return model.simulate(record, initial=trim(model.rig).state, active=active)


def typical(effect: str, site: str, factor: float = 1.0) -> Active:
    parameters = LIBRARY[effect].parameters
    return Active(effect, site, tuple(p.typical * factor if p.size else p.typical for p in parameters))


def test_the_library_has_every_effect_of_the_contract() -> None:
    assert sorted(filter(is_law, LIBRARY)) == sorted(CONTRACT)
    assert {family_of(name) for name in LIBRARY} == {*CONTRACT, ANYTHING}
    for effect in LIBRARY.values():
        assert effect.summary and any(p.size for p in effect.parameters)
        assert all(p.low <= p.typical <= p.high and p.unit for p in effect.parameters)


@pytest.mark.parametrize(("effect", "site"), VARIANTS)
def test_no_size_is_no_effect_and_some_size_is_one(model: RigModel, record: Signals, effect: str, site: str) -> None:
    bare = predicted(model, record)
    assert np.max(np.abs(predicted(model, record, typical(effect, site, 0.0)) - bare) / record.scale) < 1e-9
    moved = np.max(np.abs(predicted(model, record, typical(effect, site)) - bare) / record.scale)
    if family_of(effect) not in ("bump_stop", "tyre_liftoff"):  # this road does not reach them
        assert moved > 1e-3


@pytest.mark.parametrize(("effect", "site"), VARIANTS)
def test_an_effect_stays_where_it_is(model: RigModel, record: Signals, effect: str, site: str) -> None:
    places = model.places(Active(effect, site, ()))
    assert places
    if site in ("front", "rear"):
        assert all(p.startswith(site) or p == "road_input" for p in places)
        assert model.side(Active(effect, site, ())) == site
    if site not in ("front", "rear", "both", ""):
        assert places == (f"sensor:{site}",) and model.side(Active(effect, site, ())) is None


def test_the_composed_kernel_without_effects_is_the_plant(model: RigModel, record: Signals) -> None:
    state = trim(model.rig).state
    plain = model.states(record, initial=state)
    composed = model.states(record, initial=state, correction=np.zeros((len(record.measured), 9)))
    assert np.max(np.abs(plain - composed) / np.std(plain, axis=0)) < 1e-9


def test_a_correction_at_a_place_is_that_force(model: RigModel, record: Signals) -> None:
    """1 N down on the body is g-independent: the same as so much more mass does to the statics."""
    push = np.zeros((len(record.measured), 9))
    push[:, 6] = -1.0
    state = trim(model.rig).state
    moved = model.states(record, initial=state, correction=push) - model.states(record, initial=state)
    # Just after the start only inertia resists: z'' = F/m.
    t = 5 * record.period
    assert moved[5, 0] == pytest.approx(-0.5 * t * t / model.rig.sprung_mass.value, rel=0.05)


DISSIPATING = {
    "coulomb_friction": (6.0, 2e-4, 0.25),
    "viscous_damping": (25.0, 0.0),
    "bellows_hysteresis": (8.0, 1e-3, 1.0, 0.5),
    "tyre_damping": (20.0,),
}


@pytest.mark.parametrize("effect", DISSIPATING)
def test_dissipation_takes_energy_out_of_a_free_decay(model: RigModel, effect: str) -> None:
    road, commands = np.zeros((1100, 2)), np.tile(trim(model.rig).command, (1100, 1))
    still = signals_of(np.tile(simulated(0.1, 1)[0][0], (1100, 1)), road, commands)
    start = trim(model.rig).state
    start[4] += 0.3  # m/s, a blow on the body
    free = model.simulate(still, initial=start)
    damped = model.simulate(still, initial=start, active=(Active(effect, "both", DISSIPATING[effect]),))
    assert np.std(damped[500:, 0]) < 0.95 * np.std(free[500:, 0])


def test_signs(model: RigModel, record: Signals) -> None:
    bare = predicted(model, record)

    def mean_shift(effect: str, site: str, channel: int) -> float:
        return float(np.mean(predicted(model, record, typical(effect, site))[-500:, channel] - bare[-500:, channel]))

    assert mean_shift("leak", "front", 4) < 0.0  # air lost at the front lowers its pressure
    assert mean_shift("leak", "rear", 1) < 0.0  # and the rear end of the body sinks with its own
    assert mean_shift("payload", "", 0) < 0.0
    assert mean_shift("cg_shift", "", 0) < mean_shift("cg_shift", "", 1)  # load moved forward sinks the front more
    assert mean_shift("supply_droop", "", 5) < 0.0
    assert mean_shift("pressure_offset", "rear_pressure", 5) == pytest.approx(2000.0)
    assert mean_shift("valve_deadband", "front", 0) < 0.0


def test_friction_holds_a_strut_that_is_pushed_less_than_it(model: RigModel) -> None:
    """Presliding: below the friction force the strut creeps back elastically instead of sliding."""
    road, commands = np.zeros((1100, 2)), np.tile(trim(model.rig).command, (1100, 1))
    still = signals_of(np.tile(simulated(0.1, 1)[0][0], (1100, 1)), road, commands)
    push = np.zeros((1100, 9))
    push[250:500, 6] = 10.0
    stuck = (Active("coulomb_friction", "both", (30.0, 1e-4, 0.2)),)
    start = trim(model.rig).state
    moved = model.states(still, initial=start, active=stuck, correction=push)
    free = model.states(still, initial=start, correction=push)
    a = model.rig.front_arm.value
    held, slid = (np.ptp(x[:, 0] + a * x[:, 1] - x[:, 2]) for x in (moved, free))
    assert held < 5e-5 < 2e-4 < slid


def test_lags_and_delays_are_exact_on_what_is_known() -> None:
    period, t = 2e-3, np.arange(4000) * 2e-3
    w = 2.0 * np.pi * 2.0
    wave = np.sin(w * t)
    for lagged, gain in (
        (first_order_line(wave, period, 0.02)[0], 1.0 / (1.0 + 0.02j * w)),
        (lagged_line(wave, period, 0.015, 0.7)[0], 1.0 / (1.0 - (0.015 * w) ** 2 + 2j * 0.7 * 0.015 * w)),
    ):
        assert np.max(np.abs(lagged[2000:] - np.imag(gain * np.exp(1j * w * t[2000:])))) < 2e-4
    step = np.where(t > 0.5, 1.0, 0.0)
    rising, _ = lagged_hold(step, period, 0.02, 0.8)
    assert rising[-1] == pytest.approx(1.0, abs=1e-9) and rising[251] < 0.01
    assert np.sum(delayed_hold(step, period, 0.0113)[0]) == pytest.approx(np.sum(step) - 0.0113 / period)


@pytest.mark.slow
def test_a_users_effect_loads_by_path_and_runs_in_the_kernel(
    tmp_path: Path, record: Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PNEUMO_KERNEL_CACHE", str(tmp_path))
    source = Path(LIBRARY["tyre_damping"].term.tyre.py_func.__code__.co_filename)  # type: ignore[union-attr]
    own = tmp_path / "stiffer.py"
    text = source.read_text().replace('id="tyre_damping"', 'id="tyre_stiffening"').replace("tyre.rate", "tyre.force")
    own.write_text(text)
    rig = load_rig()
    model = RigModel(rig, {"tyre_stiffening": load_library([own])["tyre_stiffening"]})
    stiffer = predicted(model, record, Active("tyre_stiffening", "both", (0.5,)))
    harder = RigModel(rig.with_values(tyre_stiffness_front=21000.0, tyre_stiffness_rear=21000.0), model.library)
    assert np.max(np.abs(stiffer - model_on(harder, record, model)) / record.scale) < 1e-6


def model_on(other: RigModel, record: Signals, reference: RigModel) -> np.ndarray:
    """Another rig's prediction from the reference's rest."""
    return other.simulate(record, initial=trim(reference.rig).state)


def test_a_file_without_an_effect_is_refused(tmp_path: Path) -> None:
    bad = tmp_path / "nothing.py"
    bad.write_text("x = 1\n")
    with pytest.raises(InputError, match="defines no EFFECT"):
        load_library([bad])
    old = tmp_path / "old.py"
    source = Path(str(LIBRARY["lvdt_scale"].outputs.__code__.co_filename)).read_text()  # type: ignore[union-attr]
    old.write_text(source.replace(", values: Values, memory: Memory", ", values: Values"))
    with pytest.raises(InputError, match=r"hook of another form.*outputs\(outputs, period, channels, values, memory\)"):
        load_library([old])
    with pytest.raises(InputError, match="cannot load the effect"):
        load_library([tmp_path / "missing.py"])
