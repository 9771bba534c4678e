# SPDX-License-Identifier: Apache-2.0
"""What the session's page says, as plain rows; the template only lays it out."""

from __future__ import annotations

import base64
import math
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pneumo_ros.log.conformance import Finding, check_conformance
from pneumo_ros.log.decoded import Log
from pneumo_ros.log.inspection import Event, Report, Setup, TopicReport, inspect_log, told_settings
from pneumo_ros.session.passive import passive_session
from pneumo_ros.session.picture import draw_session
from pneumo_ros.session.summary import (
    STEPS_NOTE,
    Recorded,
    Summary,
    change,
    counts_missed,
    figures,
    load_session,
    loop_timing,
    pace,
    ride_rows,
    summarise,
    wall_time,
)
from pneumo_ros.session.warnings import MISSED, of_the_session, warnings_of
from pneumo_ros.units import SQUARE_INCH

LEVELS = {0: "info", 1: "warning", 2: "error", 3: "stale"}
_LONG = 2000  # characters of a value shown; whole files belong into the log, not on a page
_HIDDEN = ("rosbag2",)  # metadata for other programs

Row = tuple[str, ...]


def contents(log: Log, passive: Recorded | None = None) -> dict[str, Any]:
    """Variables of the template.

    Parameters
    ----------
    log : the session's log
    passive : the same road with valves at trim, if the caller has simulated it already; a rig with effects needs it
    """
    report = inspect_log(log)
    session = load_session(log.path)
    if (
        passive is None
        and not session.rig.diagnosed
        and max(len(session.truth), len(session.measured)) > 1
        and len(session.road) > 1
    ):
        passive = passive_session(session)
    loop = loop_timing(log)
    ours = summarise(session, loop, wall_time(log), warnings_of(log, loop, session.mode))
    theirs = summarise(passive) if passive is not None else None
    findings = check_conformance(log)
    return {
        "title": log.path.name,
        "facts": _facts(report),
        "ending": _ending(report),
        "trips": [_event_row(event, report) for event in of_the_session(report.events) if event.level >= 1],
        "summary": summary_rows(ours, theirs),
        "has_passive": theirs is not None,
        "picture": _picture(session, passive, log.path.name),
        "pace": pace(ours),
        "stretch": ours.stretch,
        "judged_by": ours.judged_by,
        "warnings": ours.warnings,
        "steps_note": STEPS_NOTE,
        "misses": counts_missed(ours),
        "loop": loop_rows(ours),
        "topics": [topic_row(topic) for topic in report.topics],
        "events": [_event_row(event, report) for event in report.events],
        "calibrations": [(_since_start(time_ns, report), text) for time_ns, text in report.calibrations],
        "setups": list(setup_rows(report.setups, report.start_ns)),
        "rig": [(name, f"{nominal:g}", f"{value:g}") for name, (nominal, value) in report.changed_parameters.items()]
        + [("as diagnosed", "", text) for text in report.found_in_rig],
        "rig_name": report.rig or "not in the log",
        "metadata": [
            (n, k, _short(v)) for n, entries in report.metadata if n not in _HIDDEN for k, v in entries.items()
        ],
        "findings": [(f.level, f.about, f.text) for f in findings],
        "tone": _tone(findings, report.events),
    }


def summary_rows(ours: Summary, theirs: Summary | None) -> list[Row]:
    """(figure, unit, session, passive, change) of each figure of `pneumo run`'s table."""
    rows: list[Row] = []
    passive = ride_rows(theirs.ride) if theirs is not None and theirs.ride is not None else []
    for i, (name, unit, values, form) in enumerate(ride_rows(ours.ride) if ours.ride is not None else []):
        other = passive[i][2] if passive else []
        rows.append((name, unit, figures(values, form), figures(other, form), change(values, other)))
    rows.append(("inlets saturated, f / r", "% of time", figures([100.0 * s for s in ours.saturation], "%.1f"), "", ""))
    if ours.area_error is not None:
        error = figures([e / SQUARE_INCH for e in ours.area_error], "%.3f")
        rows.append(("area estimate, rms error, f / r", "in2", error, "", ""))
    return rows


def loop_rows(summary: Summary) -> list[Row]:
    """(node, steps, period p50, p99, max, step p50, p99, max, missed), ms."""
    rows = []
    for node, values in summary.loop.items():
        if values.get("steps", "0") != "0":
            keys = [f"{label} {p} (us)" for label in ("period", "step") for p in ("p50", "p99", "max")]
            cells = [f"{float(values.get(key, 'nan')) / 1e3:.3g}" for key in keys]
            missed = (values.get(MISSED, ""),) if counts_missed(summary) else ()
            rows.append((node, values["steps"], *cells, *missed))
    return rows


def topic_row(topic: TopicReport) -> Row:
    """(topic, type, messages, length s, rate Hz, jitter ms, missing, delay ms p50 / p99, clock)."""
    t = topic.timing
    if t is None:
        return (topic.name, topic.type, str(topic.count), "", "", "", "", "", "")
    clock = [f"{n} {word}" for n, word in ((t.backward, "back"), (t.repeated, "equal"), (t.jumps, "set")) if n]
    missing = f"{t.missing} {t.where_missing}" if t.gaps else "0"
    delay = f"{t.delay_p50 * 1e3:.3g} / {t.delay_p99 * 1e3:.3g}"
    regular = [
        f"{one:.{digits}g}" if math.isfinite(one) else "" for one, digits in ((t.rate_hz, 6), (1e3 * t.jitter, 3))
    ]
    figures = (f"{topic.duration:.3f}", *regular, missing, delay)
    return (topic.name, topic.type, str(topic.count), *figures, ", ".join(clock) or "steady")


def setup_rows(setups: Sequence[Setup], start_ns: int) -> Iterator[Row]:
    """(time s since the first sample, node, what, parameters): all at the start, later only what changed."""
    for time_ns, node, began, new in told_settings(setups):
        shown = ", ".join(f"{key} {_short(str(value))}" for key, value in new.items() if value != "")
        yield (_seconds(time_ns - start_ns), node, "start" if began else "changed", shown)


def _facts(report: Report) -> list[tuple[str, str]]:
    known = {key: value for name, entries in report.metadata if name == "pneumo_ros" for key, value in entries.items()}
    wanted = ("started_utc", "source", "road", "controller", "seed", "mode", "rate_hz")
    facts = [(key.replace("_", " "), known[key]) for key in wanted if key in known]
    return [
        *facts,
        ("length", f"{report.duration:.3f} s"),
        ("messages", str(report.count)),
        ("written by", report.library),
    ]


def _ending(report: Report) -> str:
    session = next((entries for name, entries in report.metadata if name == "session"), {})
    if session.get("complete") == "false":
        return f"not complete: {session.get('reason') or 'the log does not say why'}"
    last = [event for event in report.events if event.code.startswith("session_") and event.code != "session_started"]
    return f"{last[-1].code}: {last[-1].message}" if last else "the log does not say how the session ended"


def _event_row(event: Event, report: Report) -> Row:
    values = ", ".join(f"{key} {value}" for key, value in event.values.items())
    level = LEVELS.get(event.level, str(event.level))
    return (_since_start(event.time_ns, report), level, event.source, event.code, event.message, values)


def _since_start(time_ns: int, report: Report) -> str:
    return _seconds(time_ns - report.start_ns)


def _seconds(since_ns: int) -> str:
    """What was noted before the first sample was there from the start."""
    return f"{max(since_ns, 0) * 1e-9:.3f}"


def _tone(findings: Sequence[Finding], events: Sequence[Event]) -> str:
    if any(f.level == "error" for f in findings) or any(e.level >= 2 for e in events):
        return "bad"
    return "doubtful" if any(f.level == "warning" for f in findings) or any(e.level == 1 for e in events) else "fine"


def _picture(session: Recorded, passive: Recorded | None, title: str) -> str:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "session.png"
        draw_session(session, path, passive, title)
        return base64.b64encode(path.read_bytes()).decode()


def _short(text: str) -> str:
    return text if len(text) <= _LONG else f"{text[:_LONG]}... ({len(text)} characters)"
