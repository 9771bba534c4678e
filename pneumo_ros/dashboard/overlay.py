# SPDX-License-Identifier: Apache-2.0
"""Logs laid over each other, and what they differ by: the runs of a diagnosis, or two sessions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from types import MappingProxyType
from typing import Any

import numpy as np
from bokeh.document import Document
from bokeh.layouts import column
from bokeh.models import (
    CheckboxButtonGroup,
    ColumnDataSource,
    CrosshairTool,
    CustomJS,
    Div,
    HoverTool,
    InlineStyleSheet,
    Range1d,
    Select,
    TabPanel,
    Tabs,
)
from bokeh.plotting import figure
from numpy.typing import NDArray

from pneumo_ros.dashboard.panels import thin
from pneumo_ros.dashboard.shell import furnish, legend_above, side_by_side, wrapping
from pneumo_ros.dashboard.viewer_layouts import RESIDUAL, RUNS
from pneumo_ros.errors import InputError
from pneumo_ros.log.comparison import align, start_of
from pneumo_ros.log.decoded import Log
from pneumo_ros.log.topics import DISPLACEMENT, FRONT_PRESSURE, REAR_PRESSURE
from pneumo_ros.printable import one_line

CHANNELS = (*DISPLACEMENT.names, "front_pressure", "rear_pressure")
PAIR = ("#1f77b4", "#d62728")
POINTS = 4000  # a curve
CHOICE = 150  # px, in which every channel's name keeps clear of the arrow
SEGMENT = 1024  # samples of a spectrum's windows
HEIGHT = 240  # px
BENEATH = 3.0  # px; the first run shows on both sides of one that follows it
LINE = 1.2  # px
MEANING: Mapping[str, str] = MappingProxyType({
    "measured": "the held-out log", "nominal": "the model as its rig file has it",
    "refit": "parameters re-estimated inside their tolerances", "corrected": "with the best explanation added",
})  # fmt: skip


@dataclass(frozen=True)
class Series:
    """One run of the six channels: time (N,) s, values (N, 6) in mm and kPa."""

    name: str
    colour: str
    time: NDArray[np.float64]
    values: NDArray[np.float64]


def is_residual(log: Log) -> bool:
    """Whether the log is a diagnosis's residual.mcap."""
    return f"/measured{DISPLACEMENT.name}" in log.topics


def series_of(log: Log, second: Log | None = None) -> list[Series]:
    """What can be laid over each other: a residual log's runs, or the measurements of one log or two.

    Raises
    ------
    InputError
        if a log has none of the channels, saying what it has.
    """
    if second is None and is_residual(log):
        prefixes = [name for name in RUNS if f"/{name}{DISPLACEMENT.name}" in log.topics]
        return [_series(log, f"/{name}", name, RUNS[name], 0.0) for name in prefixes]
    first = _series(log, _prefix(log), log.path.name, PAIR[0], 0.0)
    if second is None:
        return [first]
    offset = align(log, second)[1]
    return [first, _series(second, _prefix(second), second.path.name, PAIR[1], offset)]


def _prefix(log: Log) -> str:
    return "/measured" if is_residual(log) else ""


def _series(log: Log, prefix: str, name: str, colour: str, offset: float) -> Series:
    topics = [prefix + topic.name for topic in (DISPLACEMENT, FRONT_PRESSURE, REAR_PRESSURE)]
    missing = [topic for topic in topics if topic not in log.topics or not log.topics[topic].count]
    if missing:
        raise unknown_topics(log, missing)
    joint = log.select(topics[0], list(DISPLACEMENT.names))
    pressures = [log.pressure(topic) for topic in topics[1:]]
    columns = [np.interp(joint.stamp_ns, one.stamp_ns, one.value) * 1e-3 for one in pressures]
    time = np.asarray((joint.stamp_ns - start_of(log)) * 1e-9 - offset, dtype=np.float64)
    return Series(name, colour, time, np.column_stack([joint.position * 1e3, *columns]))


def unknown_topics(log: Log, wanted: list[str]) -> InputError:
    """A log without what is to be shown, with what it has."""
    there = ", ".join(f"{name} ({info.count})" for name, info in log.topics.items() if info.count) or "no message"
    return InputError(f"nothing to show: no {', '.join(wanted)}", where=log.path, allowed=f"the log has {there}",
                      remedy="rename its topics, or see docs/topics.md")  # fmt: skip


class Overlay:
    """Tabs of one document: over time, what is left, spectra, one channel over another."""

    def __init__(self, document: Document, title: str, series: list[Series]) -> None:
        # What is left is near zero: on the axes of the signals it would flatten them.
        self._series = [one for one in series if one.name != RESIDUAL]
        furnish(document, title)
        over_time = self._over_time(self._series, BENEATH)
        tabs = [("over time", over_time), ("spectrum", self._spectra()), ("XY", self._xy())]
        left = remainders(self._series)
        if left:
            tabs.insert(1, ("residual", self._over_time(left, LINE, f", {self._series[0].name}")))
        document.add_root(Div(text=_heading(title, self._series), name="status", sizing_mode="stretch_width"))
        document.add_root(
            Tabs(tabs=[TabPanel(child=child, title=name) for name, child in tabs], sizing_mode="stretch_width")
        )

    def _figure(self, channel: str, **options: Any) -> Any:
        # Above, its tools stand in one row and none is hidden, also on a plot that is not high.
        plot = figure(height=HEIGHT, title=channel.replace("_", " "), sizing_mode="stretch_width",
                      tools="pan,box_zoom,wheel_zoom,reset,save", toolbar_location="above", **options)  # fmt: skip
        plot.toolbar.logo = None
        plot.add_tools(CrosshairTool(), HoverTool(tooltips=[("", "$name"), ("x", "$x{0.0000}"), ("y", "$y{0.0000}")]))
        return plot

    def _over_time(self, series: list[Series], first: float, what: str = "") -> Any:
        """``first`` : width of the first run's lines, px; ``what`` goes behind each channel's name"""
        ends = [(float(one.time[0]), float(one.time[-1])) for one in series]
        shared = Range1d(min(a for a, _ in ends), max(b for _, b in ends))
        plots = []
        for k, channel in enumerate(CHANNELS):
            plot = self._figure(f"{channel}{what}", x_range=shared, x_axis_label="s", y_axis_label=_unit(k))
            lines = []
            for one in series:
                there = np.isfinite(one.values[:, k])
                t, y = thin(one.time[there], one.values[there, k], POINTS)
                width = first if one is series[0] else LINE
                lines.append((one.name, plot.line(t, y, color=one.colour, name=one.name, line_width=width)))
            plots.append(legend_above(plot, lines))
        return column(_chooser(plots), side_by_side(plots), sizing_mode="stretch_width")

    def _spectra(self) -> Any:
        from scipy.signal import welch

        plots = []
        for k, channel in enumerate(CHANNELS):
            plot = self._figure(channel, x_axis_type="log", y_axis_type="log", x_axis_label="Hz",
                                y_axis_label=f"{_unit(k)}²/Hz")  # fmt: skip
            lines = []
            for one in self._series:
                rate = 1.0 / float(np.median(np.diff(one.time)))
                values = np.nan_to_num(one.values[:, k] - np.nanmean(one.values[:, k]))
                f, density = welch(values, rate, nperseg=min(SEGMENT, len(values)))
                lines.append((one.name, plot.line(f[1:], density[1:], color=one.colour, name=one.name)))
            plots.append(legend_above(plot, lines))
        return side_by_side(plots)

    def _xy(self) -> Any:
        plot = self._figure("one channel over another")
        words = [channel.replace("_", " ") for channel in CHANNELS]
        across, up = (Select(title=axis, value=words[k], options=words, name=axis, width=CHOICE)
                      for axis, k in (("x", 2), ("y", 0)))  # fmt: skip
        data = [ColumnDataSource({"x": [], "y": []}) for _ in self._series]
        lines = [(one.name, plot.line("x", "y", source=source, color=one.colour, name=one.name))
                 for one, source in zip(self._series, data, strict=True)]  # fmt: skip

        def show() -> None:
            x, y = words.index(across.value), words.index(up.value)
            plot.xaxis.axis_label, plot.yaxis.axis_label = f"{across.value}, {_unit(x)}", f"{up.value}, {_unit(y)}"
            for one, source in zip(self._series, data, strict=True):
                every = max(1, len(one.time) // POINTS)
                source.data = {"x": one.values[::every, x], "y": one.values[::every, y]}

        for choice in (across, up):
            choice.on_change("value", lambda attr, old, new: show())
        show()
        plot.height = 2 * HEIGHT
        return column(wrapping(across, up), legend_above(plot, lines), sizing_mode="stretch_width")


def _heading(title: str, series: list[Series]) -> str:
    """Which log it is, and what the runs are."""
    said = [f"{one.name}: {MEANING[one.name]}" for one in series if one.name in MEANING]
    words = "; ".join(said) if said else " and ".join(one.name for one in series)
    return f"<b>{escape(one_line(title))}</b><br>{escape(one_line(words))}"


def remainders(series: list[Series]) -> list[Series]:
    """The first run minus each other one, at the first one's times; empty for a run alone."""
    if len(series) < 2:
        return []
    first, out = series[0], []
    for one in series[1:]:
        there = np.column_stack([np.interp(first.time, one.time, column) for column in one.values.T])
        inside = (first.time >= one.time[0]) & (first.time <= one.time[-1])
        left = np.where(inside[:, None], first.values - there, np.nan)
        out.append(Series(f"minus {one.name}", one.colour, first.time, left))
    return out


def _unit(channel: int) -> str:
    return "mm" if channel < len(DISPLACEMENT.names) else "kPa"


def _chooser(plots: list[Any]) -> CheckboxButtonGroup:
    """Which channels are shown; the browser does it alone."""
    labels = [channel.replace("_", " ") for channel in CHANNELS]
    wrap = InlineStyleSheet(css=".bk-btn-group { flex-wrap: wrap; } :host { max-width: 100%; }")
    group = CheckboxButtonGroup(labels=labels, active=list(range(len(plots))), name="channels",
                                sizing_mode="stretch_width", stylesheets=[wrap])  # fmt: skip
    code = "plots.forEach((plot, k) => { plot.visible = cb_obj.active.includes(k) })"
    group.js_on_change("active", CustomJS(args={"plots": plots}, code=code))
    return group
