# SPDX-License-Identifier: Apache-2.0
"""What the report says, in the order a reader needs it; the template only lays it out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.record_pace import pace_of
from pneumo_ros.diagnosis.half_car.where import Law
from pneumo_ros.diagnosis.report.budget import budget_rows, curve_plot, waterfall
from pneumo_ros.diagnosis.report.card import HALF_CAR, RigCard, ShownLog, ToldEffect
from pneumo_ros.diagnosis.report.facts import own_parameters
from pneumo_ros.diagnosis.report.plots import Line, ladder, plot, scatter, shrink_bar
from pneumo_ros.diagnosis.report.quantities import quantity_cells, readable
from pneumo_ros.diagnosis.report.steps import Asked
from pneumo_ros.diagnosis.report.story import Known, Story, gains, story
from pneumo_ros.diagnosis.report.words import (
    LIKELY,
    effect_name,
    how_far,
    percent,
    place_words,
    sentence,
    site_words,
    whole_percents,
    winner,
)
from pneumo_ros.diagnosis.result import DIFFERS

ZOOM: Final = 6.0  # slowest periods of overlay shown, where the refitted model is furthest off [display]
# above the budget of a verdict without a name [display]
BUDGET_OF_UNKNOWN: Final = "No name was accepted. This is what those that came closest would make of the gap:"
SHOWN_CHANNELS: Final = 2  # channels that are shown at once; the others are folded away [display]


@dataclass(frozen=True)
class Findings:
    """Everything the report is made from.

    Attributes
    ----------
    summary : the diagnosis file's mapping (contract), with whatever further keys it has
    trajectories : "nominal", "refit" and "best" -> (N, 6) free runs on the held-out log
    holdout : the held-out log
    fit_names : names of the logs fitted
    library : effect id -> effect
    priors : parameter of the rig -> its nominal value and standard deviation
    own : ids of the user's own effects that competed
    asked : what was typed
    regimes : sentences on when the gap shows
    conditional : subsystem -> gap when it is run alone
    laws : what is missing at the places, as curves
    card : how the page speaks of the rig
    mended : held-out gap with flexible corrections at the places found, no law named; None to leave it out
    """

    summary: Mapping[str, Any]
    trajectories: Mapping[str, Array]
    holdout: ShownLog
    fit_names: Sequence[str]
    library: Mapping[str, ToldEffect] = field(default_factory=dict)
    priors: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    own: Sequence[str] = ()
    asked: Asked | None = None
    regimes: Sequence[str] = ()
    conditional: Mapping[str, float] = field(default_factory=dict)
    laws: Sequence[Law] = ()
    mended: float | None = None
    card: RigCard = HALF_CAR

    @property
    def phrases(self) -> dict[str, str]:
        """Effect id -> what it is, in words."""
        return {name: effect.summary for name, effect in self.library.items()}


def told(found: Findings) -> Story:
    """The first screen."""
    known = Known(
        found.library, gains(found.holdout, found.trajectories, found.card), found.priors, found.own, found.asked
    )
    return story(found.summary, known)


def contents(found: Findings) -> dict[str, Any]:
    """Variables of the template."""
    summary = found.summary
    told_of = summary["verdict"] != "not_testable"  # without a verdict no place, candidate or size may look like one
    blamed = told_of and summary["verdict"] != "none"  # where nothing is missing, no part of the rig is painted
    shares = _shares(summary) if blamed else {}
    charts, first = _charts(found), told(found)
    whole = dict(zip(shares, whole_percents(list(shares.values())), strict=True))
    return {
        "title": f"Gap of {_rig_name(found)}",
        "verdict": summary["verdict"],
        "headline": first.headline,
        "confidence": first.confidence,
        "facts": [{"name": name, "text": text} for name, text in first.facts],
        "tone": _tone(summary),
        "how_far": how_far(summary),
        "next_steps": [{"text": step.text, "commands": step.commands} for step in first.steps],
        "waterfall": waterfall(budget_rows(summary), blamed) if told_of and summary.get("budget") else "",
        "measured": _measured(summary) if blamed else [],
        "budget_note": BUDGET_OF_UNKNOWN if summary["verdict"] == "unknown" and summary.get("budget") else "",
        "map": found.card.picture({place: percents / 100.0 for place, percents in whole.items()}),
        "places": [
            {"name": place, "words": place_words(place), "share": percents}
            for place, percents in whole.items()
            if percents >= 1
        ],
        "laws": _laws(found.laws) if blamed else [],
        "ladder": ladder(_rungs(summary["gap"], found.mended)),
        "charts": charts[:SHOWN_CHANNELS],
        "more_charts": charts[SHOWN_CHANNELS:],
        "ranking": [_candidate(entry, found.phrases) for entry in summary.get("ranking", [])[:10] if told_of],
        "parameters": _parameters(summary) if told_of else [],
        "own": own_parameters(summary, found.priors) if told_of else [],
        "ambiguity": _ambiguity(summary, found.phrases) if told_of else [],
        "rivals_are": _RIVALS.get(str(summary["verdict"]), "These fit it almost as well as the verdict:"),
        "experiment": summary.get("next_experiment"),
        "splits": " and ".join(effect_name(one) for one in (summary.get("next_experiment") or {}).get("splits") or ()),
        "edit": _edit(summary),
        "refused": _refused(summary),
        "notes": [sentence(note) for note in summary.get("notes", [])],
        "regimes": [sentence(text) for text in found.regimes],
        "conditional": [{"name": name.replace("_", " "), "gap": gap} for name, gap in found.conditional.items()],
        "topics": found.holdout.topics,
        "fit_names": list(found.fit_names),
        "holdout_name": found.holdout.name,
        "rig": _rig_name(found),
        "seconds": len(found.holdout.measured) * found.holdout.period,
    }


def _rig_name(found: Findings) -> str:
    return found.card.name or found.holdout.rig_name


def _measured(summary: Mapping[str, Any]) -> list[dict[str, str]]:
    """Each law as measured, the remainder's too."""
    out = []
    for row in budget_rows(summary):
        held = row["entry"] if row["kind"] == "effect" else summary["remainder"] if row["kind"] == "rest" else {}
        if held.get("curve"):
            law = str(held.get("law", ""))
            known = "no law of the library" if law in ("", DIFFERS) else "as the library's law has it"
            out.append({"plot": curve_plot(held["curve"]), "text": sentence(f"{row['words']}: {known}")})
    return out


def _tone(summary: Mapping[str, Any]) -> str:
    if summary["verdict"] in ("unknown", "not_testable") or float(summary["probability"]) < LIKELY:
        return "open"
    return "fine" if summary["verdict"] == "none" else "found"


def _rungs(gap: Mapping[str, Any], mended: float | None) -> list[tuple[str, float, str]]:
    rungs = [
        ("nominal model", float(gap["nominal"]), "nominal"),
        ("parameters re-estimated", float(gap["refit"]), "refit"),
        ("with the best explanation", float(gap["best"]), "best"),
        ("sensor noise alone", float(gap["noise_floor"]), "floor"),
    ]
    if mended is not None:
        rungs.insert(3, ("that place mended freely", mended, "mended"))
    return rungs


def _charts(found: Findings) -> list[dict[str, str]]:
    """Overlay and residual of every usable channel, the one with the largest refitted gap first."""
    log, runs = found.holdout, found.trajectories
    errors = np.sqrt(np.mean(((log.measured - runs["refit"]) * log.weight / log.scale) ** 2, axis=0))
    order = [int(c) for c in np.argsort(-errors) if log.usable[c]]
    first, last = _zoom(log, runs["refit"])
    return [_chart(found, c, first, last) for c in order]


def _chart(found: Findings, c: int, first: int, last: int) -> dict[str, str]:
    log, name = found.holdout, list(found.card.titles)[c]
    unit, factor = found.card.units[name]
    measured = np.where(log.weight[:, c] > 0, log.measured[:, c], np.nan) * factor
    lines = [Line("log", "log", measured[first:last])]
    lines += [Line(key, key, run[first:last, c] * factor) for key, run in found.trajectories.items() if key in _DRAWN]
    left = [Line(key, key, measured - found.trajectories[key][:, c] * factor) for key in ("refit", "best")]
    gaps = found.summary["gap"].get("per_channel", {}).get(name, {})
    return {
        "title": found.card.titles[name],
        "name": name,
        "overlay": plot(log.time[first:last], lines, unit),
        "residual": plot(log.time, left, unit, height=120, band=2.0 * float(log.noise[c]) * factor),
        "gaps": " → ".join(f"{gaps[key]:.3g}" for key in ("nominal", "refit", "best") if key in gaps)
        if isinstance(gaps, Mapping)
        else "",
    }


_DRAWN: Final = ("nominal", "refit", "best")  # runs that are drawn over the log [display]


def _zoom(log: ShownLog, refit: Array) -> tuple[int, int]:
    count = len(log.measured)
    rows = min(count, round(ZOOM * pace_of(log).period / log.period))
    error = np.mean(((log.measured - refit) * log.weight / log.scale) ** 2, axis=1)
    total = np.concatenate([[0.0], np.cumsum(error)])
    first = int(np.argmax(total[rows:] - total[:-rows])) if count > rows else 0
    return first, first + rows


def _shares(summary: Mapping[str, Any]) -> dict[str, float]:
    """Place -> share of the gap; together at most one."""
    found = {str(e["place"]): max(float(e["share"]), 0.0) for e in summary.get("location") or []}
    total = max(sum(found.values()), 1.0)
    return {place: share / total for place, share in found.items()}


def _sides(entry: Mapping[str, Any]) -> str:
    sites = [site_words(site) for site in entry.get("sites", []) if site]
    return ", ".join(dict.fromkeys(sites)) or str(entry.get("side") or "")


def _candidate(entry: Mapping[str, Any], phrases: Mapping[str, str]) -> dict[str, Any]:
    low, high = (float(one or 0.0) for one in entry["shrink_ci90"])
    lost = entry["gap_after"] is None  # it ran away on the held-out log
    return {
        "name": " + ".join(effect_name(effect) for effect in entry["effects"]),
        "ids": ", ".join(entry["effects"]),
        "side": _sides(entry),
        "words": " and ".join(phrases.get(effect, "") for effect in entry["effects"]),
        "probability": float(entry["probability"]),
        "gap": "" if lost else f"{float(entry['gap_after']):.3g}",
        "shrink": "ran away" if lost else percent(entry["shrink"]),
        "bar": shrink_bar(float(entry["shrink"] or 0.0), (low, high)),
    }


def _laws(laws: Sequence[Law]) -> list[dict[str, str]]:
    """Each cloud once, with all places that it was seen for: two places may stand in one balance."""
    places: dict[str, list[str]] = {}
    for law in laws:
        places.setdefault(f"{law.equation} {law.quantity}", []).append(place_words(law.place))
    once = {f"{law.equation} {law.quantity}": law for law in laws}
    return [_law(law, " or ".join(places[key])) for key, law in once.items()]


def _law(law: Law, where: str) -> dict[str, str]:
    (x_unit, x_factor), (y_unit, y_factor) = readable(law.quantity_unit, law.x), readable(law.unit, law.y)
    what = {"N": "missing force", "N m": "missing moment", "kg/s": "missing inflow"}[law.unit]
    curve = (law.centres * x_factor, law.means * y_factor)
    labels = (f"{law.quantity}, {x_unit}", f"{what}, {y_unit}")
    return {
        "plot": scatter(law.x * x_factor, law.y * y_factor, curve, labels),
        "text": f"What the re-estimated model misses at {where}, seen in the balance of the "
        f"{law.equation.replace('_', ' ')}. Of all quantities, {law.quantity} explains most of it: "
        f"{100 * law.explained:.0f} %.",
    }


def _parameters(summary: Mapping[str, Any]) -> list[dict[str, str]]:
    if not summary.get("ranking"):
        return []
    found = winner(summary)["parameters"].items()
    # A part of a shape that is absent stands at nothing, with nothing to vary.
    return [quantity_cells(name, q) for name, q in found if (q["value"], q.get("std", 0.0)) != (0.0, 0.0)]


# sentence above the rivals of a verdict [display]
_RIVALS: Final = {
    "none": "These are not excluded; what they would explain here is too little to accept one:",
    "unknown": "These come closest, and one may be it by another law than the library's:",
}


def _ambiguity(summary: Mapping[str, Any], phrases: Mapping[str, str]) -> list[str]:
    """Rivals of the verdict, itself left out; a pair ("a+b") in the words of its parts."""
    rivals = [name for name in summary.get("ambiguity_group", []) if name != summary["verdict"]]
    words = [" and ".join(phrases.get(part, "") for part in name.split("+")) for name in rivals]
    names = [effect_name(name).replace("+", " and ") for name in rivals]
    return [f"{name}: {said}" if said else name for name, said in zip(names, words, strict=True)]


def _edit(summary: Mapping[str, Any]) -> str:
    test = summary.get("edit_test")
    if not test:
        return ""
    changes = ", ".join(
        f"{name.replace('_', ' ')} {100 * (factor - 1):+.1f} %" for name, factor in test["changes"].items()
    )
    return (
        f"Predicted without refitting on {test['log']} ({changes or 'nothing changed'}): gap {test['gap_nominal']:.3g} "
        f"nominal, {test['gap_refit']:.3g} re-estimated, {test['gap_best']:.3g} with the best explanation."
    )


def _refused(summary: Mapping[str, Any]) -> list[dict[str, str]]:
    """Explanations that something counts against, and those that this log could not have shown."""
    out = [
        {
            "name": " + ".join(effect_name(e) for e in entry["effects"]),
            "side": entry.get("side") or "",
            "why": "; ".join(entry["notes"]),
        }
        for entry in summary.get("ranking", [])
        if entry.get("notes")
    ]
    hidden: Mapping[str, str] = summary.get("not_testable") or {}
    return out + [
        {"name": effect_name(name), "side": "", "why": f"not testable here: {why}"} for name, why in hidden.items()
    ]
