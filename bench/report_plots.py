# SPDX-License-Identifier: Apache-2.0
"""The plots of a report drawn by its own SVG and by matplotlib: time and bytes of both, beside the whole page.

    python bench/report_plots.py REPORT

REPORT is the folder that `pneumo diagnose --output` wrote. Both ways draw the same thinned lines of the same channels:
the overlay of the first three seconds and the residual of the whole log.
"""

from __future__ import annotations

import argparse
import io
import time
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.report.plots import Line, plot, thinned
from pneumo_ros.diagnosis.report.residual_log import PREFIXES
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.topics import DISPLACEMENT, FRONT_PRESSURE, REAR_PRESSURE

SECONDS = 3.0  # of the overlay
PIXELS = 100.0  # an inch
Draw = Callable[[Array, list[Line], str, int], str]


def channels(folder: Path) -> tuple[Array, dict[str, Array]]:
    """Time (N,), s, and for the log and each run (N, 6)."""
    log = read_log(folder / "residual.mcap")

    def table(prefix: str) -> Array:
        heights = log.joint(prefix + DISPLACEMENT.name).position
        pressures = [log.pressure(prefix + topic.name).value for topic in (FRONT_PRESSURE, REAR_PRESSURE)]
        return np.column_stack([heights, *pressures])

    stamps = log.joint("/measured" + DISPLACEMENT.name).stamp_ns
    return (stamps - stamps[0]) * 1e-9, {"log": table("/measured")} | {k: table(p) for k, p in PREFIXES.items()}


def with_matplotlib(t: Array, lines: list[Line], unit: str, height: int) -> str:
    """The same lines with matplotlib, text as text."""
    figure = Figure(figsize=(860 / PIXELS, height / PIXELS))
    axes = figure.add_axes((0.072, 0.12, 0.916, 0.84))
    for line in lines:
        keep = thinned(line.values)
        axes.plot(t[keep], line.values[keep], linewidth=1.2)
    axes.set_xlim(float(t[0]), float(t[-1]))
    axes.grid(axis="y", linewidth=0.5)
    axes.set_ylabel(unit)
    out = io.StringIO()
    figure.savefig(out, format="svg", transparent=True, metadata={"Date": None})
    return out.getvalue()


def own(t: Array, lines: list[Line], unit: str, height: int) -> str:
    """As the report draws them."""
    return plot(t, lines, unit, height=height)


def drawn(draw: Draw, t: Array, tables: dict[str, Array]) -> list[str]:
    """Overlay and residual of all channels."""
    out, first = [], int(np.searchsorted(t, SECONDS))
    for c in range(6):
        out.append(draw(t[:first], [Line(name, name, table[:first, c]) for name, table in tables.items()], "m", 190))
        left = [Line(name, name, tables["log"][:, c] - tables[name][:, c]) for name in ("refit", "best")]
        out.append(draw(t, left, "m", 120))
    return out


def main() -> None:
    """Print time and size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("report", type=Path)
    folder = parser.parse_args().report
    mpl.rcParams["svg.fonttype"] = "none"
    t, tables = channels(folder)
    print(f"whole page {(folder / 'report.html').stat().st_size / 1e3:.0f} kB")
    for name, draw in (("own SVG", own), ("matplotlib", with_matplotlib)):
        drawn(draw, t, tables)  # imports and fonts
        begin = time.perf_counter()
        plots = drawn(draw, t, tables)
        spent = time.perf_counter() - begin
        print(f"{name}: {len(plots)} plots in {spent:.2f} s, {sum(map(len, plots)) / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
