# SPDX-License-Identifier: Apache-2.0
"""The verdict in sentences, for the report and for the terminal: what, how sure, how far, and what to do next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pneumo_ros.diagnosis.signals.types import NO_VERDICT

SURE, LIKELY = 0.9, 0.6
STANDS_OUT = 0.05  # share of the gap from which a place is named
UNNAMED = ("none", "unknown", "not_testable")


def headline(summary: Mapping[str, Any], phrases: Mapping[str, str]) -> str:
    """The verdict as a sentence."""
    verdict = str(summary["verdict"])
    if verdict == "none":
        return "No unmodelled effect: the rig's own tolerances explain the log."
    if verdict == "not_testable":
        reason = _forbidden(summary)
        return f"No verdict. {reason}." if reason else (
            "This log cannot tell: it did not excite the rig enough to show an effect.")  # fmt: skip
    if verdict == "unknown":
        return f"Something that no listed effect explains, at {_first_place(summary) or 'a place that is not clear'}."
    entry = winner(summary)
    sides = entry.get("sites") or [entry.get("side")] * len(entry["effects"])
    parts = [_effect_words(effect, side, phrases) for effect, side in zip(entry["effects"], sides, strict=False)]
    return sentence("; and ".join(parts))


def confidence(summary: Mapping[str, Any]) -> str:
    """How sure, in words and in per cent."""
    if summary["verdict"] == "not_testable":
        return "no verdict"
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
        f"to {gap['best']:.2g}, by {percent(best['shrink'])} (90 % interval {percent(low)} to {percent(high)}); "
        f"sensor noise alone would leave {gap['noise_floor']:.2g}."
    )


def next_steps(summary: Mapping[str, Any], logs: Sequence[str] = ("FIT.mcap",)) -> list[str]:
    """What to do with the verdict, the most useful first; ``logs`` are the names of those that were fitted."""
    verdict, experiment = str(summary["verdict"]), summary.get("next_experiment")
    if verdict == "not_testable":
        return [_record_again(summary)]
    steps = []
    if experiment:
        steps.append(f"Run {experiment.get('command') or experiment['file']} and diagnose its log together with "
                     f"{' and '.join(logs)}: {str(experiment['description']).rstrip('.')}.")  # fmt: skip
    elif float(summary["probability"]) < LIKELY:
        steps.append(
            f"Log a second session on another road and fit both: pneumo diagnose {' '.join(logs)} SECOND.mcap."
        )
    if verdict == "none":
        steps.append("Keep the model. Its re-estimated parameters are worth using: --save-rig RIG.yaml writes them.")
    elif verdict == "unknown":
        idea = ("a further slot of rig.py (docs/your-rig.md)" if summary.get("rig_model") else
                "a Python file: --effect MY_EFFECT.py (docs/diagnosis.md shows one)")  # fmt: skip
        steps.append(f"Look at {_first_place(summary) or 'the curves below'}. An idea becomes a candidate as {idea}.")
    else:
        taken = "--rig" if summary.get("rig_model") else "--rig of every verb"
        steps.append(f"Look at {_first_place(summary) or 'it'} on the rig, or keep the effect in the model: "
                     f"--save-rig RIG.yaml writes it for {taken}.")  # fmt: skip
    return steps


def _record_again(summary: Mapping[str, Any]) -> str:
    if _forbidden(summary):
        return "Mend what is listed under what limits this, and record the session again."
    if summary.get("rig_model"):
        return "Record a log that moves more, or longer."
    return ("Record a session that moves more: a rougher road (pneumo run --road D, or E) with the valves at work, "
            "15 s or longer.")  # fmt: skip


def _forbidden(summary: Mapping[str, Any]) -> str:
    """The limitation of a log that forbids a verdict, without its closing words; '' where none does."""
    notes = (str(note) for note in summary.get("notes", ()))
    told = next((note for note in notes if note.endswith(NO_VERDICT)), "")
    return told.removesuffix(NO_VERDICT)


def _first_place(summary: Mapping[str, Any]) -> str:
    """The place with the largest share, in words; '' where none stands out."""
    places = [entry for entry in summary.get("location") or [] if float(entry["share"]) >= STANDS_OUT]
    return place_words(places[0]["place"]) if places else ""


def place_words(place: str) -> str:
    """A contract place in words."""
    if place.startswith("sensor:"):
        return f"the sensor {place.removeprefix('sensor:').replace('_', ' ')}"
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


def _effect_words(effect: str, side: str | None, phrases: Mapping[str, str]) -> str:
    what = phrases.get(effect, effect.replace("_", " "))
    where = {"both": "at both ends", "front": "at the front", "rear": "at the rear"}.get(side or "")
    if where is None:
        return f"{what} ({side.replace('_', ' ')})" if side else what
    return f"{where}, {what}"


def sentence(text: str) -> str:
    """A text with a capital and a full stop."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def percent(share: float) -> str:
    """Whole per cent, with a digit more where 99.6 would read as 100."""
    value = 100.0 * share
    return f"{value:.1f} %" if 98.5 < value < 100.0 else f"{value:.0f} %"
