# SPDX-License-Identifier: Apache-2.0
"""Structures of many effects, on a model whose outputs are sums of known signals: what is found is known exactly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest
from helpers.driven_log import DrivenLog

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit, secant
from pneumo_ros.diagnosis.model import PlainEffect
from pneumo_ros.diagnosis.search import exchange, growth
from pneumo_ros.diagnosis.search.competition import compete
from pneumo_ros.diagnosis.search.exchange import exchanged_in_place, one_exchanged, without
from pneumo_ros.diagnosis.search.fitting import probed_one
from pneumo_ros.diagnosis.search.growth import MISFIT, _one_more, _polished, _refine, grow
from pneumo_ros.diagnosis.search.parts import reduced, rival
from pneumo_ros.diagnosis.search.screening import all_parts, candidate_scores, compatible, trials
from pneumo_ros.diagnosis.search.selection import Thresholds, likeliest, score, select
from pneumo_ros.diagnosis.search.state import Effort, Search
from pneumo_ros.effects.parameters import Active, EffectParameter, Parameter
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.rig import load_rig

ROWS, PERIOD, NOISE = 4000, 5e-3, 0.02
RNG = np.random.default_rng(11)
TIME = np.arange(ROWS) * PERIOD
FREQUENCIES = {"a": 0.9, "b": 1.7, "c": 2.6, "d": 3.8, "other": 5.2, "drive": 0.4}  # Hz
SIGNALS = {name: np.sin(2.0 * np.pi * f * TIME + RNG.uniform(0.0, 6.0)) for name, f in FREQUENCIES.items()}
TRUE = ("a", "b", "c", "d")
SIGNALS["decoy"] = sum(SIGNALS[name] for name in TRUE) + 0.4 * SIGNALS["other"]  # looks better than any of them alone


def _effects() -> dict[str, PlainEffect]:
    size = (EffectParameter("size", "1", -5.0, 5.0, 0.3, size=True),)
    out = {name: PlainEffect(name, ("",), size) for name in (*TRUE, "decoy")}
    return out | {name: PlainEffect(name, ("left", "right", "both"), size) for name in ("gauge", "scale")}


@dataclass(frozen=True)
class Sum:
    """Output: gain times the drive and the active signals."""

    channels: tuple[str, ...] = ("y",)
    parameters: tuple[Parameter, ...] = (Parameter("gain", "1", 1.0, 0.1),)
    effects: Mapping[str, PlainEffect] = field(default_factory=_effects)

    def initial(self, record: DrivenLog, active: Sequence[Active] = ()) -> tuple[Array, Array]:
        return np.zeros(1), np.full(1, 1e-3)

    def predict(
        self, record: DrivenLog, nuisance: Array, initial: Array, active: Sequence[Active], rows: int | None = None
    ) -> Array:
        out = nuisance[0] * record.drive + initial[0]
        for one in active:
            out = out + one.values[0] * SIGNALS.get(one.effect, SIGNALS["drive"] ** 3)
        return np.asarray(out[:rows, None])

    def places(self, active: Active) -> tuple[str, ...]:
        sensor = active.effect in ("gauge", "scale")
        return (f"sensor:{active.site}",) if sensor else (f"place_{active.effect}",)

    def side(self, active: Active) -> str | None:
        return None


def made(sizes: Mapping[str, float]) -> DrivenLog:
    noise = np.random.default_rng(3).normal(0.0, NOISE, ROWS)
    y = 1.04 * SIGNALS["drive"] + sum(size * SIGNALS[name] for name, size in sizes.items()) + noise
    return DrivenLog(y[:, None], SIGNALS["drive"], "made", PERIOD, NOISE)


def test_a_signal_that_resembles_four_effects_makes_room_for_them() -> None:
    problem = Problem(Sum(), (made({"a": 1.0, "b": 0.6, "c": 1.2, "d": 0.8}),))
    search = compete(problem, Effort(), True, lambda share, what: None)
    assert search.singles[0].candidate.laws == (("decoy", ""),)  # or this test would show nothing
    grow(search, Thresholds())
    refit, *others = (score(search.problem, one) for one in (search.refit, *search.finalists))
    chosen = select(refit, others, Thresholds())
    assert {name for name, _ in chosen.fit.candidate.laws} == set(TRUE)
    values = dict(zip((name for name, _ in chosen.fit.candidate.laws),
                      problem.values(chosen.fit.candidate, chosen.fit.x), strict=True))  # fmt: skip
    assert np.allclose([values[name] for name in TRUE], [1.0, 0.6, 1.2, 0.8], atol=0.01)


def three_of_four() -> tuple[Search, Fit]:
    """A search of a log with three effects, and a structure that has a fourth in place of one."""
    problem = Problem(Sum(), (made({"a": 1.0, "b": 0.6, "c": 1.2}),))
    search = compete(problem, Effort(), False, lambda share, what: None)
    wrong = Candidate((("a", ""), ("b", ""), ("d", "")))
    return search, fit(problem, wrong, problem.start(wrong, None, (0.3, 0.3, 0.3)))


def test_a_structure_without_one_effect_begins_with_its_own_sensitivities(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exchange, "FEW", 1)
    search, found = three_of_four()
    for law in found.candidate.laws:
        bare, slow = without(search, found, law), reduced(search.problem, found, (law,))
        assert bare.candidate == slow.candidate and bare.cost == pytest.approx(slow.cost, abs=1.0)
        assert bare.simulations == 2  # where it starts, and one step
        assert without(search, found, law) is bare


def test_of_all_exchanges_those_that_promise_most_are_probed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whichever effect they replace: the wrong one has one good exchange, the right ones none."""
    search, found = three_of_four()
    tried: list[tuple[Part, ...]] = []
    monkeypatch.setattr(exchange, "PROBED", 1)
    monkeypatch.setattr(exchange, "probed_one", lambda problem, base, entry: (
        tried.append((*base.candidate.parts, *entry.parts)), probed_one(problem, base, entry))[1])  # fmt: skip
    other = one_exchanged(search, found)
    assert tried == [(("a", ""), ("b", ""), ("c", ""))]
    assert other is not None and set(other.candidate.laws) == set(tried[0]) and other.cost < found.cost - 100.0


@dataclass(frozen=True)
class Sided(Sum):
    """The same, where one effect acts left, right, or on both sides; a shape of its family does something else."""

    def predict(
        self, record: DrivenLog, nuisance: Array, initial: Array, active: Sequence[Active], rows: int | None = None
    ) -> Array:
        out = nuisance[0] * record.drive + initial[0]
        for one in active:
            of_sides = {"left": ("c",), "right": ("d",), "both": ("c", "d")}
            names = of_sides.get(one.site, (one.effect,)) if one.effect != "gauge.shape" else ("b",)
            out = out + one.values[0] * sum(SIGNALS[name] for name in names)
        return np.asarray(out[:rows, None])


@dataclass(frozen=True)
class TriedAlone(PlainEffect):
    """A shape whose one atom is tried alone."""

    screened: tuple[int, ...] = (0,)


@dataclass(frozen=True)
class Loaded(Sum):
    """The same with an effect that the gain's tolerance answers for but for a trace."""

    def predict(
        self, record: DrivenLog, nuisance: Array, initial: Array, active: Sequence[Active], rows: int | None = None
    ) -> Array:
        rest = tuple(one for one in active if one.effect != "load")
        load = sum(one.values[0] for one in active if one.effect == "load")
        trace = load * (SIGNALS["drive"] + 1e-3 * SIGNALS["other"])
        return np.asarray(super().predict(record, nuisance, initial, rest, rows) + trace[:rows, None])


def test_what_an_effect_lets_the_tolerances_come_back_from_is_worth_as_much_as_what_it_explains() -> None:
    """A gain two sigma off hides a load of the same size; the log alone tells next to nothing of which it is."""
    effects = {name: one for name, one in _effects().items() if name in TRUE}
    effects["load"] = PlainEffect("load", ("",), effects["a"].parameters)
    problem, nominal = Problem(Loaded(effects=effects), (made({"drive": 0.2}),)), Candidate()
    refit = fit(problem, nominal, problem.start(nominal, None, ()))
    assert refit.x[0] == pytest.approx(2.4, abs=0.05)
    scores = candidate_scores(problem, refit, trials(problem, refit, all_parts(problem)))
    assert scores[0].parts == (("load", ""),) and scores[0].values[0] == pytest.approx(0.24, rel=0.05)
    one = Candidate(scores[0].parts)
    found = fit(problem, one, problem.start(one, refit.x, scores[0].values))
    assert refit.cost - found.cost == pytest.approx(refit.x[0] ** 2, rel=0.1)


def test_of_three_effects_one_is_exchanged_however_little_is_left() -> None:
    """A trifle beside a strained gain leaves as little as the load itself, which needs no strain."""
    effects = {name: one for name, one in _effects().items() if name in TRUE}
    effects["load"] = PlainEffect("load", ("",), effects["a"].parameters)
    problem = Problem(Loaded(effects=effects), (made({"a": 1.0, "b": 0.6, "drive": 0.2}),))
    search = compete(problem, Effort(), False, lambda share, what: None)
    wrong = Candidate((("a", ""), ("b", ""), ("c", "")))
    found = score(problem, fit(problem, wrong, problem.start(wrong, None, (0.3, 0.3, 0.01))))
    assert found.level < MISFIT
    _polished(search, found, Thresholds())
    right = [one for one in search.structures if {name for name, _ in one.candidate.laws} == {"a", "b", "load"}]
    assert right and score(problem, right[0]).stretch < 0.3 * found.stretch
    assert likeliest(score(problem, search.refit), [found, score(problem, right[0])]).fit is right[0]


def test_an_effect_at_the_wrong_site_is_exchanged_for_the_right_one() -> None:
    effects = {name: one for name, one in _effects().items() if name != "scale"}
    problem = Problem(Sided(effects=effects), (made({"a": 1.0, "c": 0.8, "d": 0.8}),))
    search = compete(problem, Effort(), False, lambda share, what: None)
    wrong = Candidate((("a", ""), ("gauge", "left")))
    found = fit(problem, wrong, problem.start(wrong, None, (0.3, 0.3)))
    other = one_exchanged(search, found)
    assert other is not None and set(other.candidate.laws) == {("a", ""), ("gauge", "both")}
    assert score(problem, other).price < score(problem, found).price
    assert one_exchanged(search, found) is other  # worked out once


def test_what_a_law_does_nothing_like_is_tried_by_its_shape_alone() -> None:
    effects = _effects()
    effects = {name: effects[name] for name in ("a", "gauge")}
    shape = TriedAlone("gauge.shape", ("left", "right", "both"), effects["gauge"].parameters)
    problem = Problem(Sided(effects=effects | {"gauge.shape": shape}), (made({"b": 1.0}),))
    search = compete(problem, Effort(), False, lambda share, what: None)
    assert search.singles[0].candidate.laws[0][0] == "gauge" and search.singles[0].candidate.shapes
    lawless = Problem(Sided(effects=effects), (made({"b": 1.0}),))
    poor = compete(lawless, Effort(), False, lambda share, what: None)
    assert score(lawless, poor.singles[0]).level > 100.0 * score(problem, search.singles[0]).level


def test_a_further_effect_is_probed_with_its_shape() -> None:
    """By its law alone the right one closes less than another effect that acts as well."""
    effects = {name: one for name, one in _effects().items() if name in ("a", "d", "gauge")}
    shape = PlainEffect("gauge.shape", ("left", "right", "both"), effects["gauge"].parameters)
    problem = Problem(
        Sided(effects=effects | {"gauge.shape": shape}), (made({"d": 1.0, "c": 0.2, "b": 1.0, "a": 0.4}),)
    )
    search = compete(problem, Effort(), False, lambda share, what: None)
    first = Candidate((("d", ""),))
    base = fit(problem, first, problem.start(first, None, (0.3,)))
    (found,) = _one_more(search, base, (10, 1, 1))
    law = found.candidate.laws[1]
    assert law[0] == "gauge" and found.candidate.shapes == (("gauge.shape", law[1]),)


@pytest.mark.parametrize(("second", "fitted"), [(0.95, {"b", "c"}), (0.85, {"b"}), (0.5, {"b"})])
def test_only_what_gains_nearly_as_much_as_the_best_is_fitted_to_the_end(second: float, fitted: set[str]) -> None:
    effects = {name: one for name, one in _effects().items() if name in TRUE}
    problem = Problem(Sum(effects=effects), (made({"a": 2.0, "b": 1.0, "c": second, "d": 0.2}),))
    search = compete(problem, Effort(), False, lambda share, what: None)
    first = Candidate((("a", ""),))
    found = _one_more(search, fit(problem, first, problem.start(first, None, (0.3,))))
    assert {one.candidate.laws[1][0] for one in found} == fitted


def test_after_an_exchange_the_effects_before_it_are_looked_at_once_more(monkeypatch: pytest.MonkeyPatch) -> None:
    size = _effects()["a"].parameters
    sites = {"a": "", "d": "", "scale": "left", "gauge": "left", "gauge.shape": "left"}
    effects = {name: PlainEffect(name, (site,), size) for name, site in sites.items()}
    problem = Problem(Sided(effects=effects), (made({"a": 1.0, "d": 0.5, "c": 0.2, "b": 1.0}),))
    search = compete(problem, Effort(), False, lambda share, what: None)
    asked: list[str] = []

    def watched(search: Search, found: Fit, bare: Fit, law: Part) -> Fit:
        asked.append(law[0])
        return exchanged_in_place(search, found, bare, law)

    monkeypatch.setattr(growth, "exchanged_in_place", watched)
    wrong = Candidate((("a", ""), ("scale", "left"), ("d", "")))
    found = fit(problem, wrong, problem.start(wrong, None, (0.3, 0.3, 0.3)))
    _refine(search, score(problem, found), Thresholds())
    assert asked == ["a", "scale", "a", "d"]
    assert {law[0] for law in search.structures[-1].candidate.laws} == {"a", "gauge", "d"}


def test_where_no_law_explains_anything_each_family_is_tried_by_its_shape() -> None:
    """Three other laws close a hair more than the right family's, and all of them next to nothing."""
    size = _effects()["a"].parameters
    sites = {"a": "", "d": "", "scale": "right", "gauge": "left", "gauge.shape": "left"}
    effects = {name: PlainEffect(name, (site,), size) for name, site in sites.items()}
    problem = Problem(Sided(effects=effects), (made({"b": 1.0, "a": 0.06, "d": 0.06}),))
    search = compete(problem, Effort(), False, lambda share, what: None)
    assert all(one.candidate.laws[0][0] != "gauge" for one in search.finalists if one.candidate.shapes)
    grow(search, Thresholds())
    refit, *others = (score(search.problem, one) for one in (search.refit, *search.finalists))
    chosen = select(refit, others, Thresholds())
    assert ("gauge", "left") in chosen.fit.candidate.laws and chosen.level < 0.01 * refit.level


def test_what_takes_an_effects_place_is_probed_with_its_shape() -> None:
    size = _effects()["a"].parameters
    sites = {"a": "", "d": "", "scale": "left", "gauge": "left", "gauge.shape": "left"}
    effects = {name: PlainEffect(name, (site,), size) for name, site in sites.items()}
    problem = Problem(Sided(effects=effects), (made({"a": 1.0, "c": 0.2, "b": 1.0, "d": 0.4}),))
    search = compete(problem, Effort(), False, lambda share, what: None)
    wrong = Candidate((("a", ""), ("scale", "left")))
    other = one_exchanged(search, fit(problem, wrong, problem.start(wrong, None, (0.3, 0.3))))
    assert other is not None and set(other.candidate.laws) == {("a", ""), ("gauge", "left")}
    assert other.candidate.shapes == (("gauge.shape", "left"),)


def test_a_secant_reproduces_the_step_and_nothing_else() -> None:
    columns = RNG.normal(size=(50, 2, 3))
    moved, change = np.array([0.2, -0.1, 0.4]), RNG.normal(size=(50, 2))
    after = secant(columns, moved, change)
    assert np.allclose(after @ moved, change)
    across = np.array([0.1, 0.2, 0.0])  # orthogonal to the step
    assert abs(across @ moved) < 1e-15 and np.allclose(after @ across, columns @ across)


def test_threads_change_no_digit() -> None:
    record = made({"a": 1.0, "b": 0.7, "c": 0.5})
    found = []
    for threads in (1, 2, 3):
        search = compete(Problem(Sum(), (record,), threads=threads), Effort(), True, lambda share, what: None)
        grow(search, Thresholds())
        found.append([(one.candidate, one.x.tolist(), one.cost) for one in (search.refit, *search.finalists)])
    assert len(found[0]) > 5
    assert found[0] == found[1] == found[2]


def test_sensors_fail_one_at_a_time_and_sites_do_not_overlap() -> None:
    model = Sum()
    assert compatible(model, ("a", ""), ("gauge", "left"))
    assert not compatible(model, ("gauge", "left"), ("scale", "right"))
    assert not compatible(model, ("gauge", "left"), ("gauge", "right"))
    assert not compatible(model, ("a", ""), ("a", ""))


@pytest.mark.parametrize(
    ("one", "other", "rivals"),
    [
        (("payload", ""), ("cg_shift", ""), True),  # both move heave and pitch, each blamed on another of them first
        (("leak", "front"), ("orifice_coefficient", "front"), True),
        (("leak", "front"), ("orifice_coefficient", "rear"), False),
        (("leak", "front"), ("coulomb_friction", "front"), False),
    ],
)
def test_rivals_act_at_one_site_on_the_same_places(one: Part, other: Part, rivals: bool) -> None:
    problem = Problem(RigModel(load_rig()), ())
    assert rival(problem, one, other) is rival(problem, other, one) is rivals
