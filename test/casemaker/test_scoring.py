# SPDX-License-Identifier: Apache-2.0
"""Seals, intervals and scores of a blind check, on verdicts whose scores are known by hand."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from pneumo_ros.casemaker.catalogue import known_effects
from pneumo_ros.casemaker.mixture import MIXTURES
from pneumo_ros.casemaker.plan import SETS, plan
from pneumo_ros.casemaker.scoring import metrics as m
from pneumo_ros.casemaker.scoring.baselines import applied
from pneumo_ros.casemaker.scoring.calibration import expected_error, risk_coverage
from pneumo_ros.casemaker.scoring.intervals import Share
from pneumo_ros.casemaker.scoring.report import write_report
from pneumo_ros.casemaker.scoring.results import Found, load_results, parse
from pneumo_ros.casemaker.seal import opened, sealed
from pneumo_ros.errors import InputError


def label(case: str, kind: str, *truth: tuple[str, str | None], ratio: float = 5.0) -> dict[str, Any]:
    """A label as the maker writes it."""
    items = [{"effect": e, "side": s, "places": [f"{s or 'body'}_force"], "comparable": True,
              "parameters": {"mass": {"value": 2.0, "unit": "kg"}}} for e, s in truth]  # fmt: skip
    return {"case": case, "kind": kind, "truth": items, "grade": ratio if kind == "single" else 0.0,
            "ratio": {"fit": ratio, "holdout": ratio}}  # fmt: skip


def found(verdict: str, p: float = 0.9, side: str | None = "front", group: tuple[str, ...] = (),
          gaps: tuple[float, float, float] = (0.1, 0.01, 0.008), std: float = 0.2) -> Found:  # fmt: skip
    """A diagnosis with one ranking entry."""
    effects = verdict.split("+") if verdict not in ("none", "unknown") else [verdict]
    entry = {"effects": effects, "side": side, "probability": p, "gap_fit": 0.01,
             "parameters": {"m": {"value": 2.2, "std": std, "unit": "kg"}}}  # fmt: skip
    gap = {"nominal": 0.2, "refit": gaps[0], "best": gaps[1], "noise_floor": gaps[2]}
    return Found(verdict, p, (f"{side or 'body'}_force",), (entry,), group, gap, {"nominal": 0.3, "best": 0.02}, 20.0)


LABELS = {
    item["case"]: item
    for item in (
        label("a", "single", ("payload", None)),
        label("b", "single", ("leak", "front")),
        label("c", "single", ("leak", "rear"), ratio=1.2),
        label("d", "none"),
        label("e", "none"),
        label("f", "pair", ("leak", "front"), ("payload", None)),
        label("g", "unknown", ("air_column", "rear")),
        label("h", "withheld", ("valve_lag", "rear")),
    )
}
FOUND = {
    "a": found("payload", side=None),
    "b": found("valve_deadband", group=("leak",)),
    "c": found("none"),
    "d": found("none"),
    "e": found("leak", p=0.6),
    "f": found("leak", gaps=(0.1, 0.05, 0.008)),
    "g": found("unknown"),
    "h": found("transport_delay", p=0.7),
}


def test_scores_by_hand() -> None:
    cases = m.cases_of(LABELS, FOUND)
    assert m.top_one(cases) == Share(1.0, 2)
    assert m.in_group(cases) == Share(2.0, 2)
    assert m.mean_group(cases) == 1.5
    assert m.false_alarms(cases) == Share(1.0, 2)
    assert m.detection(cases)[1.2] == Share(0.0, 1)
    assert m.detection(cases)[5.0] == Share(2.0, 2)
    assert m.unknown_flagged(cases) == Share(1.0, 2)
    assert m.wrongly_named(cases) == Share(1.0, 2)
    assert (m.pairs_exact(cases), m.pairs_recall(cases)) == (Share(0.0, 1), Share(0.5, 1))
    assert m.pairs_precision(cases) == Share(1.0, 1)
    assert m.side_right(cases) == Share(0.0, 0)
    assert m.place_right(cases) == Share(3.0, 3)
    error, cover, count = m.parameters(cases)
    assert (error, cover, count) == (pytest.approx(0.1), Share(1.0, 1), 1)
    assert m.edit_beaten(cases) == Share(3.0, 3)
    assert m.shrink(cases)[0] == pytest.approx(0.9)


def test_a_lag_is_compared_as_the_whole_of_it() -> None:
    item = label("a", "single", ("valve_lag", "front"))
    item["truth"][0]["parameters"] = {"lag": {"value": 0.0064, "unit": "s"}}
    said = found("valve_lag")
    said.ranking[0]["parameters"] = {
        "valve_lag": {"value": 0.004, "std": 1e-4, "unit": "s"},
        "valve_damping_ratio": {"value": 0.8, "std": 0.0, "unit": "1"},
    }
    assert m.parameters(m.cases_of({"a": item}, {"a": said})) == (pytest.approx(0.0), Share(1.0, 1), 1)


def test_calibration_by_hand() -> None:
    cases = m.cases_of({k: LABELS[k] for k in "de"}, {"d": found("none", 0.8), "e": found("leak", 0.6)})
    assert expected_error(cases) == pytest.approx(0.5 * 0.2 + 0.5 * 0.6)
    coverage, risk = risk_coverage(cases)
    assert list(coverage) == [0.5, 1.0]
    assert list(risk) == [0.0, 0.5]


def test_wilson_interval_against_published_value() -> None:
    low, high = Share(81.0, 263).interval  # Newcombe, Statistics in Medicine 17 (1998), method 3: 0.2553 to 0.3662
    assert (low, high) == (pytest.approx(0.2553, abs=1e-4), pytest.approx(0.3662, abs=1e-4))
    assert Share(0.0, 64).interval[1] == pytest.approx(0.0566, abs=1e-3)


def test_baselines_know_only_what_they_may() -> None:
    rivals = applied(FOUND)
    assert {v.verdict for v in rivals["always none"].values()} == {"none"}
    assert {v.verdict for v in rivals["refit only"].values()} == {"unknown"}
    assert rivals["best training fit"]["b"].verdict == "valve_deadband"
    assert applied(FOUND)["random"] == rivals["random"]


def test_a_changed_label_breaks_its_seal(tmp_path: Path) -> None:
    entries, digests = sealed(list(LABELS.values()))
    path = tmp_path / "labels.json"
    path.write_text(json.dumps(entries))
    assert opened(path, digests) == LABELS
    with pytest.raises(InputError, match="no label"):
        opened(path, {**digests, "zz": "0"})
    entries[1]["label"]["truth"][0]["side"] = "rear"
    path.write_text(json.dumps(entries))
    with pytest.raises(InputError, match="differs from the one that was sealed"):
        opened(path, digests)


def test_equal_labels_have_different_digests() -> None:
    one, two = (sealed([LABELS["d"]])[1]["d"] for _ in range(2))
    assert one != two


def test_page_holds_scores_baselines_and_failures(tmp_path: Path) -> None:
    page = tmp_path / "results.md"
    write_report(page, LABELS, FOUND, {"set": "t", "seed": 1, "software": "s"})
    text = page.read_text()
    for word in ("top-1", "always none", "best training fit", "| e | none | none |", "Every failure (4)"):
        assert word in text
    assert next(tmp_path.glob("results-t-*.png")).stat().st_size > 5000
    write_report(page, LABELS, FOUND, {"set": "later", "seed": 2, "software": "pneumo_ros 9.9"})
    both = page.read_text()
    assert both.index("Set `later`") < both.index("Set `t`")
    assert both.count("# The blind check") == 1
    write_report(page, LABELS, FOUND, {"set": "later", "seed": 3, "software": "pneumo_ros 9.9"})
    assert len(list(tmp_path.glob("results-later-*.png"))) == 2, "two sets of one release, a picture each"


def test_results_are_read_as_the_contract_says(tmp_path: Path) -> None:
    diagnosis = {
        "verdict": "leak+payload", "probability": 0.8, "ambiguity_group": [], "gap": {},
        "edit_test": {"log": "e", "gap_nominal": 0.5, "gap_refit": 0.2, "gap_best": 0.1},
        "location": [{"place": "supply", "share": 0.2}, {"place": "front_air", "share": 0.7}],
        "ranking": [{"effects": ["payload", "leak"], "side": "front", "probability": 0.8, "parameters": {}}],
    }  # fmt: skip
    (tmp_path / "x.json").write_text(json.dumps({"diagnosis": diagnosis, "seconds": 3.0}))
    item = load_results(tmp_path, {"x": 0, "missing": 0})["x"]
    assert item.named == {"leak", "payload"}
    assert item.places == ("front_air", "supply")
    assert item.best["side"] == "front"
    assert (item.edit["nominal"], item.edit["best"]) == (0.5, 0.1)
    assert parse({"verdict": "none", "probability": 1.0}).declared == {"none"}
    (tmp_path / "x.json").write_text("{")
    with pytest.raises(InputError, match="cannot read this diagnosis"):
        load_results(tmp_path, {"x": 0})


def test_full_set_of_0_3_has_the_promised_mix() -> None:
    cases = plan("full-0.3")
    assert len(cases) == 240
    assert Counter(c.kind for c in cases) == {"none": 64, "single": 100, "pair": 36, "unknown": 28, "withheld": 12}
    single = [c for c in cases if c.kind == "single"]
    assert {c.effects[0][0] for c in single} == set(known_effects())
    assert Counter(c.grade for c in single) == {1.2: 25, 2.0: 25, 5.0: 25, 20.0: 25}
    assert len({c.effects[0][0] for c in cases if c.kind == "unknown"}) >= 8
    assert len({c.seed for c in cases}) == 240
    assert all(c.withhold == (c.effects[0][0],) for c in cases if c.kind == "withheld")
    assert sum(bool(c.withhold) for c in cases if c.kind != "withheld") == SETS["full-0.3"].decoys
    assert plan("full-0.3") == cases
    with pytest.raises(InputError, match="unknown set"):
        plan("nope")


def test_sets_share_no_seed() -> None:
    seeds = [case.seed for name in (*SETS, *MIXTURES, "ci") for case in plan(name)]
    assert len(set(seeds)) == len(seeds)
