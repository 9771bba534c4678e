# SPDX-License-Identifier: Apache-2.0
"""The facts of an effect as words and rows, for the terminal and docs/effects.md."""

from __future__ import annotations

from collections.abc import Mapping

from pneumo_ros.effects.contract import SENSOR_PLACES, Effect


def sites_of(effect: Effect) -> str:
    """Where it may act, in words."""
    return ", ".join(site.replace("_", " ") or "the whole rig" for site in effect.sites)


def places_of(effect: Effect) -> str:
    """Places that a report shows it at, as the diagnosis file writes them."""
    if not effect.places:
        return ", ".join(SENSOR_PLACES[site] for site in effect.sites if site in SENSOR_PLACES)
    ends = [(place, end) for place in effect.places for end in (("front", "rear") if "{end}" in place else ("",))]
    return ", ".join(place.replace("{end}", end) for place, end in ends)


def parameter_rows(effect: Effect) -> list[tuple[str, ...]]:
    """(name, typical, low, high, unit, meaning) of each parameter, SI."""
    return [(p.name, f"{p.typical:g}", f"{p.low:g}", f"{p.high:g}", p.unit, p.meaning) for p in effect.parameters]


def check_words(effect: Effect, values: Mapping[str, float] | None = None) -> str:
    """The check by hand, with ``values`` of the parameters (SI), their typical ones by default; '' without a guide."""
    if effect.guide is None:
        return ""
    known = {p.name: ((values or {}).get(p.name, p.typical), p.unit) for p in effect.parameters}
    return effect.guide.check_with(known)


def effects_page(library: Mapping[str, Effect]) -> str:
    """All effects, Markdown."""
    return "\n".join(_section(effect) for _, effect in sorted(library.items()))


def _section(effect: Effect) -> str:
    guide = effect.guide
    lines = [f"## {effect.id}", "", f"{guide.meaning if guide else effect.summary}", ""]
    lines += [f"Acts at {sites_of(effect)}; a report shows it at `{places_of(effect)}`.", ""]
    lines += ["| parameter | typical | from | to | unit | what it is |", "|---|---|---|---|---|---|"]
    lines += ["| `" + "` | ".join((row[0], " | ".join(row[1:]))) + " |" for row in parameter_rows(effect)]
    if guide is not None:
        lines += ["", f"**By hand** (with typical values): {check_words(effect)}.", ""]
        lines += ["What looks like it, and what tells it apart:", ""] if guide.mistaken_for else []
        lines += [f"- `{other}`: {difference}" for other, difference in guide.mistaken_for.items()]
    return "\n".join(lines) + "\n"
