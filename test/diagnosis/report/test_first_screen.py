# SPDX-License-Identifier: Apache-2.0
"""What the first screen says of every kind of verdict, and that its words and shares are right."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.browser import browser
from helpers.findings import LIBRARY, findings

from pneumo_ros.cli.diagnosis_shown import show_budget
from pneumo_ros.cli.terminal import Console
from pneumo_ros.diagnosis.half_car.where import Law
from pneumo_ros.diagnosis.report import render, write_report
from pneumo_ros.diagnosis.report.facts import check
from pneumo_ros.diagnosis.report.rig_map import colour
from pneumo_ros.diagnosis.report.story import Known, gains, story
from pneumo_ros.diagnosis.report.words import (
    closing_words,
    interval,
    sentence,
    site_words,
    whole_percents,
)
from pneumo_ros.diagnosis.result import BudgetEntry


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
    plain, other, bare = (
        check({**found.summary, "budget": [{"effects": ["leak"], "law": law, "curve": curve}]}, LIBRARY)
        for law, curve in (("leak", None), ("differs", {"points": []}), ("differs", None))
    )
    assert "0.41 mm2" in plain and "0.41" not in other + bare
    assert "a hole of the leak area (mm2)" in other and other.endswith("; read the size off the curve in the report")
    assert bare.endswith("; this log gives no number for it")  # a curve that is not there is not pointed at


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


def test_a_busy_computer_stands_beside_the_verdict() -> None:
    """What may come from the time base is read before anybody takes a valve out; other notes stay in the report."""
    found, known = findings(), Known(LIBRARY)
    late = "fit.mcap: The openings were 5 ms late: the computer was busy."
    summary = {**found.summary, "notes": ["another note", late, late]}
    assert dict(story(summary, known).facts)["timing"] == late
    assert "timing" not in dict(story(found.summary, known).facts)


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
    summary = {**found.summary, "evidence": {"closes:leak": 0.31, "effects": 1.0, "at_bounds:leak": 2.0,
                                                "follows:leak": 0.2},
               "remainder": {"share": 0.4, "places": ["front_force"], "curve": curve}}  # fmt: skip
    said = story(summary, Known(LIBRARY, gains(found.holdout, found.trajectories)))
    facts = dict(said.facts)
    assert said.confidence == "no name fits", "nobody is sure of nothing"
    assert facts["closest"].startswith("leak (front) closes 98 % of the held-out gap")
    assert (
        "leak closes 31 % of that, and half is needed" in facts["not it"] and "2 of its parameters" in facts["not it"]
    )
    assert "the reading stops at an end of its range" in facts["not it"]
    assert "force over height: -3 N at -10 mm, 5 N at 10 mm" in facts["measured"]


def test_an_unknown_whose_closest_names_leave_nothing_shows_their_law_as_what_was_measured() -> None:
    """Nothing is left to measure; which numbers stand at the ends of their ranges is told once, with their values."""
    found = findings("unknown")
    curve = {"x": {"name": "height", "unit": "m"}, "y": {"name": "force", "unit": "N"},
             "points": [[-0.01, -3.0, -4.0, -2.0, 1.0], [0.01, 5.0, 4.0, 6.0, 1.0]]}  # fmt: skip
    entry = {"effects": ["leak"], "family": "leak", "side": "front", "places": ["front_air"], "share": 0.3,
             "share_ci90": [0.2, 0.4], "law": "differs", "probability": 0.45, "curve": curve}  # fmt: skip
    best = found.summary["ranking"][0]
    stuck = {"value": 2.0, "std": 0.03, "unit": "kg", "at_bound": True}
    notes = ["hanging_mass ended at its bound", "scale below 1 moves no output", "unstable on the held-out log"]
    ranking = [{**best, "parameters": {**best["parameters"], "mode.hanging_mass": stuck}, "notes": notes}]
    summary = {**found.summary, "ranking": ranking, "budget": [entry], "remainder": {"share": 0.0, "places": []},
               "evidence": {"closes:leak": 1.0, "effects": 1.0, "at_bounds:leak": 1.0}}  # fmt: skip
    facts = dict(story(summary, Known(LIBRARY, gains(found.holdout, found.trajectories))).facts)
    assert facts["not it"] == (
        "hanging mass (2 kg) stops at an end of its range, where no part of a rig is likely to be; "
        "unstable on the held-out log"
    )
    assert facts["measured"].startswith("at the front air and valve, with leak of any law in its place, force over h")
    assert "No name was accepted." in render(replace(found, summary=summary))


def test_an_unknown_that_rings_says_where_how_and_what_its_name_leaves() -> None:
    found = findings("unknown")
    points = [[1.0, 5.0, 4.0, 6.0, 0.3], [5.9, 62.0, 60.0, 64.0, 0.3], [40.0, 0.6, 0.5, 0.7, 0.3]]
    curve = {"x": {"name": "frequency", "unit": "Hz"}, "y": {"name": "apparent mass", "unit": "kg"}, "points": points}
    rest = {"share": 0.02, "places": ["body_heave"], "curve": curve}
    summary = {**found.summary, "evidence": {"closes:leak": 1.0, "instead:leak": 0.05}, "remainder": rest}
    facts = dict(story(summary, Known(LIBRARY, gains(found.holdout, found.trajectories))).facts)
    assert "at the body (up and down) in place of leak leaves 5 % of what it leaves" in facts["not it"]
    assert "apparent mass over frequency: 5 kg at 1 Hz, at most 62 kg at 5.9 Hz" in facts["measured"]


def test_an_unknown_says_that_the_equations_hold_no_better() -> None:
    found = findings("unknown")
    summary = {**found.summary, "evidence": {"closes:leak": 1.0, "unheld:leak": 1.02, "kept_chosen": 1.3}}
    said = dict(story(summary, Known(LIBRARY, gains(found.holdout, found.trajectories))).facts)["not it"]
    assert "the rig's equations along the log hold no better with leak than without" in said
    assert "the best structure leaves most of what the rig's equations along the log miss, or adds to it" in said
    summary = {**found.summary, "evidence": {"closes:leak": 1.0, "unheld:leak": 0.1, "kept_chosen": 0.1}}
    said = dict(story(summary, Known(LIBRARY, gains(found.holdout, found.trajectories))).facts)["not it"]
    assert "equations" not in said


def test_what_became_of_an_effect_of_ones_own_is_told() -> None:
    known = Known(LIBRARY, own=("supply_droop", "mine", "leak"))
    summary = {**findings().summary, "tried": [{"candidate": "leak:front", "gap_fit": 0.01},
                                               {"candidate": "mine:rear", "gap_fit": 0.2}]}  # fmt: skip
    fate = dict(story(summary, known).facts)["your effect"]
    assert "supply droop was fitted and closes 98 %" in fate and "leak is the verdict" in fate
    assert "mine was fitted and came out number 2 of 2: it leaves a gap of 0.2 on the fitted logs" in fate


def test_the_rigs_own_parameters_stand_beside_what_was_stated() -> None:
    summary = {**findings().summary, "nuisance": {"pitch_inertia": {"value": 3.1, "std": 0.01, "unit": "kg m2"}}}
    page = render(replace(findings(), summary=summary, priors={"pitch_inertia": (2.9, 0.1)}))
    for cell in ("pitch inertia", "3.100 ± 0.010", "2.9", "0.1", "+2.0"):
        assert f">{cell}</td>" in page
    assert "pitch inertia 3.100 ± 0.010 kg m2 (nominal 2.9, +2.0 sigma)" in page


@pytest.mark.parametrize("shares", [[0.604, 0.404], [0.5, 0.5, 0.5], [1 / 3] * 3, [0.996, 0.004], [0.93]])
def test_shares_add_up_to_at_most_a_hundred(shares: list[float]) -> None:
    whole = whole_percents(shares)
    assert whole_percents([0.334584, 0.190833]) == [33, 19]  # each as it is rounded alone, on page and map alike
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


def test_what_is_missing_is_drawn_once_for_two_places_in_one_balance() -> None:
    x = np.linspace(-0.1, 0.1, 40)
    laws = [Law(place, "front_axle", "spring velocity", "m/s", "N", x, x, x[::8], x[::8], 0.11)
            for place in ("front_force", "road_input")]  # fmt: skip
    page = render(replace(findings("unknown"), laws=laws))
    assert page.count("What the re-estimated model misses at") == 1
    assert "at the front spring force or the road input, seen in the balance of the front axle" in page


@pytest.mark.parametrize(("verdict", "head"), [("unknown", "the closest names, none accepted"),
                                               ("leak", "what makes the nominal model's gap")])  # fmt: skip
def test_the_terminal_says_whether_the_names_of_the_budget_are_accepted(verdict: str, head: str) -> None:
    entry = BudgetEntry(("leak",), "front", ("front_air",), 0.3, (0.2, 0.4), "leak", 0.45)
    found = findings(verdict)
    summary = {**found.summary, "budget": [entry.to_json()], "refit_share": 0.7, "remainder": None, "floor_share": 0.0}
    console = Console(width=80, record=True, file=io.StringIO())
    show_budget(console, summary, verdict)
    said = console.export_text()
    assert head in said and ("0.45" in said) == (verdict == "leak"), said


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
        bars = tab.driver.execute_script(
            "return [...document.querySelectorAll('.rung > *')].map(one => [one.className, one.offsetWidth, "
            "one.getBoundingClientRect().right, one.textContent])"
        )
    gap = findings().summary["gap"]
    assert [text for name, _, _, text in bars if name == "value"][:2] == [
        f"{gap[key]:.3g}" for key in ("nominal", "refit")
    ]
    assert all(wide > 0 and right <= width for _, wide, right, _ in bars), "a bar and its number are on the screen"
    assert len(rows) > 5
    for tops in rows:
        assert len(set(tops)) <= 1, "the cells of a row stand side by side"
