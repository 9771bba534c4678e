# SPDX-License-Identifier: Apache-2.0
"""The free run of a user's model: against scipy, plain as compiled, compiled once."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.own_rigs import CART, CART_YAML, cart_log, written
from scipy.integrate import solve_ivp

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.diagnosis.fit.uncertainty import at_bounds
from pneumo_ros.diagnosis.signals.types import TopicTiming
from pneumo_ros.effects.parameters import Active
from pneumo_ros.own_rig.description import read_description
from pneumo_ros.own_rig.from_files import prepared
from pneumo_ros.own_rig.kernel import self_contained
from pneumo_ros.own_rig.model import OwnRig
from pneumo_ros.own_rig.physics import load_physics
from pneumo_ros.own_rig.records import OwnRecord, first_values, read_record


@pytest.fixture(scope="module")
def cart(tmp_path_factory: pytest.TempPathFactory) -> tuple[OwnRig, OwnRecord]:
    folder = tmp_path_factory.mktemp("cart")
    task = prepared(written(folder), [cart_log(folder / "log.csv", friction=0.0)])
    return task.model, task.fit[0]


def test_the_free_run_is_scipys(cart: tuple[OwnRig, OwnRecord]) -> None:
    model, record = cart
    nominal = np.array([p.nominal for p in model.parameters])
    start = np.array([0.003, -0.02])
    m, k, c = nominal

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], (np.interp(t, record.time, record.inputs[:, 0]) - k * y[0] - c * y[1]) / m]

    exact = solve_ivp(rates, (0.0, record.time[-1]), start, t_eval=record.time, max_step=2e-3, rtol=1e-9).y[0]
    assert np.abs(model.predict(record, nominal, start, ())[:, 0] - exact).max() < 2e-6 * np.abs(exact).max() + 1e-9


def test_dry_friction_stops_the_cart(cart: tuple[OwnRig, OwnRecord]) -> None:
    """Undriven, 2 F / k are lost a half swing, and it stays where the spring no longer overcomes friction."""
    model, record = cart
    still = type(record)(**{**vars(record), "inputs": np.zeros_like(record.inputs)})
    nominal = np.array([2.0, 80.0, 0.0])
    path = model.predict(still, nominal, np.array([0.1, 0.0]), (Active("coulomb_friction", "rail", (0.8,)),))[:, 0]
    peaks = [abs(path[i]) for i in range(1, len(path) - 1) if (path[i] - path[i - 1]) * (path[i + 1] - path[i]) < 0]
    assert peaks[0] == pytest.approx(0.1 - 2 * 0.8 / 80.0, abs=5e-4)
    assert abs(path[-1]) < 0.8 / 80.0


@pytest.mark.parametrize(
    ("law", "at", "counted"),
    [
        ("hysteresis", "low", 1.0),  # yields at once: dry friction
        ("coulomb_friction.presliding", "low", 0.0),  # dry friction without presliding
        ("coulomb_friction.presliding", "high", 1.0),  # hysteresis
        ("resonance", "high", 0.5),
    ],
)
def test_a_bound_at_which_another_family_begins_counts_whole(
    law: str, at: str, counted: float, cart: tuple[OwnRig, OwnRecord]
) -> None:
    problem, candidate = Problem(cart[0], (cart[1],)), Candidate(((law, "rail"),))
    size, shape, *rest = problem.effect_parameters(candidate)
    values = [size.typical, getattr(shape, at), *(p.typical for p in rest)]
    stuck = Fit(candidate, problem.start(candidate, None, values), 0.0, np.zeros((1, 1)))
    assert at_bounds(problem, stuck) == (counted, 0.0)


@pytest.mark.parametrize(("above", "counted"), [(1.0, 1.0), (1.02, 1.0), (1.2, 0.0)])
def test_a_hysteresis_that_yields_at_once_is_friction_beside_its_shape_too(
    above: float, counted: float, cart: tuple[OwnRig, OwnRecord]
) -> None:
    """No slider of the shape is as short, and no fit ends at a bound exactly."""
    problem = Problem(cart[0], (cart[1],))
    candidate = Candidate((("hysteresis", "rail"), ("hysteresis.shape", "rail")))
    size, travel, *atoms = problem.effect_parameters(candidate)
    values = [size.typical, above * travel.low, *(p.typical for p in atoms)]
    stuck = Fit(candidate, problem.start(candidate, None, values), 0.0, np.zeros((1, 1)))
    assert at_bounds(problem, stuck) == (counted, 0.0)


@pytest.mark.parametrize(
    ("law", "values"),
    [("hysteresis", (6.0, 0.01)), ("hysteresis.growing", (6.0, 0.02, 1.2)), ("hysteresis.sliders", (6.0, 0.01))],
)
def test_a_stiff_hysteresis_is_not_half_a_step_late(
    law: str, values: tuple[float, ...], cart: tuple[OwnRig, OwnRecord]
) -> None:
    """Late by half a step its force gives energy away: one step a row runs as eight do."""
    model, record = cart
    fine = replace(model, scaling=replace(model.scaling, substeps=8))
    acting = (Active(law, "rail", values),)
    start = model.initial(record)[0]
    coarse, exact = (m.predict(record, np.array([2.0, 80.0, 1.0]), start, acting) for m in (model, fine))
    assert np.sqrt(np.mean((coarse - exact) ** 2)) < 2e-3 * np.std(exact)


def test_what_a_sensor_does_is_taken_out_of_the_start(cart: tuple[OwnRig, OwnRecord]) -> None:
    model, record = cart
    plain, _ = model.initial(record)
    seen, _ = model.initial(record, (Active("scale", "sensor:position", (0.25,)),))
    assert seen == pytest.approx(plain / 1.25, rel=1e-3)


def test_plain_python_runs_the_same(cart: tuple[OwnRig, OwnRecord], tmp_path: Path) -> None:
    model, record = cart
    slow = CART.replace("return x.speed,", "names = {'a': [1, 'b']}; assert names\n    return x.speed,")
    rig = read_description(written(tmp_path, slow).with_suffix(".yaml"))
    physics = load_physics(tmp_path / "rig.py", rig)
    assert not physics.kernel.compiled and physics.kernel.why_not
    short = record.slice(0, 60)
    plain = OwnRig(rig, physics, model.scaling)
    active = (Active("coulomb_friction", "rail", (0.8,)),)
    nominal, start = np.array([2.0, 80.0, 1.0]), np.array([0.01, 0.1])
    assert np.allclose(plain.predict(short, nominal, start, active), model.predict(short, nominal, start, active),
                       rtol=1e-12, atol=1e-15)  # fmt: skip


def test_only_what_depends_on_its_text_alone_is_kept_compiled() -> None:
    assert self_contained(CART)
    assert not self_contained("import my_tables\n")
    assert not self_contained("TABLE = np.loadtxt('table.csv')\n")


def test_a_record_knows_its_gaps_and_its_timing(tmp_path: Path) -> None:
    log = cart_log(tmp_path / "log.csv", friction=0.0)
    lines = log.read_text().splitlines()
    log.write_text("\n".join(lines[:500] + lines[540:]) + "\n")
    record = read_record(log, read_description(written(tmp_path).with_suffix(".yaml")))
    assert record.period == pytest.approx(0.01)
    assert 35 <= np.count_nonzero(record.weight == 0.0) <= 41
    timing: TopicTiming = record.topics[0]
    assert timing.missing == 40 and timing.rate == pytest.approx(100.0)
    assert "position" in CART_YAML and record.names == ("position",)


STATIC = """
from pneumo_ros.own_rig import Force, Sensor

SLOTS = [
    Force("seal", travel=lambda x, u, p: u.position, rate=lambda x, u, p: u.speed),
    Sensor("force"),
]


def outputs(x, u, p, f):
    return (p.stiffness * u.position + f.seal,)
"""
STATIC_YAML = """
rig: drag
time: {field: t, unit: s}
channels:
  force: {field: f, unit: N}
inputs:
  position: {field: x, unit: mm}
  speed: {rate_of: position}
parameters: {stiffness: 200 N/m}
"""


def static_log(path: Path, friction: float) -> Path:
    """A force over a travel with dry friction, N, 0.01 N of noise."""
    t = np.arange(0.0, 20.0, 0.01)
    x = 0.02 * np.sin(2.0 * t) + 0.01 * np.sin(5.1 * t)
    rub = -friction * np.tanh(np.gradient(x, t) / 1e-3)
    force = 200.0 * x + rub + np.random.default_rng(1).normal(0.0, 0.01, len(t))
    np.savetxt(path, np.column_stack([t, 1e3 * x, force]), "%.6f", ",", header="t,x,f", comments="")
    return path


@pytest.mark.parametrize(("friction", "verdict"), [(1.5, "coulomb_friction"), (0.0, "none")])
def test_a_rig_without_states_or_tolerances_is_diagnosed(friction: float, verdict: str, tmp_path: Path) -> None:
    """Nothing of the nominal model is unknown then."""
    log = static_log(tmp_path / "log.csv", friction)
    found = prepared(written(tmp_path, STATIC, STATIC_YAML), [log]).diagnose()
    assert found.verdict == verdict
    assert found.gap.best < 0.2 * found.gap.refit or verdict == "none"


@pytest.mark.parametrize(("stated", "verdict"), [("", "coulomb_friction"), ("model_form: 5 %", "none")])
def test_a_form_that_nobody_stated_hides_no_effect_that_closes_nearly_all(
    stated: str, verdict: str, tmp_path: Path
) -> None:
    """A gap of 4 %: less than is assumed of a model's form, but one name leaves a twentieth of it."""
    log = static_log(tmp_path / "log.csv", 0.1)
    found = prepared(written(tmp_path, STATIC, f"{STATIC_YAML}{stated}"), [log]).diagnose()
    assert found.verdict == verdict and 0.02 < found.gap.refit < 0.05
    assert any("model_form is not stated: 5 % was assumed" in note for note in found.notes) == (not stated)
    shares = sum(entry.share for entry in found.budget) + found.refit_share + found.floor_share
    assert shares == pytest.approx(1.0, abs=0.05), "no share is told twice"


@pytest.mark.slow
def test_a_sensor_whose_zero_creeps_is_named_with_its_place(tmp_path: Path) -> None:
    """Neither a constant force nor a constant error: the offset's shape in time, at the sensor."""
    fitted, held = (cart_log(tmp_path / f"{name}.csv", 0.0, seconds, seed, creep=0.03)
                    for name, seconds, seed in (("fit", 16.0, 1), ("held", 12.0, 7)))  # fmt: skip
    found = prepared(written(tmp_path), [fitted], held).diagnose()
    (entry,) = found.budget
    assert (found.verdict, entry.law, entry.places) == ("offset", "differs", ("sensor:position",))
    assert found.gap.best < 0.05 * found.gap.refit


@pytest.mark.parametrize(("unit", "told"), [("mm", False), ("m", True), ("um", True)])
def test_a_model_of_another_order_than_its_log_is_told_to_look_at_its_units(
    unit: str, told: bool, tmp_path: Path
) -> None:
    log = cart_log(tmp_path / "log.csv", 0.5)
    task = prepared(written(tmp_path, names=CART_YAML.replace("unit: mm", f"unit: {unit}")), [log])
    notes = [note for note in task.notes if "times as far as the log" in note]
    assert bool(notes) == told and all(note.startswith("position: the nominal model moves") for note in notes)


@pytest.mark.parametrize("noise", [1e-6, 5e-4])
@pytest.mark.parametrize(
    ("motion", "rate"),
    [
        (lambda t: 6.0 * t**2 - 40.0 * t**3, 0.0),  # from rest under a force that falls: bends within a few rows
        (lambda t: 0.3 * np.sin(2.0 * t), 0.6),
        (lambda t: np.round(0.5 * t, 3), 0.5),  # read in whole millimetres
    ],
)
def test_the_start_of_a_motion_is_as_sure_as_it_is_told(
    motion: Callable[[Array], Array], rate: float, noise: float, cart: tuple[OwnRig, OwnRecord]
) -> None:
    """A parabola through half a second of a motion that bends within a tenth would be wrong by twenty sigma."""
    record = replace(cart[1], period=0.01, pace=replace(cart[1].pace, settle=1.0))
    rng = np.random.default_rng(5)
    off = []
    for _ in range(40):
        column = motion(0.01 * np.arange(64)) + rng.normal(0.0, noise, 64)
        found, std = first_values(record, column, noise)
        off.append((found - [motion(np.zeros(1))[0], rate]) / std)
    assert np.sqrt(np.mean(np.square(off), axis=0)).max() < 1.6
    assert std[1] < 0.5 + 200.0 * noise


STOPPED = """
import signal, sys, time
from pathlib import Path
import numpy as np
from pneumo_ros.own_rig.description import read_description
from pneumo_ros.own_rig.kernel import SCALES, VALUES
from pneumo_ros.own_rig.physics import load_physics

rig = Path(sys.argv[1])
kernel = load_physics(rig, read_description(rig.with_name("rig.yaml"))).kernel
assert kernel.compiled
signal.signal(signal.SIGALRM, signal.default_int_handler)

def run():
    kernel.run(np.ones(2), np.zeros((300_000, 1)), np.zeros(1, bool), 1e-3, 1, np.array([2.0, 80.0, 1.0]),
               np.zeros(1, np.int64), np.zeros(1, bool), np.zeros((1, VALUES)), np.ones((1, SCALES)), 0.0)

run()
began = time.perf_counter()
run()
half = 0.5 * (time.perf_counter() - began)
for _ in range(3):
    try:
        signal.setitimer(signal.ITIMER_REAL, half)
        run()
        time.sleep(60.0)
    except KeyboardInterrupt:
        print("stopped")
"""


def test_an_interruption_that_meets_a_run_is_one(tmp_path: Path) -> None:
    """Numba made a tuple of arrays after the handler had raised: a SystemError, or a crash."""
    words = [sys.executable, "-c", STOPPED, str(written(tmp_path))]
    done = subprocess.run(words, capture_output=True, text=True, timeout=180, check=False)
    assert (done.returncode, done.stdout) == (0, "stopped\n" * 3), done.stderr
