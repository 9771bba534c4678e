# SPDX-License-Identifier: Apache-2.0
"""Fit, screening, competition and verdict on the model's own data, where the truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.own_logs import QUICK, drawn, driven, log
from helpers.rig_logs import excitation, signals_of

from pneumo_ros.diagnosis.diagnose import Options, diagnose
from pneumo_ros.diagnosis.fit.box import bounded_newton
from pneumo_ros.diagnosis.fit.command_events import timed
from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, cost_of, fit, refreshed, sensitivities
from pneumo_ros.diagnosis.fit.uncertainty import at_bounds, covariance, nuisance_estimates
from pneumo_ros.diagnosis.judge.held_out import bootstrap_shrink, channel_gaps, free_run, total_gap
from pneumo_ros.diagnosis.search.fitting import starts_elsewhere
from pneumo_ros.diagnosis.search.parts import with_parts
from pneumo_ros.diagnosis.search.screening import all_parts, candidate_scores, trials, visibility
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig


@pytest.fixture(scope="module")
def model() -> RigModel:
    return RigModel(load_rig())


def test_refit_gives_back_what_the_log_was_made_with(model: RigModel) -> None:
    truth = drawn(model, 3)
    record, held = log(model, 1, truth), log(model, 2, truth)
    problem = Problem(model, (record,))
    start = problem.start(Candidate(), None, ())
    found = fit(problem, Candidate(), start, iterations=12)
    nominal = np.array([p.nominal for p in model.parameters])
    before, after = (total_gap(channel_gaps(held, free_run(model, held, n, ())))
                     for n in (nominal, problem.nuisance(found.x)))  # fmt: skip
    assert after < 0.01 < 0.1 < before
    found = sensitivities(problem, found)
    estimates = nuisance_estimates(problem, found, covariance(problem, found))
    off = [(estimates[p.name].value - t) / max(estimates[p.name].std, 1e-3 * p.std)
           for p, t in zip(model.parameters, truth, strict=True)]  # fmt: skip
    assert np.sqrt(np.mean(np.square(off))) < 2.5


def test_what_is_wrong_with_one_sensor_does_not_drown_the_others() -> None:
    """Halving what any channel leaves is worth the same, however much another one leaves."""
    rng = np.random.default_rng(5)
    left = rng.normal(size=(3000, 3)) * np.array([2.0, 2.0, 400.0])
    every, x, prior = slice(None), np.zeros(0), np.zeros(0)
    whole = cost_of(left, every, x, prior)
    halved = [cost_of(left * np.where(np.arange(3) == k, 0.5, 1.0), every, x, prior) for k in range(3)]
    # What is added to a mean square of 1 keeps its logarithm from falling all the way.
    np.testing.assert_allclose(whole - np.array(halved), 3000 * 3 / 10 / 3 * np.log(4.0), rtol=0.03)


def test_bounded_newton_stays_inside_and_is_optimal() -> None:
    rng = np.random.default_rng(0)
    A = rng.normal(size=(30, 6))
    H, g = A.T @ A, rng.normal(size=6) * 30.0
    low, high = np.full(6, -0.3), np.full(6, 0.3)
    move = bounded_newton(H, g, low, high)
    gradient = H @ move + g
    inside = (move > low + 1e-9) & (move < high - 1e-9)
    assert np.all(move >= low) and np.all(move <= high) and (~inside).any()
    assert np.max(np.abs(gradient[inside]), initial=0.0) < 1e-8
    assert np.all(gradient[move >= high - 1e-9] < 1e-8) and np.all(gradient[move <= low + 1e-9] > -1e-8)


def test_screening_ranks_the_true_effect_first(model: RigModel) -> None:
    record = log(model, 1, drawn(model, 4, 0.5), (Active("valve_lag", "rear", (0.02, 0.8)),))
    problem = Problem(model, (record,))
    refit = fit(problem, Candidate(), problem.start(Candidate(), None, ()), iterations=6)
    ranked = candidate_scores(problem, refit, trials(problem, refit, all_parts(problem)))
    assert (("valve_lag", "rear"),) in [p.parts for p in ranked[:2]] and ranked[0].share > 0.8


def test_a_law_beside_an_atom_that_is_the_same_does_not_spoil_the_screening(model: RigModel) -> None:
    """A viscous tyre and the linear atom of its shape have one sensitivity twice: the rest is seen beside them."""
    truth = Active("tyre_damping", "both", (12.0,)), Active("leak", "front", (3e-7, 0.0))
    problem = Problem(model, (log(model, 1, drawn(model, 4, 0.5), truth),))
    bare = Candidate((("tyre_damping", "both"),))
    alone = fit(problem, bare, problem.start(bare, None, (12.0,)), iterations=4)
    shaped = with_parts(problem, alone, (("tyre_damping.shape", "both"),), 4)
    assert len(shaped.candidate.parts) == 2
    base = refreshed(problem, shaped)
    ranked = candidate_scores(problem, base, trials(problem, base, all_parts(problem)))
    shares = {one.parts[0]: one.share for one in ranked}
    assert shares["orifice_coefficient", "front"] > 0.3, "a leak, by another name"
    assert shares.get(("tyre_damping", "rear"), 0.0) < 0.05, "the base does that itself"


def test_a_shape_that_is_not_linear_starts_where_it_promises_most(model: RigModel) -> None:
    """A fold that swings against the ground at 11 Hz, beside a law that has ended at 5 Hz."""
    truth = Active("bellows_mode.shape", "both", (0.4, 11.0, 0.06, 0.0, 0.5, 1.0, 0.0))
    problem = Problem(model, (log(model, 1, None, (truth,)),))
    law = Candidate((("bellows_mode", "both"),))
    alone = fit(problem, law, problem.start(law, None, (0.2, 5.0, 0.2, 0.5)), iterations=6)
    shaped = with_parts(problem, alone, (("bellows_mode.shape", "both"),), 12)
    frequency = problem.values(shaped.candidate, shaped.x)[5]
    assert 9.5 < frequency < 12.5 and shaped.cost < 0.0 < 1000.0 < alone.cost


def test_a_candidate_that_runs_away_loses_and_does_not_raise(model: RigModel) -> None:
    problem = Problem(model, (log(model, 1),))
    wild = Candidate((("effective_area_error", "both"),))
    start = problem.start(wild, None, (-0.4, -1.5))
    nominal = fit(problem, Candidate(), problem.start(Candidate(), None, ()), iterations=1).cost
    assert fit(problem, wild, start, iterations=1).cost > 10.0 * nominal  # infinite counts


def test_jumps_between_samples_are_timed(model: RigModel) -> None:
    """Commands that really jumped half a sample before the row that shows them."""
    road, commands = excitation(6.0, 1)
    steps = np.repeat(np.random.default_rng(5).uniform(0.75, 1.25, (12, 2)), 250, axis=0)
    commands[:, :2] = trim(model.rig).command[:2] * steps
    inputs = driven(road, commands)
    events = model.events(inputs)
    assert len(events) == 22
    lead = np.random.default_rng(6).choice([0.0, 0.5], len(events))
    truth = model.advanced(inputs, events, lead)
    clean = model.simulate(truth, initial=trim(model.rig).state)
    problem = Problem(model, (signals_of(clean, road, commands, 1),))
    best = fit(problem, Candidate(), problem.start(Candidate(), None, ()), iterations=6)
    moved = timed(problem, problem, best)
    assert moved is not problem
    again = fit(moved, Candidate(), best.x, best.jacobian)
    assert np.mean(again.residual**2) < 0.5 * np.mean(best.residual**2)
    # Beside effects that move nothing, and of which nothing is known beforehand, as well.
    idle = Candidate((("bump_stop", "front"),))
    absent = problem.start(idle, best.x, (0.0, 0.004, 100.0, 0.2))
    assert timed(problem, problem, fit(problem, idle, absent, best.jacobian, iterations=1)) is not problem


def test_jumps_that_a_wrong_structure_misplaced_are_put_back(model: RigModel) -> None:
    """Jumps exactly where the log has them; a first timing has put some of them a sample early."""
    road, commands = excitation(6.0, 1)
    steps = np.repeat(np.random.default_rng(5).uniform(0.75, 1.25, (12, 2)), 250, axis=0)
    commands[:, :2] = trim(model.rig).command[:2] * steps
    inputs = driven(road, commands)
    logged = Problem(model, (signals_of(model.simulate(inputs, initial=trim(model.rig).state), road, commands, 1),))
    events = model.events(logged.records[0])
    lead = np.random.default_rng(6).choice([0.0, 1.0], len(events))
    wrong = Problem(model, (model.advanced(logged.records[0], events, lead),))
    best = fit(wrong, Candidate(), wrong.start(Candidate(), None, ()), iterations=6)
    again = timed(logged, wrong, best)
    assert again is not wrong
    left, before = (np.sqrt(np.mean((p.records[0].commands - logged.records[0].commands) ** 2)) for p in (again, wrong))
    assert left < 0.4 * before


def test_a_channel_at_half_the_rate_counts_where_it_was_sampled(model: RigModel) -> None:
    record = log(model, 1)
    weight = record.weight.copy()
    weight[1::2, 4:] = 0.0
    measured = record.measured.copy()
    measured[1::2, 4:] += 1e4  # whatever fills the rows without a sample must not count
    slower = Problem(model, (replace(record, measured=measured, weight=weight),))
    whole = Problem(model, (record,))
    assert (slower.weight[:, 4:] > 0.0).all() and np.allclose(slower.weight[:, :4], whole.weight[:, :4])
    assert (slower.weight[:, 4:] < whole.weight[:, 4:]).all()  # fewer samples, more noise
    start = whole.start(Candidate(), None, ())
    here, there = (p.residual(Candidate(), start)[:, 4:] for p in (slower, whole))
    assert np.sqrt(np.mean(here**2)) == pytest.approx(np.sqrt(np.mean(there**2)), rel=0.25)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("truth", "verdict", "side", "place"),
    [
        ((), "none", None, None),
        ((Active("leak", "front", (3e-7, 0.0)),), "leak", "front", "front_air"),
        ((Active("lvdt_scale", "sprung_rear", (0.03,)),), "lvdt_scale", None, "sensor:sprung_rear"),
    ],
)
def test_verdict_side_and_place(
    model: RigModel, truth: tuple[Active, ...], verdict: str, side: str | None, place: str | None
) -> None:
    nuisance = drawn(model, 8)
    found = diagnose(model, [log(model, 1, nuisance, truth)], log(model, 2, nuisance, truth), Options(effort=QUICK))
    assert found.verdict == verdict
    assert found.location == () if place is None else found.location[0][0] == place
    assert found.probability > 0.3
    if truth:
        best = next(r for r in found.ranking if r.effects == (truth[0].effect,))
        assert best.side == side and best.shrink > 0.8
        assert best.shrink_ci90[0] <= best.shrink <= best.shrink_ci90[1]
        assert found.gap.best < found.gap.refit < found.gap.nominal
        estimate = next(iter(best.parameters.values()))
        assert abs(estimate.value - truth[0].values[0]) < 3.0 * estimate.std + 0.02 * abs(estimate.value)


def test_what_is_withheld_does_not_compete(model: RigModel) -> None:
    without = replace(model, withheld=frozenset({"leak"}))
    assert "leak" not in without.effects and "leak" in without.library
    problem = Problem(without, (log(model, 1),))
    assert all(effect != "leak" for effect, _ in all_parts(problem))


def test_bootstrap_interval_holds_the_shrink(model: RigModel) -> None:
    record = log(model, 1)
    rng = np.random.default_rng(2)
    error = rng.normal(size=record.measured.shape) * record.scale
    refit, best = record.measured + error, record.measured + 0.25 * error
    low, high = bootstrap_shrink(record, refit, best)
    assert low <= 0.75 <= high and high - low < 0.05


def test_a_rig_at_rest_shows_hardly_any_effect(model: RigModel) -> None:
    road, commands = np.zeros((1500, 2)), np.tile(trim(model.rig).command, (1500, 1))
    clean = model.simulate(driven(road, commands), initial=trim(model.rig).state)
    problem = Problem(model, (signals_of(clean, road, commands, 3),))
    refit = fit(problem, Candidate(), problem.start(Candidate(), None, ()), iterations=2)
    still = visibility(problem, refit, trials(problem, refit, all_parts(problem)))
    problem = Problem(model, (log(model, 1),))
    refit = fit(problem, Candidate(), problem.start(Candidate(), None, ()), iterations=2)
    driven_rig = visibility(problem, refit, trials(problem, refit, all_parts(problem)))
    for effect in ("coulomb_friction", "valve_lag", "tyre_damping", "exciter_lag", "pressure_lag", "bump_stop"):
        assert still[effect] < 0.5
    for effect in ("coulomb_friction", "valve_lag", "tyre_damping", "leak", "supply_droop"):
        assert driven_rig[effect] > 1.0


def test_other_shapes_and_signs_are_tried(model: RigModel) -> None:
    """A slope that is too steep, with an error of the wrong sign, fits an orifice well enough to be stuck there."""
    orifice = model.effects["orifice_coefficient"].parameters
    tried = starts_elsewhere(orifice, np.array([-0.0145, 1.65, 1.2]))
    assert tried == [[0.08, 0.5, 0.5], [-0.0145, -0.5, 1.2], [-0.0145, 1.65, 0.0]]


def test_what_nothing_tells_apart_varies_together(model: RigModel) -> None:
    """A viscous tyre and the linear atom of its shape: each alone is unknown, no variance is below zero, and their sum
    is known as well as the law alone would be.
    """
    problem = Problem(model, (log(model, 1, None, (Active("tyre_damping", "both", (12.0,)),)),))

    def spread(parts: tuple[tuple[str, str], ...], sizes: list[float]) -> np.ndarray:
        candidate = Candidate(parts)
        found = fit(problem, candidate, problem.start(candidate, None, sizes), iterations=3)
        return covariance(problem, sensitivities(problem, found))

    law, shape = ("tyre_damping", "both"), ("tyre_damping.shape", "both")
    alone, k = spread((law,), [12.0])[-1, -1], problem.fixed
    atoms = problem.effect_parameters(Candidate((shape,)))
    both = spread((law, shape), [6.0, 6.0, *(0.1 * p.typical for p in atoms[1:])])
    assert np.diag(both).min() >= 0.0 and both[k, k] > 1e4 * alone
    assert both[k : k + 2, k : k + 2].sum() == pytest.approx(alone, rel=0.3)


@pytest.mark.parametrize(
    ("effect", "values", "bounded"),
    [
        ("bump_stop", (2e4, 0.004, 0.0, 0.0), 0),  # a stop without hardening or loss
        ("bump_stop", (2e4, 0.014, 100.0, 2.0), 0.5),  # two that shape it
        ("bellows_mode", (0.2, 12.0, 0.08, 1.0), 0),  # all of the damping is the wall's own
        ("bellows_mode", (2.0, 40.0, 0.08, 1.0), 1.5),  # its size, and its frequency
        ("bellows_mode", (1e-6, 12.0, 0.08, 0.5), 0),  # nothing, but for where the fit ended
    ],
)
def test_natural_ends_of_a_law_are_no_bounds(
    model: RigModel, effect: str, values: tuple[float, ...], bounded: float
) -> None:
    problem, candidate = Problem(model, (log(model, 1),)), Candidate(((effect, "front"),))
    x = problem.start(candidate, None, values)
    assert at_bounds(problem, Fit(candidate, x, 0.0, np.zeros((1, 6)))) == (bounded, 0.0)


def test_what_bends_a_shape_is_counted_by_itself_and_a_law_beside_it_half(model: RigModel) -> None:
    parts = (("bellows_mode", "front"), ("bellows_mode.shape", "front"))
    problem, candidate = Problem(model, (log(model, 1),)), Candidate(parts)
    x = problem.start(candidate, None, (2.0, 12.0, 0.08, 0.5, 0.1, 3.0, 0.25, 0.0, 0.5, 0.5, 2e4))
    assert at_bounds(problem, Fit(candidate, x, 0.0, np.zeros((1, 6)))) == (0.5, 1.0)


@pytest.mark.parametrize("law", [0.0, 0.35])
def test_a_share_of_a_shape_at_its_bound_counts_half(model: RigModel, law: float) -> None:
    """A command that is taken every 50 ms twice over is later by 50 ms in the mean: law and other atoms can do it."""
    parts = (("transport_delay", "rear"), ("transport_delay.shape", "rear"))
    problem, candidate = Problem(model, (log(model, 1),)), Candidate(parts)
    parameters = problem.effect_parameters(candidate)
    late = {"delay": law * parameters[0].high, "taken": 2.0, "interval": 0.05, "phase": 0.5}
    x = problem.start(candidate, None, [late.get(p.name, 0.0) for p in parameters])
    assert at_bounds(problem, Fit(candidate, x, 0.0, np.zeros((1, 6)))) == (0.5, 0.0)
