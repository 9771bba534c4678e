# SPDX-License-Identifier: Apache-2.0
"""The report page and the log of residuals: complete, self-contained, true to the numbers they are given."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html import escape, unescape
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from helpers.findings import PLACES, findings
from helpers.rig_logs import signals_of, simulated

from pneumo_ros.diagnosis.half_car.signals import MEASURED
from pneumo_ros.diagnosis.report import render, write_outputs, write_report, write_residual_log
from pneumo_ros.diagnosis.report.facts import _curve_words
from pneumo_ros.diagnosis.report.plots import Line, plot, thinned, ticks
from pneumo_ros.diagnosis.report.quantities import readable, rounded
from pneumo_ros.diagnosis.report.rig_map import colour, draw_map
from pneumo_ros.diagnosis.report.steps import Asked, next_steps
from pneumo_ros.diagnosis.report.words import (
    confidence,
    headline,
    percent,
    place_words,
    ranking_words,
)
from pneumo_ros.diagnosis.result import Diagnosis, Estimate, Gap, Ranked
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.errors import InputError
from pneumo_ros.log.reading import read_log
from pneumo_ros.rig import load_rig


class Balance(HTMLParser):
    """Every element that is opened is closed, in order."""

    VOID = ("meta", "br", "hr", "img", "input", "link")

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.seen.append(tag)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: object) -> None:
        self.seen.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_page_is_whole_and_refers_to_nothing_outside() -> None:
    page = render(findings())
    checker = Balance()
    checker.feed(page)
    assert checker.open == [] and checker.seen.count("svg") >= 10
    assert not re.search(r"(src|href)\s*=|url\(|@import|<script", page)
    assert "nan" not in re.sub(r"[a-z]nan|nan[a-z]", "", page.lower())


def test_the_page_says_verdict_place_size_and_shrink() -> None:
    page = render(findings())
    assert "At the front, the spring leaks." in page and "sure: 97 %" in page
    assert "by 98 % (90 % interval 96 % to 99 %)" in page
    assert "the front air and valve" in page and "93 %" in page
    assert "0.4100 ± 0.0020" in page and "mm²" in page
    assert "orifice coefficient: an orifice" in page
    assert "Open both inlets fully. It would drive the rivals 31 times the noise apart" in page
    assert "droop ended at its bound" in page and "not testable here: the spring never came near it" in page
    assert "heavier.mcap (sprung mass +10.0 %): gap 1.3 nominal, 0.5 re-estimated, 0.02" in page
    assert "held&lt;out&gt;.mcap" in page and "held<out>" not in page


@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        ("none", "No unmodelled effect"),
        ("unknown", "no listed effect explains, at the front air"),
        ("not_testable", "cannot tell"),
    ],
)
def test_every_kind_of_verdict_has_its_sentence(verdict: str, said: str) -> None:
    assert said in headline(findings(verdict).summary, {})
    assert said in render(findings(verdict))


def test_an_unknown_cause_shows_how_far_its_place_reaches() -> None:
    page = render(replace(findings("unknown"), mended=0.0123))
    assert "that place mended freely" in page and ">0.0123<" in page
    assert "that place mended freely" not in render(findings("unknown"))


def test_a_pair_is_named_with_both_effects() -> None:
    summary = dict(findings().summary)
    summary |= {"verdict": "leak+valve_lag"}
    summary["ranking"] = [{**summary["ranking"][0], "effects": ["leak", "valve_lag"], "sites": ["front", "both"]}]
    words = headline(summary, {"leak": "a leak", "valve_lag": "a slow valve"})
    assert words == "At the front, a leak; and at both ends, a slow valve."
    summary["budget"] = [{"effects": ["leak"], "law": "differs"}, {"effects": ["valve_lag"], "law": "valve_lag.second"}]
    words = headline(summary, {"leak": "a leak", "valve_lag": "a slow valve", "valve_lag.second": "a valve that rings"})
    assert words == "At the front, leak, but by another law than the library's; and at both ends, a valve that rings."


def test_a_measured_law_says_its_units_and_where_half_of_it_is_done() -> None:
    points = [[t, min(t / 0.03, 1.0), 0.0, 1.0, 1.0] for t in np.linspace(0.0, 0.3, 61)]
    curve = {
        "x": {"name": "time after a step", "unit": "s"},
        "y": {"name": "share that acts", "unit": "1"},
        "points": points,
    }
    assert (
        _curve_words(curve)
        == "share that acts over time after a step: 0 at 0 ms, 1 at 300 ms, half of the way at 15 ms"
    )
    line = {**curve, "points": [[t, t, 0.0, 1.0, 1.0] for t in (0.0, 0.1, 0.2)]}
    assert _curve_words(line) == "share that acts over time after a step: 0 at 0 ms, 0.2 at 200 ms"


def test_next_to_nothing_is_not_below_nothing() -> None:
    assert [percent(share) for share in (-0.0004, 0.0004, -0.012, 0.996)] == ["0 %", "0 %", "-1 %", "99.6 %"]


def test_every_verdict_says_what_to_do_next() -> None:
    found = findings()
    asked = Asked((Path("logs/a.mcap"),), Path("logs/b.mcap"), Path("out dir"))
    first, second = next_steps(found.summary, asked)
    played, diagnosed = first.commands
    assert "--road 'out dir/next_experiment_road.csv'" in played and "--output logs/second.mcap" in played
    assert diagnosed == "pneumo diagnose logs/a.mcap logs/second.mcap --holdout logs/b.mcap --output 'out dir-2'"
    assert "the front air and valve" in second.text and "--save-rig 'out dir/rig.yaml'" in second.commands[0]
    page = render(replace(found, asked=asked))
    assert "The commands that play it on the rig of these logs stand at the top" in page
    assert "In the folder of this page" not in page  # that one would have driven the nominal rig
    assert escape(second.text) in re.sub("</?span[^>]*>", "", page) and diagnosed in unescape(page)
    assert '<span class="option">--rig</span>' in page  # not broken over two lines
    assert "Only a session of the rig that made the logs tells" in first.text  # they do not say which one it was
    bench = Asked((Path("a.mcap"),), rig_options=("--source", "serial", "--port", "/dev/ttyACM0"))
    assert next_steps(found.summary, bench)[0].commands[0].startswith("pneumo run --source serial --port /dev/ttyACM0 ")
    assert "--source serial" not in next_steps(found.summary, bench)[0].text
    clear = {**found.summary, "next_experiment": None}
    assert "--source serial" in next_steps({**clear, "verdict": "unknown"}, bench)[0].commands[0]
    assert [len(next_steps({**clear, "verdict": verdict})) for verdict in ("none", "unknown", "leak")] == [1, 2, 1]
    closer, idea = next_steps({**clear, "verdict": "unknown"}, asked)
    assert "the front air and valve" in closer.text and "--effect MY_EFFECT.py" in idea.commands[0]
    assert "second session" in next_steps({**clear, "probability": 0.4}, asked)[0].text
    kept = next_steps(clear, replace(asked, rig=Path("r.yaml")))
    assert kept[0].commands == ("pneumo run --rig r.yaml",)


def test_without_a_verdict_nothing_looks_like_one() -> None:
    """The same numbers, but the log forbids a verdict: neither place nor candidate nor size is shown."""
    summary = {**findings().summary, "verdict": "not_testable", "probability": 0.0,
               "notes": ["a.mcap: Only these channels are usable: front_pressure; no verdict."]}  # fmt: skip
    page = render(replace(findings(), summary=summary))
    assert headline(summary, {}) == "No verdict. a.mcap: Only these channels are usable: front_pressure."
    assert confidence(summary) == "no verdict" and "record the session again" in page
    assert "What competed" not in page and "leak" not in page and colour(0.93) not in page


def test_the_verdict_itself_is_no_rival_of_its_own() -> None:
    alone = {**findings().summary, "ambiguity_group": ["leak"], "next_experiment": None}
    assert "cannot tell apart" not in render(replace(findings(), summary=alone))
    pair = {**alone, "ambiguity_group": ["leak", "leak+orifice_coefficient"]}
    assert "leak and orifice coefficient: the spring leaks and an orifice" in render(replace(findings(), summary=pair))


@pytest.mark.parametrize(("verdict", "words"), [("none", "These are not excluded"), ("unknown", "These come closest")])
def test_what_is_not_excluded_is_listed_without_a_name_as_well(verdict: str, words: str) -> None:
    summary = {**findings().summary, "verdict": verdict, "ambiguity_group": ["leak"], "next_experiment": None}
    page = render(replace(findings(), summary=summary))
    assert words in page and "<li>leak: the spring leaks" in page


@pytest.mark.parametrize("place", PLACES)
def test_every_place_is_on_the_map(place: str) -> None:
    drawing = draw_map({place: 0.8})
    group = re.search(rf'<g data-place="{place}">(.*?)</g>', drawing, re.DOTALL)
    assert group is not None and colour(0.8) in group.group(1)
    assert "80 %" in drawing and drawing.count(colour(0.8)) <= group.group(1).count(colour(0.8))
    assert place_words(place).startswith("the ")


def test_thinning_keeps_the_extremes() -> None:
    values = np.random.default_rng(0).normal(size=20_000)
    values[[7001, 13_337]] = 50.0, -50.0
    kept = thinned(values)
    assert len(kept) < 1000 and {7001, 13_337} <= set(kept.tolist())
    assert np.all(np.diff(kept) > 0)


def test_a_gap_in_the_data_is_a_gap_in_the_line() -> None:
    t = np.arange(100) * 0.01
    values = np.sin(t)
    values[40:60] = np.nan
    drawing = plot(t, [Line("log", "log", values)], "mm")
    path = re.search(r'class="line log" d="([^"]*)"', drawing)
    assert path is not None and path.group(1).count("M") == 2 and "nan" not in drawing


def test_ticks_are_round_and_inside() -> None:
    assert ticks(-0.03, 0.11, 4) == [0.0, 0.05, 0.1]
    assert ticks(1.0, 1.0, 4) == []


def test_numbers_read_well() -> None:
    assert rounded(16.234, 0.31) == "16.23 ± 0.31"
    assert rounded(3.14159, 0.0) == "3.142"
    assert readable("m2", np.array([4e-7])) == ("mm²", 1e6)
    assert readable("Pa", np.array([3e5])) == ("kPa", 1e-3)
    assert readable("N", np.array([3.0])) == ("N", 1.0)


def test_the_report_appears_complete_or_not_at_all(tmp_path: Path) -> None:
    write_report(tmp_path / "report.html", findings())
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]
    with pytest.raises(InputError, match="cannot write the report"):
        write_report(tmp_path / "missing" / "report.html", findings())


def test_the_residual_log_holds_what_was_measured_and_predicted(tmp_path: Path) -> None:
    found = findings()
    weight = found.holdout.weight.copy()
    weight[10:20, 4] = 0.0
    log = found.holdout.__class__(**{**found.holdout.__dict__, "weight": weight})
    path = tmp_path / "residual.mcap"
    for _ in range(2):  # an older one is replaced
        write_residual_log(path, log, found.trajectories)
    back = read_log(path)
    measured = back.select("/measured/rig/displacement", MEASURED[:4])
    np.testing.assert_array_equal(measured.position, log.measured[:, :4])
    corrected = back.select("/corrected/rig/displacement", MEASURED[:4])
    residual = back.select("/residual/rig/displacement", MEASURED[:4])
    np.testing.assert_allclose(residual.position, measured.position - corrected.position, atol=1e-15)
    pressure = back.pressure("/measured/rig/front/pressure").value
    assert np.all(np.isnan(pressure[10:20])) and np.isfinite(pressure).sum() == len(pressure) - 10
    assert np.all(np.diff(measured.stamp_ns) == 2_000_000)
    assert back.config == log.rig and {"/nominal/rig/rear/pressure", "/refit/rig/displacement"} <= set(back.topics)


def test_all_files_of_a_diagnosis_are_written(tmp_path: Path) -> None:
    """A rig with a leak, diagnosed by hand: the page shows what is missing as a flow over a quantity."""
    model = RigModel(load_rig())
    active = (Active("leak", "front", (4e-7,)),)
    logs = []
    for seed in (4, 5):
        clean, road, commands = simulated(8.0, seed)
        carrier = signals_of(clean, road, commands, seed)
        logs.append(signals_of(model.simulate(carrier, active=active), road, commands, seed, f"log{seed}.mcap"))
    fit, holdout = logs
    nominal, best = model.simulate(holdout), model.simulate(holdout, active=active)
    gap = Gap(1.0, 0.9, 0.01, 0.004, {name: {"nominal": 1.0, "refit": 0.9, "best": 0.01} for name in MEASURED})
    ranked = Ranked(
        ("leak",), ("front",), "front", 0.97, {"leak_area": Estimate(4e-7, 1e-9, "m2")}, 0.01, 0.99, (0.98, 0.99)
    )
    runs = {"nominal": nominal, "refit": nominal, "best": best}
    found = Diagnosis("leak", 0.97, (("front_air", 0.98),), (ranked,), (), gap, {}, active, trajectories=runs)
    written, first = write_outputs(tmp_path / "new", found, model, [fit], holdout)
    assert [path.name for path in written] == ["diagnosis.json", "report.html", "residual.mcap"]
    assert sorted((tmp_path / "new").iterdir()) == sorted(written), "nothing else: no .part, no metadata.yaml"
    page = written[1].read_text()
    assert ("where", "the front air and valve 98 % of the gap that re-estimated parameters leave") in first.facts
    assert dict(first.facts)["how big"] == "leak area 0.4000 ± 0.0010 mm²"
    assert "missing inflow" in page and "seen in the balance of the front air" in page
    assert json.loads(written[0].read_text())["verdict"] == "leak"


def test_laws_of_one_family_are_told_apart_in_the_ranking() -> None:
    def entry(*parameters: str) -> dict[str, object]:
        return {"effects": ["coulomb_friction"], "sites": ["rail"], "parameters": dict.fromkeys(parameters)}

    alone = {"effects": ["lag"], "sites": ["input:force"], "parameters": {"lag": None}}
    none = {"effects": ["none"], "sites": [], "parameters": {}}
    assert ranking_words([entry("friction_force"), entry("friction_force", "friction_out 1"), alone, none]) == [
        "coulomb friction (the slot rail): friction force",
        "coulomb friction (the slot rail): friction force, any shape beside it",
        "lag (the input force)",
        "none",
    ]


def test_the_second_experiment_is_another_log_and_another_folder(tmp_path: Path) -> None:
    """What was played is given already, or is there: its name is not offered again, nor the report's folder."""
    summary = {"verdict": "leak", "probability": 0.5, "next_experiment": {"description": "a sweep"}}
    logs, report = (tmp_path / "fit.mcap", tmp_path / "second.mcap"), tmp_path / "report"
    (tmp_path / "third.mcap").touch()
    played, diagnosed = next_steps(summary, Asked(logs, None, report))[0].commands
    assert played.endswith(f"--output {tmp_path / 'fourth.mcap'}")
    assert f"{logs[0]} {logs[1]} {tmp_path / 'fourth.mcap'} --output {report}-2" in diagnosed
    for name in ("report", "report-2"):
        (tmp_path / name).mkdir()
    _, again = next_steps(summary, Asked(logs, None, tmp_path / "report-2"))[0].commands
    assert again.endswith(f"--output {report}-3")
