"""Tables for the terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich import box
from rich.table import Table

from pneumo_ros.session.summary import ride_rows
from pneumo_ros.units import SQUARE_INCH

if TYPE_CHECKING:
    from pneumo_ros.session.summary import Summary

PERCENTILES = ("p50", "p99", "max")


def summary_table(active: Summary, passive: Summary | None) -> Table:
    """Ride, valves and estimates of a session beside passive valves on the same road."""
    table = Table(title="After the first second. Full scale is the rig times 5.", title_justify="left", box=box.SIMPLE)
    table.add_column("f / r: front / rear", no_wrap=True)
    for column in ("session", "passive", "change") if passive is not None else ("session",):
        table.add_column(column, justify="right", no_wrap=True)
    theirs = ride_rows(passive.ride) if passive is not None and passive.ride is not None else []
    for index, (name, unit, values, form) in enumerate(ride_rows(active.ride) if active.ride is not None else []):
        cells = [f"{name} ({unit})", _shown(values, form)]
        if theirs:
            other = theirs[index][2]
            cells += [_shown(other, form), _change(values, other) if form != "%.2f" else ""]
        table.add_row(*cells)
    table.add_row("inlets saturated, f / r (%)", _shown([100 * s for s in active.saturation], "%.1f"))
    if active.area_error is not None:
        errors = [e / SQUARE_INCH for e in active.area_error]
        table.add_row("area error, rms, f / r (in2)", _shown(errors, "%.3f"))
    if passive is not None:
        table.caption = "passive: valves at trim on the same road, simulated"
        table.caption_justify = "left"
    return table


def _shown(values: list[float], form: str) -> str:
    return " / ".join(form % v for v in values)


def _change(ours: list[float], theirs: list[float]) -> str:
    return " / ".join(f"{100.0 * (a / b - 1.0):+.0f} %" for a, b in zip(ours, theirs, strict=True) if b)


def timing_table(summary: Summary) -> Table:
    """Period and execution time of each node's loop, ms, from its last /diagnostics."""
    speed = f", at {summary.speed:.1f} x real time" if math.isfinite(summary.speed) else ""
    table = Table(title=f"Loop timing{speed}; ms: p50, p99, max", title_justify="left", box=box.SIMPLE)
    for column in ("node", "steps", "period", "", "", "step", "", "", "missed"):
        table.add_column(column, justify="left" if column == "node" else "right", no_wrap=True)
    for node, values in summary.loop.items():
        if values.get("steps", "0") != "0":
            figures = [_milliseconds(values, f"{label} {p} (us)") for label in ("period", "step") for p in PERCENTILES]
            table.add_row(node, values["steps"], *figures, values.get("missed periods", ""))
    return table


def _milliseconds(values: dict[str, str], key: str) -> str:
    value = float(values.get(key, "nan")) / 1e3
    return f"{value:.2f}" if value < 10.0 else f"{value:.0f}"


def simple_table(columns: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> Table:
    """Texts in columns, the first to the left and the others to the right."""
    table = Table(box=box.SIMPLE)
    for number, column in enumerate(columns):
        table.add_column(column, justify="right" if number else "left")
    for row in rows:
        table.add_row(*row)
    return table
