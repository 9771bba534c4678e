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
from helpers.browser import browser
from helpers.rig_logs import signals_of, simulated

from pneumo_ros.diagnosis.report import Findings, render, write_outputs, write_report, write_residual_log
from pneumo_ros.diagnosis.report.plots import Line, plot, thinned, ticks
from pneumo_ros.diagnosis.report.quantities import readable, rounded
from pneumo_ros.diagnosis.report.rig_map import colour, draw_map
from pneumo_ros.diagnosis.report.steps import Asked, next_steps
from pneumo_ros.diagnosis.report.story import Known, check, gains, story
from pneumo_ros.diagnosis.report.words import (
    closing_words,
    confidence,
    headline,
    interval,
    place_words,
    sentence,
    site_words,
    whole_percents,
)
from pneumo_ros.diagnosis.result import Diagnosis, Estimate, Gap, Ranked
from pneumo_ros.diagnosis.signals import MEASURED
from pneumo_ros.effects.loading import load_library
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.errors import InputError
from pneumo_ros.log.reading import read_log
from pneumo_ros.rig import load_rig

PLACES = (
    "front_force", "rear_force", "front_air", "rear_air", "front_tyre", "rear_tyre", "body_heave", "body_pitch",
    "road_input", "supply", *(f"sensor:{name}" for name in MEASURED),
)  # fmt: skip


LIBRARY = {
    name: replace(load_library()[name], summary=said)
    for name, said in {
        "leak": "the spring leaks",
        "orifice_coefficient": "an orifice",
        "valve_lag": "a slow valve",
    }.items()
}


def findings(verdict: str = "leak", probability: float = 0.97) -> Findings:
    clean, road, commands = simulated(5.0, 3)
    log = signals_of(clean, road, commands, 3, "held<out>.mcap")
    best = {
        "effects": ["leak"], "side": "front", "sites": ["front"], "probability": probability, "gap_after": 0.01,
        "shrink": 0.975,
        "shrink_ci90": [0.96, 0.99], "parameters": {"leak_area": {"value": 4.1e-7, "std": 2e-9, "unit": "m2"}},
    }  # fmt: skip
    summary = {
        "verdict": verdict, "probability": probability,
        "location": [{"place": "front_air", "share": 0.93}, {"place": "supply", "share": 0.04}],
        "ranking": [best, {**best, "effects": ["supply_droop"], "sites": [""], "side": None, "probability": 0.0,
                           "notes": ["droop ended at its bound"]}],
        "ambiguity_group": ["orifice_coefficient"], "not_testable": {"bump_stop": "the spring never came near it"},
        "next_experiment": {"name": "x", "file": "next_experiment_road.csv", "description": "Open both inlets fully.",
                            "separation": 31.0, "separation_now": 1.2,
                            "command": "pneumo run --road a.csv --valves b.csv"},
        "edit_test": {"log": "heavier.mcap", "changes": {"sprung_mass": 1.1}, "gap_nominal": 1.3, "gap_refit": 0.5,
                      "gap_best": 0.02},
        "gap": {"nominal": 1.2, "refit": 0.4, "best": 0.01, "noise_floor": 0.0034,
                "per_channel": {name: {"nominal": 1.2, "refit": 0.4, "best": 0.01} for name in MEASURED}},
    }  # fmt: skip
    runs = {"nominal": clean + 3 * log.scale, "refit": clean + 0.4 * log.scale, "best": clean}
    return Findings(summary, runs, log, ["fit.mcap"], LIBRARY)


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
    assert "<code>pneumo run --road a.csv --valves b.csv</code>" in page
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
    assert words == "At the front, leak by a law of its own; and at both ends, a valve that rings."


def test_every_verdict_says_what_to_do_next() -> None:
    found = findings()
    asked = Asked((Path("logs/a.mcap"),), Path("logs/b.mcap"), Path("out dir"))
    first, second = next_steps(found.summary, asked)
    played, diagnosed = first.commands
    assert "--road 'out dir/next_experiment_road.csv'" in played and "--output logs/second.mcap" in played
    assert diagnosed == "pneumo diagnose logs/a.mcap logs/second.mcap --holdout logs/b.mcap --output 'out dir-2'"
    assert "the front air and valve" in second.text and "--save-rig 'out dir/rig.yaml'" in second.commands[0]
    page = render(replace(found, asked=asked))
    assert escape(second.text) in re.sub("</?span[^>]*>", "", page) and diagnosed in unescape(page)
    assert '<span class="option">--rig</span>' in page  # not broken over two lines
    bench = Asked((Path("a.mcap"),), rig_options=("--source", "serial", "--port", "/dev/ttyACM0"))
    assert next_steps(found.summary, bench)[0].commands[0].startswith("pneumo run --source serial --port /dev/ttyACM0 ")
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
    assert ("where", "the front air and valve 98 % of the gap") in first.facts
    assert dict(first.facts)["how big"] == "leak area 0.4000 ± 0.0010 mm²"
    assert "missing inflow" in page and "seen in the balance of the front air" in page
    assert json.loads(written[0].read_text())["verdict"] == "leak"


def test_sites_of_any_rig_are_told_as_what_they_are() -> None:
    told = {
        site: site_words(site) for site in ("front", "both", "sprung_rear", "seal", "sensor:force", "input:drive", "")
    }
    assert told == {"front": "front", "both": "both ends", "sprung_rear": "the LVDT at the body's rear",
                    "seal": "the slot seal", "sensor:force": "the sensor force", "input:drive": "the input drive",
                    "": ""}  # fmt: skip


def test_a_law_of_another_kind_is_checked_against_its_measured_curve() -> None:
    """What a law's own number says little about, where its family's shape does most of it."""
    found = findings()
    plain, other = (
        check({**found.summary, "budget": [{"effects": ["leak"], "law": law}]}, LIBRARY) for law in ("leak", "differs")
    )
    assert "0.41 mm2" in plain and "measured curve" in other and "mm2" not in other


def test_a_law_of_another_kind_is_as_big_as_its_measured_curve() -> None:
    """The ends of the curve are those where the log often was; its own numbers say little."""
    found = findings()
    curve = {"x": {"name": "pressure", "unit": "Pa"}, "y": {"name": "flow", "unit": "kg/s"},
             "points": [[1e5, 9.0, 8.0, 9.9, 0.001], [2e5, 0.004, 0.003, 0.005, 0.5],
                        [3e5, 0.01, 0.0, 0.1, 0.4]]}  # fmt: skip
    best = found.summary["ranking"][0]
    parameters = {**best["parameters"], "slider 2": {"value": 2.0, "std": 0.1, "unit": "N"}}
    summary = {
        **found.summary,
        "ranking": [{**best, "parameters": parameters}],
        "budget": [{"effects": ["leak"], "family": "leak", "law": "differs", "curve": curve}],
    }
    facts = dict(story(summary, Known(LIBRARY, gains(found.holdout, found.trajectories))).facts)
    assert facts["how big"] == "leak as measured, flow over pressure: 4 g/s at 200 kPa, 10 g/s at 300 kPa"


def test_the_first_screen_says_what_where_how_big_what_it_mends_and_how_to_check_it() -> None:
    found = findings()
    said = story(found.summary, Known(LIBRARY, gains(found.holdout, found.trajectories)))
    facts = dict(said.facts)
    assert facts["how big"] == "leak area 0.4100 ± 0.0020 mm²"
    first = re.match(r"[a-z ]+ ([\d.]+) → ([\d.]+) (mm|kPa);", facts["mends"])
    assert first is not None and float(first[1]) > 50 * float(first[2]), "what the refit leaves, and what is left then"
    assert facts["by hand"] in render(found).replace("&#39;", "'") and facts["by hand"]
    assert facts["or else"].startswith("orifice coefficient") and "valves" in facts["or else"]


def test_a_page_without_an_effect_paints_nothing() -> None:
    page = render(findings("none"))
    assert colour(1.0) not in page and colour(0.93) not in page and "#f06514" not in page.lower()
    assert "missing inflow" not in page and "nothing to name" in page and ">sure:" not in page


def test_several_effects_close_together() -> None:
    entry = {"effects": ["leak", "valve_lag", "bump_stop"], "sites": ["front", "both", "rear"]}
    assert closing_words(entry) == "leak (front), valve lag (both ends) and bump stop (rear) together close"
    assert (
        closing_words({"effects": ["leak"], "side": "front"}, "{} fitted and ") == "leak (front) was fitted and closes"
    )


def test_an_unknown_says_what_came_closest_and_why_it_was_not_taken() -> None:
    found = findings("unknown")
    curve = {"x": {"name": "height", "unit": "m"}, "y": {"name": "force", "unit": "N"},
             "points": [[-0.01, -3.0, -4.0, -2.0, 1.0], [0.01, 5.0, 4.0, 6.0, 1.0]]}  # fmt: skip
    summary = {**found.summary, "evidence": {"closes:leak": 0.31, "effects": 1.0, "at_bounds:leak": 2.0},
               "remainder": {"share": 0.4, "places": ["front_force"], "curve": curve}}  # fmt: skip
    said = story(summary, Known(LIBRARY, gains(found.holdout, found.trajectories)))
    facts = dict(said.facts)
    assert said.confidence == "no name fits", "nobody is sure of nothing"
    assert facts["closest"].startswith("leak (front) closes 98 % of the held-out gap")
    assert (
        "leak closes 31 % of that, and half is needed" in facts["not it"] and "2 of its parameters" in facts["not it"]
    )
    assert "force over height: -3 N at -10 mm, 5 N at 10 mm" in facts["measured"]


def test_what_became_of_an_effect_of_ones_own_is_told() -> None:
    known = Known(LIBRARY, own=("supply_droop", "mine", "leak"))
    summary = {**findings().summary, "tried": [{"candidate": "leak:front", "gap_fit": 0.01},
                                               {"candidate": "mine:rear", "gap_fit": 0.2}]}  # fmt: skip
    fate = dict(story(summary, known).facts)["your effect"]
    assert "supply droop was fitted and closes 98 %" in fate and "leak is the verdict" in fate
    assert "mine was fitted and is number 2 of 2: 0.2 left" in fate


def test_the_rigs_own_parameters_stand_beside_what_was_stated() -> None:
    summary = {**findings().summary, "nuisance": {"pitch_inertia": {"value": 3.1, "std": 0.01, "unit": "kg m2"}}}
    page = render(replace(findings(), summary=summary, priors={"pitch_inertia": (2.9, 0.1)}))
    for cell in ("pitch inertia", "3.100 ± 0.010", "2.9", "0.1", "+2.0"):
        assert f">{cell}</td>" in page
    assert "pitch inertia 3.100 ± 0.010 kg m2 (nominal 2.9, +2.0 sigma)" in page


@pytest.mark.parametrize("shares", [[0.604, 0.404], [0.5, 0.5, 0.5], [1 / 3] * 3, [0.996, 0.004], [0.93]])
def test_shares_add_up_to_at_most_a_hundred(shares: list[float]) -> None:
    whole = whole_percents(shares)
    assert sum(whole) <= 100 and all(
        abs(w - 100 * s / max(sum(shares), 1)) < 1 for w, s in zip(whole, shares, strict=True)
    )


def test_names_keep_their_letters_and_an_interval_has_two_ends() -> None:
    assert sentence("fit.mcap: too short") == "fit.mcap: too short."
    assert sentence("volume_slope_front stands at the edge") == "volume_slope_front stands at the edge."
    assert sentence("an effect") == "An effect."
    assert interval(0.96, 0.99) == " (90 % interval 96 % to 99 %)"
    assert interval(0.981, 0.983) == " (90 % interval 98.1 % to 98.3 %)" and interval(0.98, 0.98) == ""


def test_what_is_not_finite_is_told_too() -> None:
    """diagnosis.json has null where a run diverged or a parameter is not determined."""
    lost = {"effects": ["valve_lag"], "sites": ["rear"], "side": "rear", "probability": 0.0, "gap_after": None,
            "shrink": None, "shrink_ci90": [None, None], "parameters": {}}  # fmt: skip
    found = findings("unknown")
    summary = {**found.summary, "ranking": [*found.summary["ranking"], lost], "evidence": {},
               "tried": [{"candidate": "leak:front", "gap_fit": 0.1},
                         {"candidate": "mine:rear", "gap_fit": None}]}  # fmt: skip
    assert ">ran away<" in render(replace(found, summary=summary))
    facts = dict(story(summary, Known(LIBRARY, own=("mine", "valve_lag"))).facts)
    assert facts["closest"].startswith("leak") and "2 of 2: it ran away" in facts["your effect"]
    assert not re.search(r">\s*(inf|nan)\s*<", render(replace(found, summary=summary)))
    loose = {
        **findings().summary["ranking"][0],
        "parameters": {"leak_area": {"value": 4e-7, "std": None, "unit": "m2"}},
    }
    said = story({**findings().summary, "ranking": [loose]}, Known(LIBRARY))
    assert dict(said.facts)["how big"].startswith("no single number")


@pytest.mark.parametrize("width", [390, 1280])
def test_every_row_of_a_table_stands_under_its_heads(tmp_path: Path, width: int) -> None:
    """In a real browser, at the width of a telephone and of a desk; and nothing sticks out of the page."""
    write_report(tmp_path / "report.html", findings())
    with browser() as tab:
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 720}
        tab.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        tab.driver.get((tmp_path / "report.html").as_uri())
        assert tab.driver.execute_script("return document.documentElement.scrollWidth") <= width
        rows = tab.driver.execute_script(
            "const shown = row => [...row.cells].filter(cell => cell.offsetWidth);"
            "return [...document.querySelectorAll('tr')].map(row => shown(row).map(cell => cell.offsetTop))"
        )
    assert len(rows) > 5
    for tops in rows:
        assert len(set(tops)) <= 1, "the cells of a row stand side by side"
