"""Tables for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from pneumo_ros.units import SQUARE_INCH

if TYPE_CHECKING:
    from pneumo_ros.session.summary import Summary

LOOP_COLUMNS = (
    "period p50 (us)",
    "period p99 (us)",
    "period max (us)",
    "step p50 (us)",
    "step p99 (us)",
    "missed periods",
)


def summary_table(active: Summary, passive: Summary | None) -> Table:
    """Ride, valves and estimates of a session beside passive valves on the same road."""
    table = Table(title="After the first second; full scale is the rig times 5")
    table.add_column("figure")
    table.add_column("this session", justify="right")
    if passive is not None:
        table.add_column("valves at trim, simulated", justify="right")
        table.add_column("change", justify="right")
    for name, unit, ours, theirs in _ride_rows(active, passive):
        cells = [f"{name} ({unit})" if unit else name, f"{ours:.4g}"]
        if passive is not None and theirs is not None:
            cells += [f"{theirs:.4g}", f"{100.0 * (ours / theirs - 1.0):+.0f} %" if theirs else ""]
        table.add_row(*cells)
    table.add_row("inlets saturated, front / rear (% of time)", " / ".join(f"{100 * s:.1f}" for s in active.saturation))
    if active.area_error is not None:
        error = " / ".join(f"{e / SQUARE_INCH:.4f}" for e in active.area_error)
        table.add_row("area estimate, rms error, front / rear (in2)", error)
    return table


def _ride_rows(active: Summary, passive: Summary | None) -> list[tuple[str, str, float, float | None]]:
    ours, theirs = active.ride, passive.ride if passive is not None else None
    if ours is None:
        return []
    rows: list[tuple[str, str, float, float | None]] = []
    for name, unit, attribute in (
        ("heave acceleration, rms", "m/s2", "heave_rms"),
        ("heave acceleration, rms, full scale", "m/s2", "full_scale_heave_rms"),
        ("pitch acceleration, rms, both scales", "rad/s2", "pitch_rms"),
        ("mean personal rating", "0 to 5", "rating"),
    ):
        rows.append((name, unit, getattr(ours, attribute), getattr(theirs, attribute) if theirs else None))
    for side, name in enumerate(("front", "rear")):
        variation = theirs.tyre_load_variation[side] * 100 if theirs else None
        rows.append((f"tyre load variation, {name}", "% of static", ours.tyre_load_variation[side] * 100, variation))
        space = theirs.workspace[side] * 1e3 if theirs else None
        rows.append((f"suspension travel, {name}", "mm", ours.workspace[side] * 1e3, space))
    return rows


def timing_table(summary: Summary) -> Table:
    """Loop timing of each node, from its last /diagnostics."""
    table = Table(title="Loop timing")
    table.add_column("node")
    for column in ("steps", *LOOP_COLUMNS):
        table.add_column(column, justify="right")
    for node, values in summary.loop.items():
        if values.get("steps", "0") != "0":
            table.add_row(node, *(values.get(column, "") for column in ("steps", *LOOP_COLUMNS)))
    return table
