# SPDX-License-Identifier: Apache-2.0
"""One HTML table of rigs by dates, and above it what grows where."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined

from pneumo_ros.files import new_file
from pneumo_ros.fleet.rows import REFUSED, Row
from pneumo_ros.fleet.trends import Trend, trends_of
from pneumo_ros.printable import shown

WIDTH, HEIGHT, MARGIN = 220.0, 44.0, 6.0  # of a line of sizes, px
TEMPLATE = "template.html.j2"
WORDS = {"none": "nothing", "unknown": "no name fits", "not_testable": "cannot tell", REFUSED: "not usable"}


def render(rows: Sequence[Row], title: str) -> str:
    """The page's HTML; it refers to nothing outside itself, but to the reports of the logs."""
    source = resources.files(__package__).joinpath(TEMPLATE).read_text(encoding="utf-8")
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, finalize=shown
    )
    return environment.from_string(source).render(contents(rows, title))


def write_page(path: Path, rows: Sequence[Row], title: str) -> None:
    """Write the page; the name appears only when it is complete."""
    with new_file(path) as part:
        part.write_text(render(rows, title), encoding="utf-8")


def contents(rows: Sequence[Row], title: str) -> dict[str, Any]:
    """What the template shows."""
    trends = trends_of(rows)
    days = sorted({row.date[:10] for row in rows})
    rigs = sorted({row.rig for row in rows})
    largest = max((row.part or 0.0 for row in rows), default=0.0) or 1.0
    return {
        "title": title,
        "headline": headline(trends),
        "trends": [_trend(one, len(days)) for one in trends],
        "days": days,
        "rigs": [{"name": rig, "cells": [_cell(rows, rig, day, largest) for day in days]} for rig in rigs],
        "logs": len({row.name for row in rows}),
        "problems": [row for row in rows if row.problem],
    }


def headline(trends: Sequence[Trend]) -> str:
    """What changed, in a sentence."""
    grown = [one for one in trends if one.course in ("appears", "grows")]
    if grown:
        first = grown[0]
        more = f", and {len(grown) - 1} more" if len(grown) > 1 else ""
        return f"{_words(first.effect)} {first.course} at {_words(first.place)} of {first.rig}{more}."
    return "No effect grows beyond its uncertainty." if trends else "No effect was named in any log."


def _words(name: str) -> str:
    return name.replace("_", " ")


def _trend(one: Trend, days: int) -> dict[str, Any]:
    first, last = one.points[0], one.points[-1]
    largest = max(point.high for point in one.points) or 1.0
    return {"rig": one.rig, "effect": _words(one.effect), "place": _words(one.place), "course": one.course,
            "first": amount(first.size, one.unit), "last": amount(last.size, one.unit), "dates": len(one.points),
            "line": _line(one, largest) if days > 1 else None}  # fmt: skip


def _line(one: Trend, largest: float) -> dict[str, Any]:
    """Points and bars of a small picture, x by date."""
    times = [_days(point.date) for point in one.points]
    span = max(times[-1] - times[0], 1e-9)

    def place(time: float, size: float) -> tuple[float, float]:
        x = MARGIN + (WIDTH - 2 * MARGIN) * ((time - times[0]) / span if len(times) > 1 else 0.5)
        return x, HEIGHT - MARGIN - (HEIGHT - 2 * MARGIN) * min(size / largest, 1.0)

    dots = [place(t, point.size) for t, point in zip(times, one.points, strict=True)]
    bars = [(*place(t, point.low), place(t, point.high)[1]) for t, point in zip(times, one.points, strict=True)]
    return {"path": " ".join(f"{x:.1f},{y:.1f}" for x, y in dots), "dots": dots, "bars": bars}


def amount(size: float, unit: str) -> str:
    """A size as it is shown; "" for the unit of what has none."""
    return "0" if size == 0.0 else f"{size:.3g} {unit}".strip()


def _days(date: str) -> float:
    return datetime.fromisoformat(date).timestamp() / 86400.0


def _cell(rows: Sequence[Row], rig: str, day: str, largest: float) -> list[dict[str, Any]]:
    own = [row for row in rows if row.rig == rig and row.date.startswith(day)]
    return [{"name": name, "report": f"{name}/report.html", "lines": [_told(row, largest) for row in own
             if row.name == name]} for name in dict.fromkeys(row.name for row in own)]  # fmt: skip


def _told(row: Row, largest: float) -> dict[str, Any]:
    if not row.effect:
        return {"what": WORDS.get(row.verdict, row.verdict), "kind": row.verdict, "bar": 0.0, "size": ""}
    size = "" if row.size is None else amount(row.size, row.size_unit)
    return {"what": f"{_words(row.effect)}, {_words(row.place)}", "kind": "effect", "size": size,
            "bar": round(100.0 * (row.part or 0.0) / largest, 1)}  # fmt: skip
