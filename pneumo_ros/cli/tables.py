# SPDX-License-Identifier: Apache-2.0
"""Tables for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich import box
from rich.table import Table
from rich.text import Text

from pneumo_ros.session.summary import STEPS_NOTE, change, counts_missed, figures, pace, ride_rows
from pneumo_ros.session.warnings import MISSED
from pneumo_ros.units import SQUARE_INCH

if TYPE_CHECKING:
    from pneumo_ros.session.summary import Summary

PERCENTILES = ("p50", "p99", "max")


def summary_table(active: Summary, passive: Summary | None) -> Table:
    """Ride, valves and estimates of a session beside passive valves on the same road."""
    title = active.stretch[0].upper() + active.stretch[1:]
    table = Table(title=title, title_justify="left", box=box.SIMPLE, show_edge=False, pad_edge=False, padding=0)
    table.add_column("f / r: front / rear", no_wrap=True)
    for column in ("session", "passive", "change") if passive is not None else ("session",):
        table.add_column(column, justify="right", no_wrap=True)
    theirs = ride_rows(passive.ride) if passive is not None and passive.ride is not None else []
    for index, (name, unit, values, form) in enumerate(ride_rows(active.ride) if active.ride is not None else []):
        cells = [f"{name} ({unit})", figures(values, form)]
        if theirs:
            other = theirs[index][2]
            cells += [figures(other, form), change(values, other) if form != "%.2f" else ""]
        table.add_row(*cells)
    table.add_row("inlets saturated, f / r (%)", figures([100 * s for s in active.saturation], "%.1f"))
    if active.area_error is not None:
        errors = [e / SQUARE_INCH for e in active.area_error]
        table.add_row("area error, rms, f / r (in2)", figures(errors, "%.3f"))
    notes = []
    if passive is not None:
        notes.append("passive: valves at trim on the same road, simulated")
    if active.judged_by == "sensors":
        notes.append("session: from the LVDTs, without truth; tyre loads by the tyres' stiffness")
    if notes:
        table.caption, table.caption_justify = "\n".join(notes), "left"
    return table


def timing_table(summary: Summary) -> Table:
    """Period and execution time of each node's loop, ms, from its last /diagnostics."""
    table = Table(title=f"Loop timing{pace(summary)}; ms: p50, p99, max", title_justify="left", box=box.SIMPLE)
    misses = counts_missed(summary)
    for column in ("node", "steps", "period", "", "", "step", "", "", *(("missed",) if misses else ())):
        table.add_column(column, justify="left" if column == "node" else "right", no_wrap=True)
    for node, values in summary.loop.items():
        if values.get("steps", "0") != "0":
            cells = [_milliseconds(values, f"{label} {p} (us)") for label in ("period", "step") for p in PERCENTILES]
            table.add_row(node, values["steps"], *cells, *((values.get(MISSED, ""),) if misses else ()))
    table.caption, table.caption_justify = STEPS_NOTE, "left"
    return table


def _milliseconds(values: dict[str, str], key: str) -> str:
    value = float(values.get(key, "nan")) / 1e3
    return f"{value:.2f}" if value < 10.0 else f"{value:.0f}"


def plain_table(columns: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> Table:
    """Texts in columns, all to the left; the last one may break over lines, the first never does."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 2, 0, 0), pad_edge=False)
    for number, column in enumerate(columns):
        table.add_column(column, no_wrap=number == 0)
    for row in rows:
        table.add_row(*row)
    return table


def fact_table(facts: Sequence[tuple[str, str]]) -> Table:
    """What is told, and its text, which may break over lines."""
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 2), pad_edge=True)
    table.add_column(no_wrap=True, style="bold")
    table.add_column()
    for name, text in facts:
        table.add_row(name, Text(text))
    return table


def simple_table(columns: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> Table:
    """Texts in columns, the first to the left and the others to the right."""
    table = Table(box=box.SIMPLE)
    for number, column in enumerate(columns):
        table.add_column(column, justify="right" if number else "left")
    for row in rows:
        table.add_row(*row)
    return table
