# SPDX-License-Identifier: Apache-2.0
"""An input that no shape follows is found where it acts, by what it does to the free run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.rig_logs import signals_of, simulated
from scipy.stats import multivariate_normal

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.signals import Signals
from pneumo_ros.diagnosis.half_car.where.latent import (
    BODY,
    INPUTS,
    LONGEST,
    VARIANCES,
    Courses,
    _courses,
    _linearised,
    _loudest,
    _responses,
    latent_places,
)
from pneumo_ros.effects.composition import CORRECTIONS
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.rig import load_rig

SECONDS, SEED = 6.0, 3
# N, Pa/s, N m and Pa of a tone: of the forces one that the rig's equations, window by window, do not show
SIZES = dict(zip(CORRECTIONS, (2.0, 2.0, 2e4, 2e4, 3.0, 3.0, 1.0, 0.3, 3e3), strict=True))


@pytest.fixture(scope="module")
def model() -> RigModel:
    return RigModel(load_rig())


@pytest.fixture(scope="module")
def log(model: RigModel) -> Signals:
    """Of the nominal rig."""
    clean, road, commands = simulated(SECONDS, SEED)
    return signals_of(clean, road, commands, SEED)


def nominal(model: RigModel) -> Array:
    return np.array([p.nominal for p in model.parameters])


def tones(log: Signals) -> Array:
    """Three tones without a common period, (N,)."""
    time = np.arange(len(log.measured)) * log.period
    return np.asarray(sum(np.sin(2.0 * np.pi * f * time + k) for k, f in enumerate((0.7, 1.3, 2.9))))


def driven(model: RigModel, log: Signals, name: str) -> Signals:
    """The log with an input added to the rig."""
    correction = np.zeros((len(log.measured), len(CORRECTIONS)))
    correction[:, CORRECTIONS.index(name)] = SIZES[name] * tones(log)
    moved = model.simulate(log, correction=correction) - model.simulate(log)
    return replace(log, measured=log.measured + moved)


@pytest.mark.parametrize("name", ["front_force", "rear_air", "rear_tyre", "body_pitch", "supply"])
def test_a_force_or_flow_of_any_time_course_is_found_where_it_acts(model: RigModel, log: Signals, name: str) -> None:
    (first, share), *others = latent_places(model, driven(model, log, name), nominal(model))
    assert first == name and share > 0.9
    assert not others or (name in BODY and others[0][0] in BODY and others[0][1] < 0.02)


def test_what_pushes_beside_the_centre_is_told_at_both_of_the_bodys_places(model: RigModel, log: Signals) -> None:
    both = replace(log, measured=driven(model, log, "body_heave").measured + driven(model, log, "body_pitch").measured
                   - log.measured)  # fmt: skip
    found = latent_places(model, both, nominal(model))
    assert {place for place, _ in found} == set(BODY) and sum(share for _, share in found) > 0.9


@pytest.mark.parametrize(("channel", "size"), [("sprung_rear", 5e-4), ("front_pressure", 2e3)])
def test_an_error_of_a_sensor_is_its_own(model: RigModel, log: Signals, channel: str, size: float) -> None:
    measured = log.measured.copy()
    measured[:, model.channels.index(channel)] += size * tones(log)
    ((first, share),) = latent_places(model, replace(log, measured=measured), nominal(model))
    assert first == f"sensor:{channel}" and share > 0.9


def test_two_inputs_that_no_single_place_explains_are_both_told(model: RigModel, log: Signals) -> None:
    measured = driven(model, log, "front_air").measured
    measured[:, model.channels.index("unsprung_rear")] += 2e-4 * tones(log)[::-1]
    found = latent_places(model, replace(log, measured=measured), nominal(model))
    assert {place for place, share in found if share > 0.1} == {"front_air", "sensor:unsprung_rear"}


def test_of_a_long_log_the_part_is_looked_at_that_shows_most(model: RigModel) -> None:
    clean, road, commands = simulated(1.5 * LONGEST, SEED)
    whole = signals_of(clean, road, commands, SEED)
    late = np.arange(len(clean)) > 0.75 * len(clean)
    moved = driven(model, whole, "rear_force").measured - whole.measured
    part = _loudest(model, replace(whole, measured=whole.measured + late[:, None] * moved), nominal(model))
    assert len(part.measured) * part.period == pytest.approx(LONGEST)
    assert part.start == pytest.approx(whole.start + 0.5 * LONGEST, abs=1.0)


def test_tolerances_answer_first(model: RigModel, log: Signals) -> None:
    """Of what a rig half a sigma from nominal leaves next to nothing is left for inputs."""
    off = np.array([p.nominal + 0.5 * (-1.0) ** k * p.std for k, p in enumerate(model.parameters)])
    other = replace(log, measured=log.measured + model.simulate(log, off) - model.simulate(log))
    states = model.states(other, nominal(model), model.initial(other)[0])
    found = _courses(model, other, nominal(model), states)
    assert 0.0 < found.whole < 0.02 * float(found.residual @ found.residual)


def test_the_step_is_linearised_about_the_run(model: RigModel, log: Signals) -> None:
    """A small push that begins after a second does by the linear steps what it does in the simulation, to 2 %."""
    every, count = 10, 100
    initial = model.initial(log)[0]
    states = model.states(log, nominal(model), initial)[: count * every + 1 : every]
    step, held = _linearised(model, log, nominal(model), states, every)
    for k, size in enumerate(SIZES.values()):
        u = np.where(np.arange(count) > 50, 0.05 * size, 0.0)
        linear = _responses(step, held[:, :, k, None] * u[:, None, None], np.zeros(10))[-1, :, 0]
        correction = np.zeros((len(log.measured), len(CORRECTIONS)))
        correction[: count * every, k] = np.repeat(u, every)
        true = model.states(log, nominal(model), initial, (), correction)[count * every] - states[-1]
        assert np.linalg.norm((linear - true) / np.abs(states[-1]).clip(1e-3)) < 0.02 * np.linalg.norm(
            true / np.abs(states[-1]).clip(1e-3)
        )


def test_the_evidence_is_the_marginal_likelihood() -> None:
    rng = np.random.default_rng(5)
    D, y = rng.normal(size=(40, 3)), 3.0 * rng.normal(size=40)
    found = Courses({"a": slice(0, 3)}, D, y, np.zeros((1, 4)))
    white = multivariate_normal(np.zeros(40), np.eye(40)).logpdf(y)
    gains = [multivariate_normal(np.zeros(40), np.eye(40) + v * D @ D.T).logpdf(y) - white for v in VARIANCES]
    gain, left = found.evidence(["a"])
    assert gain == pytest.approx(max(gains), rel=1e-9)
    v = VARIANCES[int(np.argmax(gains))]
    rest = y - D @ np.linalg.solve(D.T @ D + np.eye(3) / v, D.T @ y)
    assert left == pytest.approx(rest @ rest / (y @ y))


def test_it_says_nothing_where_the_rig_file_holds_effects_or_the_run_has_no_end(model: RigModel, log: Signals) -> None:
    holding = RigModel(load_rig())
    holding.__dict__["configured"] = (Active("leak", "front", (1e-7,)),)
    assert latent_places(holding, log, nominal(model)) == ()
    wild = replace(log, road=np.where(np.arange(len(log.road))[:, None] > 100, 1e6, log.road))
    assert latent_places(model, wild, nominal(model)) == ()


def test_what_is_quicker_than_the_splines_is_not_told(model: RigModel, log: Signals) -> None:
    measured = log.measured.copy()
    measured[:, 0] += 1e-3 * np.sin(2.0 * np.pi * 60.0 * np.arange(len(measured)) * log.period)
    assert latent_places(model, replace(log, measured=measured), nominal(model)) == ()


def test_every_input_is_a_column_of_the_corrected_kernel() -> None:
    assert {name for own in INPUTS.values() for name in own} == set(CORRECTIONS)
