# SPDX-License-Identifier: Apache-2.0
"""The facts of the first screen, one sentence each, from the content of diagnosis.json and what is known beside it.

``summary`` is the mapping of diagnosis.json everywhere; a fact that there is nothing to say about is an empty text.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.judge.verdict import Calibration
from pneumo_ros.diagnosis.report.card import ToldEffect
from pneumo_ros.diagnosis.report.quantities import quantity_row, quantity_words, readable
from pneumo_ros.diagnosis.report.words import (
    STANDS_OUT,
    UNNAMED,
    closing_words,
    effect_name,
    percent,
    place_words,
    whole_percents,
    winner,
)
from pneumo_ros.diagnosis.result import DIFFERS
from pneumo_ros.effects.guide import NO_NUMBER, OFF_THE_CURVE
from pneumo_ros.effects.parameters import family_of

TOLD: Final = 3  # signals, rivals and own parameters that are told first [display]
OFTEN: Final = 0.05  # of the density where a log was most often, from which a measured law is told there [display]
ASIDE: Final = 0.3  # of its range off the middle, from which a law is told where half of it is done [display]
PEAK: Final = 1.5  # times either end, from which a measured law is told at its peak [display]
MOVED: Final = 1.0  # tolerances from which a parameter of the rig is worth telling [display]


@dataclass(frozen=True)
class Gain:
    """How far log and model are apart in one signal on the held-out log, rms, in the unit that people read."""

    signal: str
    unit: str
    before: float
    after: float
    noise: float

    @property
    def words(self) -> str:
        """``front axle 1.3 -> 0.042 mm``."""
        return f"{self.signal} {self.before:.2g} → {self.after:.2g} {self.unit}"


def places(summary: Mapping[str, Any]) -> str:
    """Where it acts, with shares that add up to at most 100 %."""
    found = [(str(e["place"]), float(e["share"])) for e in summary.get("location") or []]
    whole = whole_percents([share for _, share in found])
    words = [f"{place_words(place)} {percents} %" for (place, share), percents in zip(found, whole, strict=True)
             if share >= STANDS_OUT]  # fmt: skip
    if not words:
        return "no place stands out"
    return f"{', '.join(words)} of the gap that re-estimated parameters leave"


def sizes(summary: Mapping[str, Any], library: Mapping[str, ToldEffect]) -> list[str]:
    """Of each effect the parameters that the log determines; of a law of another kind what was measured of it."""
    entry = winner(summary)
    curves = {one["family"]: one["curve"] for one in summary.get("budget") or []
              if one["law"] == DIFFERS and one.get("curve")}  # fmt: skip
    words = [f"{effect_name(family)} as measured, {_curve_words(curve)}" for family, curve in curves.items()]
    plain = [e for e in library.values() if family_of(e.id) in set(entry["effects"]) - set(curves)]
    own = tuple(p.name for e in plain for p in e.parameters)
    for name, quantity in entry["parameters"].items():
        # Beside a measured law its own numbers and those of its shape say little.
        if _determined(quantity) and (not curves or name.endswith(own)):
            words.append(f"{name.replace('_', ' ')} {quantity_words(name, quantity)}")
    return words or ["no single number: the law as measured is in the report"]


def _determined(quantity: Mapping[str, Any]) -> bool:
    """Whether its standard deviation is known, and smaller than itself; what is not finite is null in the file."""
    value, std = quantity["value"], quantity.get("std", 0.0)
    return value is not None and std is not None and float(std) < abs(float(value))


def mended(found: Sequence[Gain]) -> str:
    """The signals that gain most."""
    shown = [one for one in found if one.after < one.before][:TOLD]
    if not shown:
        return ""
    return "; ".join(one.words for one in shown) + " (rms on the held-out log, against parameters re-estimated)"


def off(found: Sequence[Gain]) -> str:
    shown = sorted(found, key=lambda one: -one.before / max(one.noise, 1e-12))[:TOLD]
    words = [f"{one.signal} {one.before:.2g} {one.unit} (noise {one.noise:.2g})" for one in shown]
    return "; ".join(words) + ", rms on the held-out log" if words else ""


def check(summary: Mapping[str, Any], library: Mapping[str, ToldEffect]) -> str:
    """The check by hand of each effect of the verdict, with the values that were found."""
    entry = winner(summary)
    several = len(entry["effects"]) > 1
    out = []
    for name in entry["effects"]:
        budget = [one for one in summary.get("budget") or [] if one["law"] == DIFFERS and name in one["effects"]]
        unsaid = OFF_THE_CURVE if any(one.get("curve") for one in budget) else NO_NUMBER
        words = _by_hand({} if budget else entry["parameters"], name, library, unsaid)
        out += [f"{effect_name(name)}: {words}" if several else words] if words else []
    return "; ".join(out)


def _by_hand(parameters: Mapping[str, Any], family: str, library: Mapping[str, ToldEffect], unsaid: str) -> str:
    """The check of the family's law that was found; '' where it has none.

    ``parameters`` : that were found; none where the law differs from the library's and its numbers mean little
    ``unsaid`` : where such numbers are found instead
    """
    laws = [e for e in library.values() if family_of(e.id) == family and e.guide is not None]
    for effect in sorted(laws, key=lambda e: e.id):
        values = {p.name: (_value(parameters, family, p.name), p.unit) for p in effect.parameters}
        known = {name for name, (value, _) in values.items() if value is not None}
        if effect.guide is not None and (not parameters or effect.guide.names() <= known):
            return effect.guide.check_with(values, unsaid)
    return ""


def _value(parameters: Mapping[str, Any], effect: str, name: str) -> float | None:
    """Of a parameter, whose key carries its effect's id where two effects share the name."""
    found = parameters.get(name) or next((v for k, v in parameters.items() if effect in k and k.endswith(name)), None)
    return None if found is None or found["value"] is None else float(found["value"])


def rivals(summary: Mapping[str, Any], library: Mapping[str, ToldEffect]) -> str:
    """What else is possible, each with its probability and how it differs by hand."""
    own = str(summary["verdict"]).split("+")
    names = [name for name in summary.get("ambiguity_group") or [] if name != summary["verdict"]]
    out = []
    for name in names[:TOLD]:
        entry = next((e for e in summary["ranking"] if "+".join(e["effects"]) == name), None)
        words = effect_name(name).replace("+", " and ")
        words += f" ({percent(float(entry['probability']))})" if entry and float(entry["probability"]) >= 0.005 else ""
        differs = next((_difference(library, one, name) for one in own if _difference(library, one, name)), "")
        guide = library[name].guide if name in library else None
        differs = differs or ("" if guide is None else guide.meaning.rstrip("."))  # what it is, where nobody compared
        out.append(f"{words}: {differs}" if differs else words)
    return "; ".join(out)


def _difference(library: Mapping[str, ToldEffect], one: str, other: str) -> str:
    """What tells ``other`` from ``one``, as the guide of either has it."""
    for first, second in ((one, other), (other, one)):
        effect = library.get(first)
        if effect is not None and effect.guide is not None and second in effect.guide.mistaken_for:
            told = effect.guide.mistaken_for[second]
            return told if second == other else f"where {effect_name(one)} {told}"
    return ""


def moved(summary: Mapping[str, Any], priors: Mapping[str, tuple[float, float]] | None) -> str:
    """The rig's own parameters that moved most, beside their nominal values."""
    rows = [row for row in own_parameters(summary, priors or {}) if abs(row["sigmas"]) >= MOVED]
    rows.sort(key=lambda row: -abs(row["sigmas"]))
    words = [f"{r['name']} {r['value']} {r['unit']}".rstrip() + f" (nominal {r['nominal']}, {r['sigmas']:+.1f} sigma)"
             for r in rows[:TOLD]]  # fmt: skip
    return "; ".join(words)


def own_parameters(summary: Mapping[str, Any], priors: Mapping[str, tuple[float, float]]) -> list[dict[str, Any]]:
    """Each parameter of the rig: name, value with its uncertainty, nominal, tolerance, tolerances moved, unit."""
    return [
        quantity_row(name, quantity, priors.get(name)) for name, quantity in (summary.get("nuisance") or {}).items()
    ]


def closest(summary: Mapping[str, Any]) -> str:
    """The structure that comes closest without a name being earned, and what it closes."""
    entry = nearest(summary)
    if entry is None:
        return "no listed effect closes anything"
    left = float(summary["gap"]["refit"])
    return (f"{closing_words(entry)} {percent(max(float(entry['shrink']), 0.0))} of the held-out gap that "
            f"re-estimated parameters leave ({left:.2g} → {float(entry['gap_after']):.2g})")  # fmt: skip


def nearest(summary: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The named entry of the ranking that leaves least of the held-out gap."""
    entries = summary.get("ranking") or []
    named = [e for e in entries if set(e["effects"]).isdisjoint(UNNAMED) and _finite(e)]
    return min(named, key=lambda e: float(e["gap_after"]), default=None)


def _finite(entry: Mapping[str, Any]) -> bool:
    """Whether a structure ran through the held-out log; one that ran away has null there."""
    return entry["gap_after"] is not None and entry["shrink"] is not None


def why_not(summary: Mapping[str, Any]) -> str:
    """Why the closest structure was not accepted."""
    evidence, limits = summary.get("evidence") or {}, Calibration()
    entry = nearest(summary)
    if entry is None:
        return ""
    reasons, stopped = [], _stopped(entry)
    for effect in entry["effects"]:
        share = evidence.get(f"closes:{effect}")
        if share is not None and float(share) < limits.closes:
            reasons.append(f"whatever may act at its place closes more: {effect_name(effect)} closes "
                           f"{percent(float(share))} of that, and half is needed")  # fmt: skip
        instead = float(evidence.get(f"instead:{effect}", 1.0))
        if instead < 1.0:
            where = " and ".join(place_words(place) for place in (summary.get("remainder") or {}).get("places", ()))
            reasons.append(f"whatever may act at {where or 'another place'} in place of {effect_name(effect)} leaves "
                           f"{percent(instead)} of what it leaves")  # fmt: skip
        if float(evidence.get(f"unheld:{effect}", 0.0)) >= limits.unheld[1]:
            reasons.append(f"the rig's equations along the log hold no better with {effect_name(effect)} than without")
        bounded = float(evidence.get(f"at_bounds:{effect}") or 0.0)
        if bounded >= limits.at_bounds and not stopped:
            reasons.append(f"{bounded:.0f} of its parameters stop at the ends of their ranges")
        if float(evidence.get(f"varied:{effect}", 1.0)) < limits.varied:
            reasons.append(f"the log moves at one speed each way, where {effect_name(effect)} looks like what does not "
                           f"change with the rate: drive it at half and at twice that speed as well")  # fmt: skip
        if float(evidence.get(f"follows:{effect}", 1.0)) < 1.0:
            reasons.append("the reading stops at an end of its range, as that of a sensor at its limit does")
    if float(evidence.get("kept_chosen", 0.0)) >= limits.kept:
        reasons.append("the best structure leaves most of what the rig's equations along the log miss, or adds to it")
    if float(entry["shrink"]) <= 0.0:
        reasons.append("it does not shrink the held-out gap")
    if float(evidence.get("effects") or 0.0) == 0.0:
        reasons.append("on the blocks kept from the fit no effect helps more than chance does")
    reasons += [stopped] if stopped else []
    reasons += [str(note) for note in entry.get("notes") or () if not str(note).endswith(_TOLD_OTHERWISE)]
    return "; ".join(reasons) or "what it leaves is more than a right law would"


_TOLD_OTHERWISE: Final = ("ended at its bound", "moves no output")  # notes on parameters [definition]


def _stopped(entry: Mapping[str, Any]) -> str:
    """Which parameters of a structure stand at an end of their range; '' where none does."""
    ends = {name: q for name, q in entry["parameters"].items() if q.get("at_bound") and q["value"] is not None}
    words = [
        f"{name.rpartition('.')[2].replace('_', ' ')} ({quantity_words(name, {**q, 'std': 0.0})})"
        for name, q in ends.items()
    ]
    if not words:
        return ""
    verb = "stops at an end of its range" if len(words) == 1 else "stop at the ends of their ranges"
    return f"{', '.join(words)} {verb}, where no part of a rig is likely to be"


def measured(summary: Mapping[str, Any]) -> str:
    """What was measured of the law that has no name."""
    rest = summary.get("remainder") or {}
    curve = rest.get("curve")
    if curve:
        at = " and ".join(place_words(place) for place in rest["places"])
        return f"at {at}, {_curve_words(curve)}; its curve is in the report"
    # Where the names that came closest leave next to nothing, what they do together is the law that has no name.
    held = next((one for one in summary.get("budget") or [] if one.get("curve")), None)
    if held is None:
        return ""
    at = " and ".join(place_words(place) for place in held["places"])
    return (f"at {at}, with {effect_name(held['family'])} of any law in its place, {_curve_words(held['curve'])}; its "
            "curve is in the report")  # fmt: skip


def _curve_words(curve: Mapping[str, Any]) -> str:
    """A measured law at both ends of where the log was often: "force over rate: 2 N at -15 mm/s, -18 N at 13 mm/s";
    at its peak where it has one between them: "apparent mass over frequency: 5 kg at 1 Hz, at most 62 kg at 5.9 Hz".
    """
    points = np.asarray(curve["points"], dtype=float)
    often = points[points[:, 4] >= OFTEN * points[:, 4].max()] if points.shape[1] > 4 else points
    x, y = curve["x"], curve["y"]
    (along, x_factor), (up, y_factor) = (readable(axis["unit"], often[:, k]) for k, axis in enumerate((x, y)))
    along, up = ("" if unit == "1" else f" {unit}" for unit in (along, up))
    low, high, top = (often[k, :2] * (x_factor, y_factor) for k in (0, -1, int(np.argmax(often[:, 1]))))
    if top[1] > PEAK * max(abs(low[1]), abs(high[1])):
        return (f"{y['name']} over {x['name']}: {low[1]:.3g}{up} at {low[0]:.3g}{along}, "
                f"at most {top[1]:.3g}{up} at {top[0]:.3g}{along}")  # fmt: skip
    half = _half_way(often[:, :2] * (x_factor, y_factor), along)
    return (f"{y['name']} over {x['name']}: {low[1]:.3g}{up} at {low[0]:.3g}{along}, "
            f"{high[1]:.3g}{up} at {high[0]:.3g}{along}{half}")  # fmt: skip


def _half_way(points: Array, along: str) -> str:
    """Where a law that rises or falls all the way has done half of it; '' where both ends tell as much."""
    x, y = points[:, 0], points[:, 1]
    done = (y - y[0]) / (y[-1] - y[0] or 1.0)
    if len(x) < 3 or x[-1] <= x[0] or (np.diff(done) < -1e-9).any() or done[-1] != 1.0:
        return ""
    half = float(np.interp(0.5, done, x))
    return f", half of the way at {half:.3g}{along}" if abs((half - x[0]) / (x[-1] - x[0]) - 0.5) > ASIDE else ""


def unseen(summary: Mapping[str, Any]) -> str:
    """Effects that the excitation could not have shown."""
    return ", ".join(effect_name(name) for name in summary.get("not_testable") or {})


def fate(summary: Mapping[str, Any], name: str) -> str:
    """What became of an effect that competed."""
    if name in str(summary["verdict"]).split("+"):
        return f"{name} is the verdict"
    entries = [e for e in summary.get("ranking") or [] if name in e["effects"] and _finite(e)]
    if entries:
        best = min(entries, key=lambda e: float(e["gap_after"]))
        return (f"{closing_words(best, '{} fitted and ')} {percent(max(float(best['shrink']), 0.0))} of the "
                f"held-out gap, probability {percent(float(best['probability']))}")  # fmt: skip
    if name in (summary.get("not_testable") or {}):
        return f"{name} could not have shown: {summary['not_testable'][name]}"
    tried = [t for t in summary.get("tried") or [] if str(t["candidate"]).split(":")[0] == name]
    if tried:
        order = [str(t["candidate"]) for t in summary["tried"]]
        number = order.index(str(tried[0]["candidate"])) + 1
        left = tried[0]["gap_fit"]
        words = "it ran away" if left is None else f"it leaves a gap of {float(left):.3g} on the fitted logs"
        return f"{name} was fitted and came out number {number} of {len(order)}: {words}"
    return f"{name} scored too low in the screening to be fitted"
