# SPDX-License-Identifier: Apache-2.0
"""The verdict in sentences, for the report and for the terminal: what, where, how sure, how far."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from pneumo_ros.diagnosis.result import DIFFERS
from pneumo_ros.diagnosis.signals.types import BUSY, NO_VERDICT

SURE: Final = 0.9  # probability from which the page says "sure" [display]
LIKELY: Final = 0.6  # probability from which the page says "likely" [display]
STANDS_OUT: Final = 0.05  # share of the gap from which a place is named [display]
UNNAMED: Final = ("none", "unknown", "not_testable")  # verdicts that name no effect [definition]


def headline(summary: Mapping[str, Any], phrases: Mapping[str, str]) -> str:
    """The verdict as a sentence."""
    verdict = str(summary["verdict"])
    if verdict == "none":
        return "No unmodelled effect: the rig's own tolerances explain the log."
    if verdict == "not_testable":
        reason = forbidden(summary)
        return f"No verdict. {reason}." if reason else (
            "This log cannot tell: it did not excite the rig enough to show an effect.")  # fmt: skip
    if verdict == "unknown":
        return f"Something that no listed effect explains, at {first_place(summary) or 'a place that is not clear'}."
    entry = winner(summary)
    sides = entry.get("sites") or [entry.get("side")] * len(entry["effects"])
    laws = {effect: str(one.get("law", "")) for one in summary.get("budget") or [] for effect in one["effects"]}
    parts = [
        _effect_words(_law_words(effect, laws.get(effect, ""), phrases), side)
        for effect, side in zip(entry["effects"], sides, strict=False)
    ]
    return sentence("; and ".join(parts))


def confidence(summary: Mapping[str, Any]) -> str:
    """How sure of the name, in words and in per cent; where there is no name there is nothing to be sure of."""
    verdict = summary["verdict"]
    if verdict in UNNAMED:
        return {"not_testable": "no verdict", "none": "nothing to name", "unknown": "no name fits"}[verdict]
    p = float(summary["probability"])
    word = "sure" if p >= SURE else "likely" if p >= LIKELY else "not sure"
    return f"{word}: {'above 99' if p > 0.99 else format(100 * p, '.0f')} %"


def how_far(summary: Mapping[str, Any]) -> str:
    """What adding the effect does to the held-out gap, in a sentence."""
    gap = summary["gap"]
    if summary["verdict"] in UNNAMED or not summary.get("ranking"):
        return (
            f"On the held-out log the nominal model is off by {gap['nominal']:.3g} of the signals' own size; "
            f"parameters re-estimated inside their tolerances leave {gap['refit']:.3g}; sensor noise alone would be "
            f"{gap['noise_floor']:.2g}."
        )
    best = winner(summary)
    low, high = best["shrink_ci90"]
    return (
        f"Adding it shrinks the held-out gap from {gap['refit']:.3g} (parameters re-estimated inside their tolerances) "
        f"to {gap['best']:.2g}, by {percent(best['shrink'])}{interval(low, high)}; "
        f"sensor noise alone would leave {gap['noise_floor']:.2g}."
    )


def forbidden(summary: Mapping[str, Any]) -> str:
    """The limitation of a log that forbids a verdict, without its closing words; '' where none does."""
    notes = (str(note) for note in summary.get("notes", ()))
    told = next((note for note in notes if note.endswith(NO_VERDICT)), "")
    return told.removesuffix(NO_VERDICT)


def poor_timing(summary: Mapping[str, Any]) -> str:
    """What the logs' time base leaves of the verdict; '' where it is good."""
    told = [str(note) for note in summary.get("notes", ()) if BUSY in str(note)]
    return " ".join(dict.fromkeys(told))


def first_place(summary: Mapping[str, Any]) -> str:
    """The place with the largest share, in words; '' where none stands out."""
    places = [entry for entry in summary.get("location") or [] if float(entry["share"]) >= STANDS_OUT]
    return place_words(places[0]["place"]) if places else ""


# names of the sensors in sentences [display]
_SENSORS: Final = {
    "sprung_front": "the LVDT at the body's front", "sprung_rear": "the LVDT at the body's rear",
    "unsprung_front": "the front axle's LVDT", "unsprung_rear": "the rear axle's LVDT",
    "front_pressure": "the front pressure sensor", "rear_pressure": "the rear pressure sensor",
}  # fmt: skip


def place_words(place: str) -> str:
    """A contract place in words."""
    if place.startswith("sensor:"):
        channel = place.removeprefix("sensor:")
        return _SENSORS.get(channel, f"the sensor {channel.replace('_', ' ')}")
    words = {
        "body_heave": "the body (up and down)", "body_pitch": "the body (pitch)", "road_input": "the road input",
        "supply": "the air supply",
    }  # fmt: skip
    if place.startswith("input:"):
        return f"the input {place.removeprefix('input:').replace('_', ' ')}"
    end, _, part = place.partition("_")
    if place not in words and end not in ("front", "rear"):
        return f"the slot {place.replace('_', ' ')}"
    parts = {"air": "air and valve", "force": "spring force"}
    return words.get(place, f"the {end} {parts.get(part, part)}")


def winner(summary: Mapping[str, Any]) -> Mapping[str, Any]:
    """The entry of the ranking that the verdict names; the first one where it names none."""
    wanted = set(str(summary["verdict"]).split("+"))
    ranking: Sequence[Mapping[str, Any]] = summary.get("ranking", [])
    return next((entry for entry in ranking if set(entry["effects"]) == wanted), ranking[0])


def _law_words(effect: str, law: str, phrases: Mapping[str, str]) -> str:
    """A family as the law that was found has it."""
    if law == DIFFERS:
        return f"{effect_name(effect)}, but by another law than the library's"
    return phrases.get(law) or phrases.get(effect) or effect.replace("_", " ")


def _effect_words(what: str, side: str | None) -> str:
    where = {"both": "at both ends", "front": "at the front", "rear": "at the rear"}.get(side or "")
    if where is None:
        return f"{what}: {site_words(side)}" if side else what
    return f"{where}, {what}"


def sentence(text: str) -> str:
    """A text with a capital and a full stop; a name of a file, a topic or an effect keeps its letters."""
    text = text.strip()
    first = text.split(" ", 1)[0].rstrip(":,;.")
    name = any(sign in first for sign in "./_<>") or any(digit.isdigit() for digit in first)
    capital = text if name else text[:1].upper() + text[1:]
    return capital + ("" if text.endswith((".", "!", "?")) else ".")


def percent(share: float) -> str:
    """Whole per cent, with a digit more where 99.6 would read as 100."""
    value = 100.0 * share
    return f"{value:.1f} %" if 98.5 < value < 100.0 else f"{round(value)} %"


def interval(low: float, high: float) -> str:
    """`` (90 % interval 92 % to 94 %)``, with the digits that its ends differ by; '' where two do not show one."""
    for form in ("{:.0f} %", "{:.1f} %"):
        ends = [form.format(100.0 * share) for share in (low, high)]
        if ends[0] != ends[1]:
            return f" (90 % interval {ends[0]} to {ends[1]})"
    return ""


def whole_percents(shares: Sequence[float]) -> list[int]:
    """Shares as whole per cent, each rounded; where that is more than 100 together, those rounded up most give way."""
    total = sum(max(share, 0.0) for share in shares)
    scaled = [100.0 * max(share, 0.0) / max(total, 1.0) for share in shares]
    out = [round(value) for value in scaled]
    above = max(sum(out) - 100, 0)
    for k in sorted(range(len(out)), key=lambda k: scaled[k] - out[k])[:above]:
        out[k] -= 1
    return out


def effect_name(effect: str) -> str:
    """An id in words: ``lvdt_scale`` is "LVDT scale"."""
    words = effect.replace("_", " ")
    return re.sub(r"\b(lvdt|cg)\b", lambda found: found[0].upper(), words)


def site_words(site: str) -> str:
    """A site of an effect in words; '' for the whole rig."""
    known = {"both": "both ends", "front": "front", "rear": "rear"}
    if site in known or not site:
        return known.get(site, "")
    return place_words(f"sensor:{site}" if site in _SENSORS else site)


def structure_words(entry: Mapping[str, Any]) -> str:
    """Effects of an entry of the ranking with their sites: "LVDT scale (the front axle's LVDT)"."""
    sites = list(entry.get("sites") or [entry.get("side")] * len(entry["effects"]))
    sites += [None] * (len(entry["effects"]) - len(sites))
    parts = [
        (effect_name(effect), site_words(site or "")) for effect, site in zip(entry["effects"], sites, strict=True)
    ]
    named = [f"{name} ({where})" if where else name for name, where in parts]
    return " and ".join([", ".join(named[:-1]), named[-1]]) if len(named) > 1 else "".join(named)


def ranking_words(ranking: Sequence[Mapping[str, Any]]) -> list[str]:
    """Entries of a ranking in words; those of one family and place are told apart by their laws' parameters: "coulomb
    friction (the slot rail): friction force, turnover rate".
    """
    words = [structure_words(entry) for entry in ranking]
    return [
        f"{own}: {_law_of(entry)}" if words.count(own) > 1 and entry.get("parameters") else own
        for own, entry in zip(words, ranking, strict=True)
    ]


def _law_of(entry: Mapping[str, Any]) -> str:
    """Names of its law's parameters; atoms of a shape are numbered, and called so together."""
    names = [str(name) for name in entry["parameters"]]
    law = [name.replace("_", " ") for name in names if " " not in name]
    return ", ".join([*law, *(["any shape beside it"] if len(law) < len(names) else [])])


def closing_words(entry: Mapping[str, Any], verb: str = "") -> str:
    """An entry of the ranking and what it does: "leak (front) closes", "leak (front) and valve lag together close"."""
    was, closes = ("were", "together close") if len(entry["effects"]) > 1 else ("was", "closes")
    return f"{structure_words(entry)} {verb.format(was)}{closes}"
