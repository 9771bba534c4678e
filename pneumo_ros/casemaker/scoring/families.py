# SPDX-License-Identifier: Apache-2.0
"""What is counted on sets of 0.4 and later: families by foreign laws, several effects at once, budgets and curves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pneumo_ros.casemaker.scoring.intervals import Share, share
from pneumo_ros.casemaker.scoring.metrics import Case, of_kind

LARGE = 0.1  # share of what the refit leaves from which an effect must be found
DENSE = 0.25  # of a curve's largest weight: data are dense there
BINS = 10
Entry = Mapping[str, Any]


def singles(cases: Sequence[Case], foreign: bool) -> list[Case]:
    """Single effects with a clear gap, by a law that the library does not contain or by one that it does."""
    return [c for c in of_kind(cases, "single", clear=True) if bool(c.label["truth"][0]["foreign"]) == foreign]


def top_one(cases: Sequence[Case], foreign: bool) -> Share:
    """The verdict is the family."""
    return share([c.right for c in singles(cases, foreign)])


def in_group(cases: Sequence[Case], foreign: bool) -> Share:
    """The family is the verdict or in its declared group."""
    return share([c.truth <= c.found.declared for c in singles(cases, foreign)])


def law_right(cases: Sequence[Case]) -> Share:
    """Family named rightly and its law stated: ``differs`` by a foreign law, anything else by the library's."""
    flags = []
    for c in of_kind(cases, "single", clear=True):
        entry = entry_of(c, next(iter(c.truth)))
        if c.right and entry is not None and entry.get("law"):
            flags.append((entry["law"] == "differs") == bool(c.label["truth"][0]["foreign"]))
    return share(flags)


def false_alarms(cases: Sequence[Case], formed: bool) -> Share:
    """Nothing wrong (with or without an error of the model's form that the config owns), and an alarm is given."""
    return share([c.found.alarm for c in of_kind(cases, "none") if (_stated(c) > 0.0) == formed])


def _stated(case: Case) -> float:
    return float((case.label.get("model_form") or {}).get("stated", 0.0))


def outside_unknown(cases: Sequence[Case]) -> Share:
    """Outside every family: verdict unknown."""
    return share([c.found.verdict == "unknown" for c in of_kind(cases, "unknown")])


def outside_named(cases: Sequence[Case]) -> Share:
    """Outside every family: named with more than one half."""
    return share([bool(c.found.named) and c.found.probability > 0.5 for c in of_kind(cases, "unknown")])


def outside_place(cases: Sequence[Case]) -> Share:
    """Outside every family, alarm given: the largest place is one where it acts."""
    return share([_place(c) for c in of_kind(cases, "unknown") if c.found.alarm])


def _place(case: Case) -> bool:
    return bool(case.found.places) and case.found.places[0] in case.places


def entry_of(case: Case, effect: str) -> Entry | None:
    """Entry of the budget that is about an effect."""
    return next((entry for entry in case.found.budget if effect in entry["effects"]), None)


def found_ids(case: Case) -> frozenset[str]:
    """Ids of the verdict and of every entry of the budget that is more probable than not."""
    likely = (entry for entry in case.found.budget if float(entry["probability"]) > 0.5)
    return case.found.named | frozenset(name for entry in likely for name in entry["effects"])


def several_recall(cases: Sequence[Case]) -> Share:
    """Three to five effects: those that hold at least a tenth of what the refit leaves, and were found."""
    return share([
        item["effect"] in found_ids(c)
        for c in of_kind(cases, "several")
        for item in c.label["truth"]
        if item["share_of_refit"] >= LARGE
    ])  # fmt: skip


def several_precision(cases: Sequence[Case]) -> Share:
    """Three to five effects: found ones to which a tenth of what the refit leaves is given, and that act."""
    return share([
        name in c.truth
        for c in of_kind(cases, "several")
        for name in sorted(found_ids(c))
        if stated_share(c, name, of_refit=True) >= LARGE or not c.found.budget
    ])  # fmt: skip


def several_exact(cases: Sequence[Case]) -> Share:
    """Three to five effects: all of them and nothing else."""
    return share([found_ids(c) == c.truth for c in of_kind(cases, "several")])


def mixed_recall(cases: Sequence[Case]) -> Share:
    """Named beside unnamed: effects with a family that hold a tenth of what the refit leaves, and were found."""
    return share([
        item["effect"] in found_ids(c)
        for c in of_kind(cases, "mixed")
        for item in c.label["truth"]
        if item["family"] and item["share_of_refit"] >= LARGE
    ])  # fmt: skip


def mixed_precision(cases: Sequence[Case]) -> Share:
    """Named beside unnamed: found ones that act."""
    return share([name in c.truth for c in of_kind(cases, "mixed") for name in sorted(found_ids(c))])


def left_over(cases: Sequence[Case]) -> float:
    """Three to five effects: held-out gap left of the refit's, the floor taken off both, median; one when unnamed."""
    out = []
    for c in of_kind(cases, "several"):
        gap = c.found.gap
        refit, best, floor = (float(gap.get(key, math.nan)) for key in ("refit", "best", "noise_floor"))
        whole = math.sqrt(max(refit**2 - floor**2, 1e-12))
        out.append(math.sqrt(max(best**2 - floor**2, 0.0)) / whole if c.found.named else 1.0)
    return float(np.median(out)) if out else math.nan


def stated_share(case: Case, effect: str, of_refit: bool) -> float:
    """Share that the budget gives an effect, of the nominal gap or of what the refit leaves; 0 when it has none."""
    entry = entry_of(case, effect)
    value = float(entry["share"]) / len(entry["effects"]) if entry is not None else 0.0
    if not of_refit:
        return value
    rest = 1.0 - case.found.refit_share
    return value / rest if math.isfinite(rest) and rest > 1e-9 else 0.0


def share_error(cases: Sequence[Case], of_refit: bool) -> float:
    """Median error of the budget's shares against the true ones, over the effects with a family at a clear gap."""
    key = "share_of_refit" if of_refit else "share"
    errors = [
        abs(stated_share(c, item["effect"], of_refit) - float(item[key]))
        for c in of_kind(cases, "single", "several", "mixed", clear=True)
        if c.found.budget
        for item in c.label["truth"]
        if item["family"]
    ]
    return float(np.median(errors)) if errors else math.nan


def remainder_error(cases: Sequence[Case]) -> float:
    """Median error of the remainder's share against what lies outside every family."""
    errors = [
        abs(c.found.remainder_share - sum(float(i["share"]) for i in c.label["truth"] if not i["family"]))
        for c in of_kind(cases, "unknown", "several", "mixed", clear=True)
        if math.isfinite(c.found.remainder_share)
    ]
    return float(np.median(errors)) if errors else math.nan


def curve_coverage(cases: Sequence[Case]) -> Share:
    """Measured curves: share of the dense points whose 90 % band holds the true law, mean over curves."""
    out = []
    for c in of_kind(cases, "single", "several", "mixed"):
        for item in c.label["truth"]:
            entry = entry_of(c, item["effect"])
            covered = coverage(item.get("curve"), entry.get("curve") if entry else None)
            if covered is not None:
                out.append(covered)
    return share(out)


def coverage(true: Entry | None, measured: Entry | None) -> float | None:
    """Share of the measured curve's dense points inside whose band the true curve runs; None where they do not compare.

    Points beyond the true curve's ends are left out; curves of other coordinates or units do not compare.
    """
    if not true or not measured or not measured.get("points") or len(true["points"]) < 2:
        return None
    if any(true[axis]["unit"] != measured[axis]["unit"] for axis in ("x", "y")):
        return None
    x, y = np.array(true["points"], dtype=float)[:, :2].T
    points = np.array(measured["points"], dtype=float)
    dense = points[:, 4] >= DENSE * points[:, 4].max()
    at = points[dense & (points[:, 0] >= x[0]) & (points[:, 0] <= x[-1])]
    if not len(at):
        return None
    law = np.interp(at[:, 0], x, y)
    if true["x"]["name"] == "pressure":  # a leak: the label has what is lost, the diagnosis what comes into the spring
        law = -law
    return float(np.mean((at[:, 2] <= law) & (law <= at[:, 3])))


def effect_calibration(cases: Sequence[Case]) -> float:
    """Expected calibration error of the budgets' probabilities: ten bins, mean |stated - acting| by count.

    A diagnosis without a budget counts by its verdict alone, as the sets up to 0.3 do.
    """
    stated, right = [], []
    for c in cases:
        entries = [(float(e["probability"]), frozenset(e["effects"]) <= c.truth) for e in c.found.budget]
        for p, flag in entries or [(c.found.probability, c.right)]:
            stated.append(min(max(p, 0.0), 1.0))
            right.append(float(flag))
    if not stated:
        return math.nan
    where = np.minimum((np.array(stated) * BINS).astype(int), BINS - 1)
    sums = [abs(sum(np.array(stated)[where == b]) - sum(np.array(right)[where == b])) for b in range(BINS)]
    return float(sum(sums) / len(stated))


def seconds(cases: Sequence[Case], fives: bool) -> float:
    """Median wall clock of the diagnosis of single effects, or of five at once."""
    some = of_kind(cases, "several") if fives else of_kind(cases, "single")
    times = [c.found.seconds for c in some if not fives or len(c.label["truth"]) >= 5]
    finite = [t for t in times if math.isfinite(t)]
    return float(np.median(finite)) if finite else math.nan
