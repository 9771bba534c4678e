# SPDX-License-Identifier: Apache-2.0
"""What is counted: each score a :class:`Share` or a number, over the cases it is about."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumo_ros.casemaker.planned import GRADES
from pneumo_ros.casemaker.scoring.intervals import Share, share
from pneumo_ros.casemaker.scoring.results import Found

CLEAR = 1.9  # gap over null floor from which an effect must be named: grade 2 within the maker's tolerance
Label = Mapping[str, Any]
Z90 = 1.644854


@dataclass(frozen=True)
class Case:
    """A label and what was found."""

    label: Label
    found: Found

    @property
    def kind(self) -> str:
        """none, single, pair, several, mixed, unknown or withheld."""
        return str(self.label["kind"])

    @property
    def truth(self) -> frozenset[str]:
        """Effects that act; of a mixed case those that have a family."""
        known = (item for item in self.label["truth"] if self.kind != "mixed" or item["family"])
        return frozenset(item["effect"] for item in known)

    @property
    def clear(self) -> bool:
        """Whether the gap is at least twice the null floor."""
        return float(self.label["ratio"]["fit"]) >= CLEAR

    @property
    def right(self) -> bool:
        """Whether the verdict is the truth."""
        if self.kind == "none":
            return self.found.verdict == "none"
        if self.kind in ("unknown", "withheld"):
            return self.found.verdict == "unknown"
        return self.found.named == self.truth

    @property
    def places(self) -> frozenset[str]:
        """Places that are right."""
        return frozenset(place for item in self.label["truth"] for place in item["places"])


def cases_of(labels: Mapping[str, Label], found: Mapping[str, Found]) -> list[Case]:
    """Cases that have a diagnosis."""
    return [Case(labels[name], found[name]) for name in sorted(found)]


def of_kind(cases: Sequence[Case], *kinds: str, clear: bool = False) -> list[Case]:
    """Cases of some kinds, on request only those with a clear gap."""
    return [c for c in cases if c.kind in kinds and (c.clear or not clear)]


def top_one(cases: Sequence[Case]) -> Share:
    """Single effect with a clear gap: verdict right."""
    return share([c.right for c in of_kind(cases, "single", clear=True)])


def in_group(cases: Sequence[Case]) -> Share:
    """Single effect with a clear gap: truth is the verdict or in its declared ambiguity group."""
    return share([c.truth <= c.found.declared for c in of_kind(cases, "single", clear=True)])


def mean_group(cases: Sequence[Case]) -> float:
    """Mean number of ids declared (verdict and group) for a single effect with a clear gap."""
    sizes = [len(c.found.declared) for c in of_kind(cases, "single", clear=True)]
    return float(np.mean(sizes)) if sizes else math.nan


def false_alarms(cases: Sequence[Case]) -> Share:
    """Nothing wrong, and the verdict says something is."""
    return share([c.found.alarm for c in of_kind(cases, "none")])


def detection(cases: Sequence[Case]) -> dict[float, Share]:
    """Share of single effects at each grade at which an alarm was given."""
    single = of_kind(cases, "single")
    return {grade: share([c.found.alarm for c in single if c.label["grade"] == grade]) for grade in GRADES}


def unknown_flagged(cases: Sequence[Case]) -> Share:
    """Effect outside the library: verdict unknown."""
    return share([c.right for c in of_kind(cases, "unknown", "withheld")])


def wrongly_named(cases: Sequence[Case]) -> Share:
    """Effect outside the library: named with more than 0.5."""
    return share([bool(c.found.named) and c.found.probability > 0.5 for c in of_kind(cases, "unknown", "withheld")])


def pairs_exact(cases: Sequence[Case]) -> Share:
    """Both effects and nothing else."""
    return share([c.right for c in of_kind(cases, "pair")])


def pairs_recall(cases: Sequence[Case]) -> Share:
    """Share of the two effects that were named, over pairs."""
    return share([len(c.found.named & c.truth) / 2.0 for c in of_kind(cases, "pair")])


def pairs_precision(cases: Sequence[Case]) -> Share:
    """Share of the named effects that act, over pairs in which any was named."""
    named = [c for c in of_kind(cases, "pair") if c.found.named]
    return share([len(c.found.named & c.truth) / len(c.found.named) for c in named])


def side_right(cases: Sequence[Case]) -> Share:
    """Single effect named rightly, clear gap, where it has a side: the side is right."""
    flags = []
    for c in of_kind(cases, "single", clear=True):
        side = c.label["truth"][0]["side"]
        if c.right and side is not None:
            flags.append(_stated_side(c) == side)
    return share(flags)


def _stated_side(case: Case) -> str | None:
    """Side of the verdict's ranking entry; for a sensor effect, whose side is its channel, the end of its places."""
    side = case.found.best.get("side")
    if side is not None or not case.found.places[:1] or not case.found.places[0].startswith("sensor:"):
        return side
    channels = [place for place in case.found.places[: len(case.places)] if place.startswith("sensor:")]
    ends = {end for end in ("front", "rear") for channel in channels if end in channel}
    return "both" if len(ends) == 2 else next(iter(ends), None)


def place_right(cases: Sequence[Case]) -> Share:
    """Alarm on a single effect or a pair with a clear gap: the largest place is one where it acts."""
    return share([_place(c) for c in of_kind(cases, "single", "pair", clear=True) if c.found.alarm])


def unknown_place_right(cases: Sequence[Case]) -> Share:
    """Unknown effect flagged: the largest place is one where it acts."""
    return share([_place(c) for c in of_kind(cases, "unknown", "withheld") if c.found.verdict == "unknown"])


def _place(case: Case) -> bool:
    return bool(case.found.places) and case.found.places[0] in case.places


def shrink(cases: Sequence[Case]) -> tuple[float, float]:
    """Median shrink of the held-out gap against the refit: as it is, and with the noise floor taken off both.

    Over single effects and pairs with a clear gap that got a name. A gap of twice the floor cannot shrink by more than
    half as long as noise counts; without noise every grade can reach 1.
    """
    plain, clean = [], []
    for c in of_kind(cases, "single", "pair", clear=True):
        gap = c.found.gap
        if not c.found.named or not gap.get("refit"):
            continue
        refit, best, floor = (float(gap[key]) for key in ("refit", "best", "noise_floor"))
        plain.append(1.0 - best / refit)
        left = math.sqrt(max(best**2 - floor**2, 0.0)) / math.sqrt(max(refit**2 - floor**2, 1e-12))
        clean.append(1.0 - min(left, 2.0))
    return (float(np.median(plain)), float(np.median(clean))) if plain else (math.nan, math.nan)


def edit_beaten(cases: Sequence[Case]) -> Share:
    """Named single effects and pairs with a clear gap: the edit log is predicted better than by the nominal model."""
    flags = [
        float(c.found.edit["best"]) < float(c.found.edit["nominal"])
        for c in of_kind(cases, "single", "pair", clear=True)
        if c.found.named and c.found.edit
    ]
    return share(flags)


def parameters(cases: Sequence[Case]) -> tuple[float, Share, int]:
    """(median relative error, share of 90 % intervals that cover, count) where both laws mean the same number."""
    errors, covered = [], []
    for c in of_kind(cases, "single", clear=True):
        pair = _comparable(c) if c.right else None
        if pair is not None:
            value, std, truth, neutral = pair
            errors.append(abs(value - truth) / max(abs(truth - neutral), 1e-12))
            covered.append(abs(value - truth) <= Z90 * std)
    return (float(np.median(errors)) if errors else math.nan), share(covered), len(errors)


def _comparable(case: Case) -> tuple[float, float, float, float] | None:
    """Value, std, truth and the neutral value (1 for factors) of the parameter with the truth's unit."""
    item = case.label["truth"][0]
    if not item["comparable"]:
        return None
    name, first = next(iter(item["parameters"].items()))
    neutral = 1.0 if name == "scale" else 0.0
    stated = case.found.best.get("parameters") or {}
    for entry in stated.values():
        if entry["unit"] == first["unit"]:
            value, std = float(entry["value"]), float(entry["std"])
            if neutral and abs(value) < 0.5:  # stated as an error of the scale rather than as the scale
                value += 1.0
            if name == "lag":
                value, std = _total_lag(value, std, stated)
            return value, std, float(first["value"]), neutral
    return None


def _total_lag(time: float, std: float, stated: Mapping[str, Any]) -> tuple[float, float]:
    """A second order lag stated as time constant 1/w and damping ratio is 2 ratio / w late: what the label says."""
    for name, entry in stated.items():
        if "total_lag" in name:  # stated as it is
            return float(entry["value"]), float(entry["std"])
    for name, entry in stated.items():
        if "damping_ratio" in name:
            ratio = float(entry["value"])
            return 2.0 * ratio * time, 2.0 * math.hypot(ratio * std, time * float(entry["std"]))
    return time, std


def seconds(cases: Sequence[Case]) -> tuple[float, float]:
    """Median and longest wall clock of a diagnosis."""
    times = [c.found.seconds for c in cases if math.isfinite(c.found.seconds)]
    return (float(np.median(times)), max(times)) if times else (math.nan, math.nan)


def confusion(cases: Sequence[Case]) -> dict[str, dict[str, int]]:
    """Truth -> verdict -> count, over singles, none and what is outside the library."""
    table: dict[str, dict[str, int]] = {}
    for c in of_kind(cases, "none", "single", "unknown", "withheld"):
        truth = "none" if c.kind == "none" else next(iter(c.truth)) if c.kind == "single" else "(outside the library)"
        row = table.setdefault(truth, {})
        row[c.found.verdict] = row.get(c.found.verdict, 0) + 1
    return table
