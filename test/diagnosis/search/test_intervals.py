# SPDX-License-Identifier: Apache-2.0
"""A driver that takes the valves' command at intervals of its own: found in the log, whatever else is missing."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from helpers.own_logs import driven
from helpers.rig_logs import RATE, excitation, signals_of

from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import fit, refreshed
from pneumo_ros.diagnosis.search.competition import compete
from pneumo_ros.diagnosis.search.fitting import by_cost
from pneumo_ros.diagnosis.search.growth import _rescanned
from pneumo_ros.diagnosis.search.intervals import interval_words, intervals
from pneumo_ros.diagnosis.search.parts import with_shapes
from pneumo_ros.diagnosis.search.screening import as_scanned
from pneumo_ros.diagnosis.search.selection import score
from pneumo_ros.diagnosis.search.state import Effort, Search
from pneumo_ros.effects.contract import Ends, Inputs
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig

MODEL = RigModel(load_rig())
SHAPE = MODEL.library["transport_delay.shape"]
INTERVAL, PHASE = 0.0613, 0.6  # s, of the interval
SECONDS = 8.0
DRIVER = tuple({"taken": 1.0, "interval": INTERVAL, "phase": PHASE}.get(p.name, 0.0) for p in SHAPE.parameters)
TAKEN = Active("transport_delay.shape", "front", DRIVER)
# The refit leaves a gap of 0.45 with it alone, of 0.13 with the driver alone.
BESIDE = Active("valve_lag", "rear", (0.036, 0.8))


def values_of(found: tuple[float, ...]) -> dict[str, float]:
    return dict(zip((p.name for p in SHAPE.parameters), found, strict=True))


def problem_of(*active: Active) -> Problem:
    """A log with valve steps: a driver's interval and half of it as a delay are one thing to a slow command."""
    road, commands = excitation(SECONDS, 4)
    rng = np.random.default_rng(7)
    lengths = rng.integers(RATE // 10, RATE // 2, round(10 * SECONDS))
    commands[:, :2] *= np.repeat(rng.uniform(0.6, 1.4, (len(lengths), 2)), lengths, axis=0)[: len(commands)]
    clean = MODEL.simulate(driven(road, commands), None, trim(MODEL.rig).state, active)
    return Problem(MODEL, (signals_of(clean, road, commands, 4, "steps"),))


def scanned(problem: Problem) -> dict[tuple[str, str], tuple[float, ...]]:
    start = fit(problem, Candidate(), problem.start(Candidate(), None, ()), iterations=20)
    return intervals(problem, refreshed(problem, start))


def test_the_interval_is_found_beside_something_larger() -> None:
    problem = problem_of(TAKEN, BESIDE)
    found = values_of(scanned(problem)["transport_delay.shape", "front"])
    assert found["interval"] == pytest.approx(INTERVAL, abs=INTERVAL**2 / (2.0 * SECONDS))
    assert found["taken"] == 1.0 and found["delay 0.016 s"] == 0.0
    middle = 0.5 * SECONDS  # there the instants of both must agree: far from it phase stands against interval
    late = (middle / found["interval"] - found["phase"]) - (middle / INTERVAL - PHASE)
    assert abs(late - round(late)) < 0.15


@pytest.mark.parametrize(("interval", "phase"), [(0.0713, 0.3), (0.095, 0.45)])
def test_a_scan_ends_within_a_twentieth_of_an_interval(interval: float, phase: float) -> None:
    """Phases are scanned by eighths; begun that far off, a fit stays there."""
    driver = tuple({"taken": 1.0, "interval": interval, "phase": phase}.get(p.name, 0.0) for p in SHAPE.parameters)
    found = values_of(scanned(problem_of(replace(TAKEN, values=driver)))["transport_delay.shape", "front"])
    middle = 0.5 * SECONDS
    late = (middle / found["interval"] - found["phase"]) - (middle / interval - phase)
    assert abs(late - round(late)) < 0.05


def test_a_valve_that_lags_is_no_driver_though_one_is_scanned_for() -> None:
    problem = problem_of(BESIDE)
    search = compete(problem, Effort(singles=4, finalists=2), False, lambda share, what: None)
    assert search.best.candidate.laws == (("valve_lag", "rear"),)
    problem = replace(search.problem, scanned=scanned(search.problem))
    start = as_scanned(problem, ("transport_delay", "rear"))
    assert start is not None, "a slow valve has an interval that explains some of it"
    driver = Candidate(start.parts)
    found = fit(problem, driver, problem.start(driver, search.refit.x[: problem.fixed], start.values), iterations=10)
    assert search.best.cost < found.cost


def test_a_scanned_driver_explains_the_log_to_its_noise() -> None:
    search = compete(problem_of(TAKEN), Effort(singles=4, finalists=2), False, lambda share, what: None)
    best = by_cost(search.finalists)[0]
    assert best.candidate.laws == (("transport_delay", "front"),)
    assert score(search.problem, best).level < 1.0 < 0.01 * score(search.problem, search.refit).level
    parameters = search.problem.effect_parameters(best.candidate)
    values = search.problem.values(best.candidate, best.x)
    found = dict(zip((p.name for p in parameters), map(float, values), strict=True))
    assert found["interval"] == pytest.approx(INTERVAL, rel=1e-3)
    (words,) = interval_words(search.problem, best)
    assert words == "transport delay (front): the command is taken every 61.3 ms and kept until the next time"
    assert interval_words(search.problem, search.refit) == []
    assert found["delay"] + sum(v for name, v in found.items() if name.startswith("delay 0")) < 0.1


def test_a_fitted_delay_gives_way_to_what_the_scan_found() -> None:
    problem = problem_of(TAKEN)
    problem = Problem(MODEL, problem.records, scanned=scanned(problem))
    start = as_scanned(problem, ("transport_delay", "front"))
    assert start is not None and start.values[0] == 0.0
    law = Candidate((("transport_delay", "front"),))
    late = fit(problem, law, problem.start(law, None, (0.5 * INTERVAL,)), iterations=10)
    both = with_shapes(problem, late, 8)
    assert both.cost < 0.5 * late.cost


def test_intervals_are_scanned_once_more_beside_what_was_found_without_its_delay() -> None:
    """Where a structure explains a slow valve and calls the driver a delay; one with its intervals is left alone."""
    problem = problem_of(TAKEN, BESIDE)
    start = fit(problem, Candidate(), problem.start(Candidate(), None, ()), iterations=20)
    search = Search(problem, problem, start, Effort(), lambda share, what: None)
    laws = Candidate((("valve_lag", "rear"), ("transport_delay", "front")))
    found = fit(problem, laws, problem.start(laws, None, (0.03, 0.8, 0.5 * INTERVAL)), iterations=10)
    assert _rescanned(search, found)
    (better,) = search.structures
    assert set(better.candidate.laws) == set(laws.laws) and better.cost < found.cost
    values = problem.values(better.candidate, better.x).tolist()[-len(SHAPE.parameters) :]
    assert values_of(tuple(values))["interval"] == pytest.approx(INTERVAL, abs=INTERVAL**2 / (4.0 * SECONDS))
    assert not _rescanned(search, better) and search.structures == [better]


def test_a_command_that_stands_still_is_not_scanned() -> None:
    road, commands = excitation(6.0, 4)
    still = driven(road, np.tile(commands[:1], (len(commands), 1)))
    assert [MODEL.amount(still, column) for column in MODEL.columns("both")] == [0.0] * 4
    assert scanned(Problem(MODEL, (still,))) == {}


def test_what_a_driver_takes_is_the_mean_over_each_row_whatever_the_blocks() -> None:
    fine, period = 40, 1.0 / RATE
    command = np.random.default_rng(2).uniform(0.0, 1e-6, 1500)
    inside = np.repeat(command, fine)
    time = period * np.arange(len(inside)) / fine + 1e-12
    count = np.floor((time - PHASE * INTERVAL) / INTERVAL)
    instants = np.maximum(PHASE * INTERVAL + count * INTERVAL, 0.0)
    taken = inside[np.floor(instants / period * fine + 1e-6).astype(int)]
    wanted = np.where(count >= 0, taken, command[0])
    record = driven(np.zeros((len(command), 2)), np.tile(command[:, None], (1, 4)))
    rows = np.arange(len(command) + 1)
    (off,) = MODEL.kept_off(record, 0, np.array([[INTERVAL, PHASE]]), rows)
    got = command + off
    assert np.allclose(got, wanted.reshape(-1, fine).mean(axis=1), atol=1.1e-6 / fine)
    assert SHAPE.inputs is not None
    whole = SHAPE.inputs(Inputs(record.commands, record.road), period, Ends(True, False), DRIVER, None)[0].commands
    assert np.allclose(whole[:, 0], got, rtol=1e-9) and np.array_equal(whole[:, 1], command)
    moments = np.array([0, 20, 45, 1500])
    (means,) = MODEL.kept_off(record, 0, np.array([[INTERVAL, PHASE]]), moments)
    assert np.allclose(means, [off[a:b].mean() for a, b in pairwise(moments)], atol=1e-15)
    memory, blocks = None, []
    for rows in (slice(0, 33), slice(33, 34), slice(34, 1500)):
        given = Inputs(record.commands[rows], record.road[rows])
        block, memory = SHAPE.inputs(given, period, Ends(True, False), DRIVER, memory)
        blocks.append(block.commands)
    assert np.array_equal(np.vstack(blocks), whole)
