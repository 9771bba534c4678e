# SPDX-License-Identifier: Apache-2.0
"""Scores of set 0.4 on verdicts whose scores are known by hand; the mix of the set itself."""

from __future__ import annotations

import json
import math
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from pneumo_ros.casemaker.catalogue import get, known_effects, outside_all
from pneumo_ros.casemaker.mixture import MIXTURES
from pneumo_ros.casemaker.plan import plan
from pneumo_ros.casemaker.scoring import families as f
from pneumo_ros.casemaker.scoring.intervals import Share
from pneumo_ros.casemaker.scoring.metrics import Case
from pneumo_ros.casemaker.scoring.report import lines_for, write_report
from pneumo_ros.casemaker.scoring.results import Found, parse

CURVE = {"x": {"name": "rate", "unit": "m/s"}, "y": {"name": "force", "unit": "N"},
         "points": [[-0.1, 10.0, 0.3], [0.1, -10.0, 0.3]]}  # fmt: skip


def item(effect: str, share: float, of_refit: float, *, family: bool = True, foreign: bool = True) -> dict[str, Any]:
    """One effect of a label."""
    return {"effect": effect, "side": "front", "places": ["front_force"], "parameters": {}, "comparable": False,
            "family": effect if family else None, "law": "x", "foreign": foreign, "share": share,
            "share_of_refit": of_refit, "curve": CURVE if effect == "viscous_damping" else None}  # fmt: skip


def case(kind: str, truth: list[dict[str, Any]], found: Found, stated: float = 0.0, ratio: float = 5.0) -> Case:
    """A label with its diagnosis."""
    label = {"case": f"{kind}-{found.verdict}-{len(truth)}", "kind": kind, "truth": truth, "grade": ratio,
             "ratio": {"fit": ratio}, "refit_share": 0.5, "model_form": {"stated": stated}}  # fmt: skip
    return Case(label, found)


def found(verdict: str, p: float = 0.9, budget: tuple[dict[str, Any], ...] = (), **more: Any) -> Found:
    """A diagnosis; the refit takes half of the nominal gap."""
    return Found(verdict, p, budget=budget, refit_share=0.5, **{"places": ("front_force",), **more})


def entry(effect: str, share: float, p: float = 0.9, law: str = "differs", curve: Any = None) -> dict[str, Any]:
    """One entry of a budget."""
    return {"effects": [effect], "share": share, "probability": p, "law": law, "curve": curve}


def measured(low: float, high: float, unit: str = "N") -> dict[str, Any]:
    """A measured curve whose band runs from ``low`` to ``high`` beside the true law -100 x."""
    points = [[x, -100.0 * x, -100.0 * x + low, -100.0 * x + high, w] for x, w in ((-0.05, 1.0), (0.05, 0.5))]
    points += [[0.06, 0.0, 50.0, 60.0, 0.1], [0.5, 0.0, 50.0, 60.0, 1.0]]  # sparse, and beyond the true curve's end
    return {"x": {"name": "rate", "unit": "m/s"}, "y": {"name": "force", "unit": unit}, "points": points}


def test_singles_by_kind_of_law() -> None:
    cases = [
        case("single", [item("leak", 0.4, 1.0)], found("leak", budget=(entry("leak", 0.4),))),
        case("single", [item("leak", 0.4, 1.0)], found("unknown", group=("leak",))),
        case("single", [item("leak", 0.4, 1.0)], found("none"), ratio=1.2),
        case("single", [item("leak", 0.4, 1.0, foreign=False)],
             found("leak", budget=(entry("leak", 0.4, law="differs"),))),
    ]  # fmt: skip
    assert f.top_one(cases, True) == Share(1.0, 2)
    assert f.in_group(cases, True) == Share(2.0, 2)
    assert f.top_one(cases, False) == Share(1.0, 1)
    assert f.law_right(cases) == Share(1.0, 2)


def test_none_with_and_without_a_form_error_and_outside() -> None:
    cases = [
        case("none", [], found("none")),
        case("none", [], found("leak")),
        case("none", [], found("none"), stated=0.05),
        case("unknown", [item("wind", 0.4, 1.0, family=False)], found("unknown", places=("front_force", "supply"))),
        case("unknown", [item("wind", 0.4, 1.0, family=False)], found("leak", 0.6, places=("supply",))),
        case("unknown", [item("wind", 0.4, 1.0, family=False)], found("leak", 0.4, places=("supply",))),
    ]
    assert f.false_alarms(cases, False) == Share(1.0, 2)
    assert f.false_alarms(cases, True) == Share(0.0, 1)
    assert f.outside_unknown(cases) == Share(1.0, 3)
    assert f.outside_named(cases) == Share(1.0, 3)
    assert f.outside_place(cases) == Share(1.0, 3)


def several() -> Case:
    """Three effects of 30, 16 and 4 % of the nominal gap; two entries are right, one is not."""
    truth = [item("leak", 0.30, 0.6), item("valve_lag", 0.16, 0.32), item("payload", 0.04, 0.08)]
    budget = (entry("leak", 0.26), entry("bump_stop", 0.1, 0.6), entry("payload", 0.02), entry("cg_shift", 0.3, 0.2))
    gap = {"nominal": 0.2, "refit": math.hypot(0.1, 0.01), "best": math.hypot(0.02, 0.01), "noise_floor": 0.01}
    return case("several", truth, found("leak+payload+bump_stop", budget=budget, gap=gap, seconds=40.0))


def test_several_effects_by_hand() -> None:
    cases = [several()]
    assert f.several_recall(cases) == Share(1.0, 2)  # leak of leak and valve_lag; the payload is below a tenth
    assert f.several_precision(cases) == Share(1.0, 2)  # leak and bump_stop: the payload's entry is below a tenth
    assert f.several_exact(cases) == Share(0.0, 1)
    assert f.left_over(cases) == pytest.approx(0.2)
    assert f.share_error(cases, False) == pytest.approx(0.04)  # 0.04, 0.16, 0.02
    assert f.share_error(cases, True) == pytest.approx(0.08)  # 0.08, 0.32, 0.04
    assert f.seconds([*cases, case("single", [item("leak", 0.4, 1.0)], found("leak", seconds=9.0))], False) == 9.0
    assert math.isnan(f.seconds(cases, True))


def test_named_beside_unnamed() -> None:
    truth = [item("leak", 0.2, 0.5), item("wind", 0.2, 0.5, family=False)]
    one = case("mixed", truth, Found("leak", 0.9, budget=(entry("leak", 0.2),), refit_share=0.6, remainder_share=0.17))
    assert one.truth == {"leak"}
    assert one.right
    assert (f.mixed_recall([one]), f.mixed_precision([one])) == (Share(1.0, 1), Share(1.0, 1))
    assert f.remainder_error([one]) == pytest.approx(0.03)


def test_calibration_of_effects_by_hand() -> None:
    """Bins: 0.9 twice (leak right, payload right), 0.6 once (wrong), 0.2 once (wrong)."""
    assert f.effect_calibration([several()]) == pytest.approx((abs(1.8 - 2.0) + 0.6 + 0.2) / 4.0)
    assert f.effect_calibration([case("none", [], found("none", 0.8))]) == pytest.approx(0.2)


def test_curves_cover_where_data_are_dense() -> None:
    assert f.coverage(CURVE, measured(-1.0, 1.0)) == 1.0
    assert f.coverage(CURVE, measured(0.5, 1.0)) == 0.0
    assert f.coverage(CURVE, measured(-1.0, 1.0, unit="Pa")) is None
    leak = {**CURVE, "x": {**CURVE["x"], "name": "pressure"}}  # what is lost; the diagnosis tells what comes in
    turned = [[x, -y, -high, -low, weight] for x, y, low, high, weight in measured(-1.0, 1.0)["points"]]
    assert f.coverage(leak, {**measured(-1.0, 1.0), "points": turned}) == 1.0
    assert f.coverage(leak, measured(-0.01, 0.01)) == 0.0
    assert f.coverage(None, measured(-1.0, 1.0)) is None
    assert f.coverage(CURVE, None) is None
    truth = [item("viscous_damping", 0.4, 1.0)]
    one = case(
        "single", truth, found("viscous_damping", budget=(entry("viscous_damping", 0.4, curve=measured(-1, 1)),))
    )
    assert f.curve_coverage([one]) == Share(1.0, 1)


def test_files_of_0_3_and_0_4_are_read() -> None:
    old = parse({"verdict": "none", "probability": 1.0})
    assert old.budget == ()
    assert math.isnan(old.refit_share)
    new = parse({"verdict": "leak", "probability": 0.9, "budget": [entry("leak", 0.4)], "refit_share": 0.5,
                 "remainder": {"share": 0.1, "places": [], "curve": None}})  # fmt: skip
    assert (new.budget[0]["effects"], new.refit_share, new.remainder_share) == (["leak"], 0.5, 0.1)


def test_page_of_a_set_of_0_4(tmp_path: Path) -> None:
    cases = [several(), case("none", [], found("none"), stated=0.05)]
    names = {str(c.label["case"]): c for c in cases}
    write_report(tmp_path / "r.md", {n: c.label for n, c in names.items()}, {n: c.found for n, c in names.items()},
                 {"set": "t", "seed": 1, "software": "s"})  # fmt: skip
    text = (tmp_path / "r.md").read_text()
    for word in ("3 to 5 effects: recall", "leak (front, x, 60 %)", "Every failure (1)"):
        assert word in text
    assert len(lines_for(cases)) > 20


def test_full_set_has_the_promised_mix() -> None:
    cases = plan("full")
    assert Counter(c.kind for c in cases) == {"none": 64, "single": 96, "several": 60, "unknown": 30, "mixed": 30}
    assert sum(c.form for c in cases) == 32
    single = [c for c in cases if c.kind == "single"]
    assert {c.effects[0][0] for c in single} == set(known_effects())
    assert Counter(c.grades[0] for c in single) == {1.2: 24, 2.0: 24, 5.0: 24, 20.0: 24}
    assert sum(get(c.effects[0][0], c.laws[0]).foreign for c in single) == 72
    assert Counter(len(c.effects) for c in cases if c.kind == "several") == {3: 20, 4: 20, 5: 20}
    assert {c.effects[0][0] for c in cases if c.kind == "unknown"} <= set(outside_all())
    assert all(c.budgeted and len(c.laws) == len(c.effects) for c in cases)
    assert len({c.seed for c in cases}) == len(cases)
    assert plan("full") == cases
    assert json.dumps([c.name for c in plan("dev6")]) != json.dumps([c.name for c in plan("dev7")])
    assert set(MIXTURES) == {"full", "full-0.7", "full-0.6", "full-0.5", "full-0.4", "dev6", "dev7", "dev8"}
