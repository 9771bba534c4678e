# SPDX-License-Identifier: Apache-2.0
"""The dashboard's page: plots, status, events, and what the viewer may do. One instance a browser tab."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

from bokeh.document import Document
from bokeh.layouts import column
from bokeh.models import (
    Button,
    ColumnDataSource,
    CustomJS,
    DataTable,
    Div,
    Range1d,
    Select,
    Slider,
    Spinner,
    TableColumn,
    Toggle,
)
from bokeh.plotting import figure

from pneumo_ros.dashboard.pace import Pace
from pneumo_ros.dashboard.panels import PANELS, Line, Panel, Samples, derive, thin
from pneumo_ros.dashboard.shell import furnish, legend_above, side_by_side, whole_label, wrapping
from pneumo_ros.dashboard.source import Control, Controls, Playback, Source, Status
from pneumo_ros.log.inspection import Event
from pneumo_ros.printable import one_line

REFRESH_MS = 100  # ten pictures a second look fluid and cost 5 % of a core
WINDOW = 10.0  # s shown
POINTS = 600  # a curve; more than the pixels a panel is wide at two a stretch
PANEL_HEIGHT = 190  # px
WIDGET = 330  # px; what a telephone has room for. A longer name of a parameter goes on in a second line
EVENTS_SHOWN = 200
ANSWERS_SHOWN = 6
# Said when the picture is on the screen: what a browser has drawn is a frame and a turn of its loop later.
DRAWN = "const n = cb_obj.text; requestAnimationFrame(() => setTimeout(() => { echo.text = n; }, 0));"
SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "5", "10")
_COLOURS = {"playing": "#2a7", "live": "#2a7", "paused": "#777", "waiting": "#c80", "ended": "#36c"}
_LEVELS = {0: "info", 1: "warning", 2: "error", 3: "stale"}


class Page:
    """Widgets of one document, refreshed from a source."""

    def __init__(self, document: Document, source: Source, controls: Controls | None = None) -> None:
        self._document, self._source, self._controls = document, source, controls
        self._plots: list[tuple[Panel, Any, list[tuple[Line, ColumnDataSource]]]] = []
        self._range = Range1d(0.0, WINDOW)
        self._status = Div(text="", name="status", sizing_mode="stretch_width")
        self._events = ColumnDataSource({"time": [], "level": [], "source": [], "code": [], "message": []})
        self._shown_events = (-1, 0)
        self._last = time.monotonic()
        self._said: list[str] = []
        self._answers = Div(text="", name="answers")
        self._gains = column(name="gains", sizing_mode="stretch_width")
        self._known: tuple[Control, ...] = ()
        self._pace = Pace()
        self._beat, self._echo = (Div(text="0", visible=False, name=name) for name in ("beat", "echo"))
        self._beat.js_on_change("text", CustomJS(args={"echo": self._echo}, code=DRAWN))
        self._echo.on_change("text", self._drawn)
        self._position: Slider | None = None
        self._play: Toggle | None = None
        self._buttons: tuple[Button, ...] = ()
        furnish(document, source.title)
        document.add_root(self._layout())
        document.add_periodic_callback(self.refresh, REFRESH_MS)
        self._show(0)

    def _layout(self) -> Any:
        plots = side_by_side([self._plot(panel) for panel in PANELS])
        live = self._controls is not None
        bar = self._live_bar() if live else self._playback_bar()
        below = [self._folded_gains()] if live else []
        return column(
            self._status, bar, plots, self._event_table(), *below, self._beat, self._echo, sizing_mode="stretch_width"
        )

    def _plot(self, panel: Panel) -> Any:
        plot = figure(
            height=PANEL_HEIGHT, title=panel.title, x_range=self._range, sizing_mode="stretch_width",
            tools="xpan,xwheel_zoom", toolbar_location=None,
        )  # fmt: skip
        plot.title.text_font_size = "11px"
        lines = [(line, ColumnDataSource({"t": [], "y": []})) for line in panel.lines]
        self._plots.append((panel, plot, lines))
        drawn = [
            (line.label, plot.line("t", "y", source=data, color=line.colour, line_dash=line.dash))
            for line, data in lines
        ]
        return legend_above(plot, drawn, "9px")

    def _event_table(self) -> DataTable:
        columns = [
            TableColumn(field=name, title=title, width=width)
            for name, title, width in (
                ("time", "time (s)", 70), ("level", "level", 65), ("source", "node", 90), ("code", "code", 140),
                ("message", "what happened", 860),
            )
        ]  # fmt: skip
        return DataTable(
            source=self._events, columns=columns, height=180, index_position=None, name="events",
            sizing_mode="stretch_width", autosize_mode="none",  # a telephone scrolls; it does not crush the columns
        )  # fmt: skip

    # -- playback --------------------------------------------------------------------------------------------------

    def _playback_bar(self) -> Any:
        source = self._source
        assert isinstance(source, Playback)
        length = max((source.end_ns - source.start_ns) * 1e-9, 1e-3)
        self._play = play = Toggle(label="Play / pause", active=True, button_type="success", name="play", width=110)
        play.on_change("active", lambda _, __, new: source.play(new))
        loop = Toggle(label="Loop", active=False, name="loop", width=70)
        loop.on_change("active", lambda _, __, new: setattr(source, "loop", new))
        speed = Select(title="", value="1", options=[(s, f"{s} x") for s in SPEEDS], width=80, name="speed")
        speed.on_change("value", lambda _, __, new: setattr(source, "speed", float(new)))
        self._position = Slider(start=0.0, end=length, value=0.0, step=length / 1000, title="time (s)", name="position")
        # Only the viewer's hand moves playback: the refresh sets `value` too, but never `value_throttled`.
        self._position.on_change("value_throttled", lambda _, __, new: source.seek(new))
        back, ahead = (Button(label=text, width=80) for text in ("< 20 ms", "20 ms >"))
        back.on_click(lambda: source.step(-0.02))
        ahead.on_click(lambda: source.step(0.02))
        return wrapping(play, loop, speed, back, ahead, self._position)

    # -- live ------------------------------------------------------------------------------------------------------

    def _live_bar(self) -> Any:
        controls = self._controls
        assert controls is not None
        stop = Button(label="EMERGENCY STOP", button_type="danger", width=220, height=60, name="estop")
        stop.on_click(controls.estop)
        reset = Button(label="Release stop", width=110, height=60, name="reset")
        reset.on_click(controls.reset)
        self._buttons = (stop, reset)
        return wrapping(stop, reset, self._answers, sizing_mode="stretch_width")

    def _folded_gains(self) -> Any:
        """The pictures come first: parameters are shown when they are asked for; the browser does it alone."""
        fold = Toggle(label="Parameters", active=False, width=220, name="fold")
        fold.js_on_change("active", CustomJS(args={"gains": self._gains}, code="gains.visible = cb_obj.active"))
        self._gains.visible = False
        return column(fold, self._gains, sizing_mode="stretch_width")

    def _show_gains(self) -> None:
        """Widgets for the live parameters, once their nodes have said what they are."""
        assert self._controls is not None
        found = tuple(self._controls.parameters())
        if [c.name for c in found] == [c.name for c in self._known]:
            return
        self._known = found
        widgets = [self._widget(control) for control in found]
        self._gains.children = [wrapping(*widgets, sizing_mode="stretch_width")]

    def _widget(self, control: Control) -> Any:
        title, name = _control_words(control), f"set-{control.node}-{control.name}"
        if control.choices:
            widget: Any = Select(
                title=title, value=str(control.value), options=list(control.choices), name=name, width=WIDGET
            )
        elif isinstance(control.value, bool):
            widget = Toggle(label=f"{title}: {_on_off(control.value)}", active=control.value, name=name, width=WIDGET)
            words = CustomJS(args={"title": title}, code="cb_obj.label = title + (cb_obj.active ? ': on' : ': off')")
            widget.js_on_change("active", words)
        else:
            widget = Spinner(
                title=title, value=control.value, low=control.low, high=control.high, name=name, width=WIDGET
            )
            widget.step = max(abs(float(control.value)) / 20.0, 1e-6)
        widget.stylesheets = [whole_label()]
        widget.on_change("active" if isinstance(widget, Toggle) else "value", self._changer(control))
        return widget

    def _changer(self, control: Control) -> Callable[[str, object, Any], None]:
        kind = type(control.value)

        def changed(_: str, __: object, new: Any) -> None:
            if new is not None and self._controls is not None:
                self._controls.change(control.node, control.name, kind(new))

        return changed

    # -- refresh ---------------------------------------------------------------------------------------------------

    def _drawn(self, attr: str, old: str, new: str) -> None:
        self._pace.drawn(int(new) if new.isdecimal() else 0, time.monotonic())

    def refresh(self) -> None:
        """Bring every plot and text up to date, when the browser is ready for it."""
        now = time.monotonic()
        if self._pace.begun:  # playback waits until the browser has drawn its first picture
            self._source.tick(now - self._last)
        self._last = now
        if self._pace.due(now):
            self._show(self._pace.send(now))

    def _show(self, number: int) -> None:
        """One picture; 0 is what the page comes with."""
        status = self._source.status()
        shown = (status.now_ns - status.start_ns) * 1e-9
        self._document.hold("combine")
        try:
            self._beat.text = str(number)
            self._status.text = _status_text(self._source.title, status)
            self._refresh_plots(status.start_ns)
            end = max(shown, WINDOW)
            self._range.update(start=end - WINDOW, end=end)
            self._refresh_events(status.start_ns)
            if self._position is not None and self._play is not None:
                self._position.value = round(shown, 3)
                self._play.active = status.state == "playing"
            if self._controls is not None:
                for button in self._buttons:  # they end with their session: nobody would hear them
                    button.disabled = status.state == "ended"
                self._show_gains()
                self._show_answers()
        finally:
            self._document.unhold()

    def _refresh_plots(self, start_ns: int) -> None:
        found = derive(self._source.window(WINDOW), self._source.rig)
        for panel, plot, lines in self._plots:
            shown = [self._refresh_line(line, data, found.get(line.source), start_ns) for line, data in lines]
            plot.title.text = panel.title if any(shown) else f"{panel.title}: not recorded here"

    def _refresh_line(self, line: Line, data: ColumnDataSource, samples: Samples | None, start_ns: int) -> bool:
        values = samples.column(line.channel) if samples is not None else None
        if samples is None or values is None:
            return False
        t, y = thin((samples.time_ns - start_ns) * 1e-9, values * line.factor, POINTS)
        data.data = {"t": t, "y": y}
        return True

    def _refresh_events(self, start_ns: int) -> None:
        events = self._source.events()
        if (len(events), start_ns) == self._shown_events:
            return
        # An event may be heard before the first sample, whose stamp its time is told from.
        self._shown_events = (len(events), start_ns)
        newest = trips_first(events)
        self._events.data = {
            "time": [f"{max(e.time_ns - start_ns, 0) * 1e-9:.3f}" if start_ns else "" for e in newest],
            "level": [_LEVELS.get(e.level, str(e.level)) for e in newest],
            "source": [one_line(e.source) for e in newest],
            "code": [one_line(e.code) for e in newest],
            "message": [one_line(e.message + _values(e.values)) for e in newest],
        }

    def _show_answers(self) -> None:
        assert self._controls is not None
        new = self._controls.answers()
        if new:
            self._said = [*self._said, *new][-ANSWERS_SHOWN:]
            self._answers.text = "<br>".join(_shown(line) for line in self._said)


def trips_first(events: Sequence[Event]) -> list[Event]:
    """The newest first, and above all others the trips: late estimates come by the hundred."""
    newest = list(events)[::-1]
    trips = [event for event in newest if event.is_trip]
    return [*trips, *(event for event in newest if not event.is_trip)][:EVENTS_SHOWN]


def _control_words(control: Control) -> str:
    """Name of a parameter with its unit and the range that its node takes: ``estimator.forgetting (1/s, 0 to 500)``."""
    unit = "" if control.unit in ("", "1") else control.unit
    bounded = not isinstance(control.value, str | bool) and math.isfinite(control.low) and math.isfinite(control.high)
    span = f"{control.low:g} to {control.high:g}" if bounded else ""
    told = ", ".join(part for part in (unit, span) if part)
    return one_line(f"{control.node}.{control.name}" + (f" ({told})" if told else ""))


def _on_off(value: object) -> str:
    return "on" if value else "off"


def _values(values: Mapping[str, str]) -> str:
    """What an event carries besides its text; the start of its clock is nothing to read."""
    return "".join(f", {key} {value}" for key, value in values.items() if key != "start_ns")


def _shown(text: str) -> str:
    """A text of a log or a node inside HTML."""
    return escape(one_line(text))


def _status_text(title: str, status: Status) -> str:
    seconds, length = (status.now_ns - status.start_ns) * 1e-9, (status.end_ns - status.start_ns) * 1e-9
    colour = _COLOURS[status.state]
    remark = f", {_shown(status.remark)}" if status.remark else ""
    return (
        f"<b>{_shown(title)}</b> <span style='color:white;background:{colour};padding:2px 8px'>{status.state}</span>"
        f" <span class='pneumo-time'>{seconds:.2f} s</span> of {length:.2f} s{remark}"
    )
