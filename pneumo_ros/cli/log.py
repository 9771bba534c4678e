# SPDX-License-Identifier: Apache-2.0
"""``pneumo log``: look into logs, check them, repair, export and compare them."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from pneumo_ros.cli.app import App
from pneumo_ros.cli.terminal import Console

if TYPE_CHECKING:
    from pneumo_ros.log.comparison import Comparison
    from pneumo_ros.log.inspection import Report, TopicReport
    from pneumo_ros.log.repair import Recovery
    from pneumo_ros.log.salvage import Salvaged

app = App(
    add_completion=False, help="Look into a session log, check, repair, export and compare.", no_args_is_help=True
)
console = Console()

LogPath = Annotated[Path, typer.Argument(help="Session log (.mcap) or a folder as `ros2 bag record` writes it.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing output.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")]

_EVENTS_SHOWN = 40
ROUNDING = 1e-12  # of mm, kPa, mm2 ...: what adding up leaves of nothing
_WIDE = 130  # columns from which the types are shown as well
_LEVELS = {0: "info", 1: "warning", 2: "error", 3: "stale"}
_COLOUR = {"ok": "green", "note": "cyan", "warning": "yellow", "error": "red"}
FINDINGS_EXIT = 1
_FOR_PROGRAMS = ("rosbag2",)  # metadata that nobody reads
_TOLD_BELOW = "parameters"  # of the metadata: every node says its own
_NO_SIGNALS = ("/diagnostics", "/rig/events")
_SHOWN_AS = {  # SI unit -> factor and the unit whose numbers are short
    "m": (1e3, "mm"), "m/s": (1e3, "mm/s"), "m2": (1e6, "mm2"), "Pa": (1e-3, "kPa"), "rad": (1e3, "mrad"),
}  # fmt: skip


@app.command("map")
def propose_map(
    log: Annotated[Path, typer.Argument(help="A log of any rig: .mcap, a bag folder, .csv, .parquet, .mat.")],
    output: Annotated[Path | None, typer.Option(help="Write the proposal here instead of printing it.")] = None,
    overwrite: Overwrite = False,
) -> None:
    """Propose a rig file (rig.yaml) for a rig of your own from what is in a log: every number that moves."""
    from pneumo_ros.cli.existing import refuse_existing
    from pneumo_ros.files import new_file
    from pneumo_ros.own_rig.propose import proposal

    text = proposal(log)
    if output is None:
        typer.echo(text, nl=False)
        return
    refuse_existing([output], overwrite)
    with new_file(output) as part:
        part.write_text(text, encoding="utf-8")
    console.print(f"written: {output}", highlight=False, soft_wrap=True)


@app.command()
def info(log: LogPath, as_json: AsJson = False) -> None:
    """What a log holds: topics, rates, gaps, jitter, clock jumps, rig, parameters, versions, events."""
    from pneumo_ros.log.inspection import inspect_log
    from pneumo_ros.log.reading import read_log

    report = inspect_log(read_log(log))
    if as_json:
        typer.echo(json.dumps(asdict(report), indent=2, default=str))
    else:
        _show_report(report)


@app.command()
def validate(log: LogPath, as_json: AsJson = False) -> None:
    """Does the log keep the contract? One line a finding; exit code 1 if it does not."""
    from pneumo_ros.log.conformance import breaks_contract, check_conformance
    from pneumo_ros.log.reading import read_log

    findings = check_conformance(read_log(log))
    if as_json:
        typer.echo(json.dumps([asdict(f) for f in findings], indent=2))
    else:
        for f in findings:
            console.print(f"[{_COLOUR[f.level]}]{f.level:8}[/] {f.about}: {f.text}", highlight=False, soft_wrap=True)
        counts = [f"{sum(f.level == level for f in findings)} {level}" for level in ("error", "warning", "note")]
        console.print(", ".join(counts), highlight=False)
    if breaks_contract(findings):
        raise typer.Exit(FINDINGS_EXIT)


@app.command()
def recover(
    log: LogPath,
    output: Annotated[Path, typer.Option("--output", "-o", help="The new log (.mcap); the original is only read.")],
    overwrite: Overwrite = False,
) -> None:
    """Make a readable log of a truncated or corrupted one, and say what was lost."""
    from pneumo_ros.log.repair import recover as recover_log

    _show_recovery(recover_log(log, output, overwrite))


@app.command()
def export(
    log: LogPath,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for one file a topic; made if missing.")],
    kind: Annotated[str, typer.Option("--format", "-f", help="csv, parquet or mat.")] = "csv",
    topic: Annotated[list[str] | None, typer.Option("--topic", "-t", help="Only this topic; may be repeated.")] = None,
    overwrite: Overwrite = False,
    merged: Annotated[
        bool, typer.Option("--merged", help="One table of all topics with numbers, at the sensors' instants.")
    ] = False,
) -> None:
    """Write topics as tables for pandas or MATLAB: log_time_ns, stamp_ns and one column a channel, SI units."""
    from pneumo_ros.log.reading import read_log
    from pneumo_ros.log.tables import export as export_tables
    from pneumo_ros.log.tables import export_merged

    if merged:
        console.print(
            str(export_merged(read_log(log), output, kind, topic, overwrite)), highlight=False, soft_wrap=True
        )
        return
    for path in export_tables(read_log(log), output, kind, topic, overwrite):
        console.print(str(path), highlight=False, soft_wrap=True)


@app.command()
def compare(
    first: LogPath,
    second: Annotated[Path, typer.Argument(help="The log to compare it with.")],
    as_json: AsJson = False,
) -> None:
    """Two logs side by side: topics, settings, and the difference of every signal at equal times."""
    from pneumo_ros.log.comparison import compare as compare_logs
    from pneumo_ros.log.reading import read_log

    result = compare_logs(read_log(first), read_log(second))
    if as_json:
        typer.echo(json.dumps(asdict(result), indent=2, default=str))
    else:
        _show_comparison(result)


@app.command()
def scene(
    log: LogPath,
    output: Annotated[Path, typer.Option("--output", "-o", help="Log to write (.mcap).")],
) -> None:
    """The rig's motion as joint states, transforms and URDF, for viewers that show a robot in 3D."""
    from pneumo_ros.log.reading import read_log
    from pneumo_ros.log.scene import write_scene

    count = write_scene(read_log(log), output)
    console.print(
        f"{output}  {count} instants; layout config/layouts/foxglove_3d.json", highlight=False, soft_wrap=True
    )


@app.command()
def report(
    log: LogPath,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Page to write (.html); beside the log by default.")
    ] = None,
    rig: Annotated[
        Path | None, typer.Option(help="Rig file (YAML), where the log's rig names an effect of your own.")
    ] = None,
) -> None:
    """One HTML page: summary, pictures, timing, trips, parameters, versions, conformance."""
    from pneumo_ros.cli.passive import passive_run
    from pneumo_ros.log.reading import read_log
    from pneumo_ros.rig import load_rig
    from pneumo_ros.session.report import write_report
    from pneumo_ros.session.summary import load_session

    target = output or log.with_suffix(".html")
    write_report(read_log(log), target, passive_run(load_session(log), None if rig is None else load_rig(rig)))
    console.print(f"report   {target}", highlight=False, soft_wrap=True)


def _show_report(report: Report) -> None:
    console.print(f"[bold]{report.path}[/]  written by {report.library}, {report.count} messages", highlight=False)
    start = report.start_ns
    _show_events(report, start)
    console.print(_topics_table([topic for topic in report.topics if topic.count]))
    empty = ", ".join(topic.name for topic in report.topics if not topic.count)
    if empty:
        console.print(f"no messages on: {empty}", highlight=False)
    for topic in report.topics:
        if topic.timing is not None and topic.timing.gaps:
            console.print(f"[yellow]{topic.name}[/]: {topic.timing.gaps_in_words}", highlight=False)
    if report.missing_topics:
        console.print(f"[red]missing topics[/] {', '.join(report.missing_topics)}")
    if report.unprotected:
        console.print("[yellow]some content carries no checksum[/]: damage in it cannot be seen")
    _show_settings(report, start)


def _seconds(time_ns: int, start: int) -> str:
    """Since the first sample; what was noted before it was there from the start."""
    return f"{max(time_ns - start, 0) * 1e-9:.3f}"


def _topics_table(found: Sequence[TopicReport]) -> Table:
    wide = console.width >= _WIDE
    title = "Topics; jitter and delay (p50, p99) in ms"
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)
    table.add_column("topic", no_wrap=True)
    if wide:
        table.add_column("type", no_wrap=True)
    for name in ("count", "s", "Hz", "jitter", "missing", "delay", "clock"):
        table.add_column(name, justify="right", no_wrap=name != "clock")
    for topic in found:
        table.add_row(topic.name, *([topic.type] if wide else []), *_topic_figures(topic))
    return table


def _topic_figures(topic: TopicReport) -> list[str]:
    t = topic.timing
    if t is None:
        return [str(topic.count), *[""] * 6]
    clock = [f"{n} {word}" for n, word in ((t.backward, "back"), (t.repeated, "equal"), (t.jumps, "set")) if n]
    delay = ", ".join(_two_digits(1e3 * one) for one in (t.delay_p50, t.delay_p99))
    regular = [
        form(one) if math.isfinite(one) else "" for one, form in ((t.rate_hz, _hertz), (1e3 * t.jitter, _two_digits))
    ]
    numbers = [f"{topic.duration:.2f}", *regular, str(t.missing), delay]
    return [str(topic.count), *numbers, ", ".join(clock) or "ok"]


def _hertz(value: float) -> str:
    return f"{value:.4g}"


def _two_digits(value: float) -> str:
    """Of a width that a column can count on: 9.6, 53, 382."""
    return f"{value:.0f}" if abs(value) >= 10.0 else f"{value:.2g}"


def _show_settings(report: Report, start: int) -> None:
    from pneumo_ros.log.inspection import told_settings

    console.print("\n[bold]What explains the run[/]")
    _say("rig", report.rig or "not in the log")
    for key, (nominal, ours) in report.changed_parameters.items():
        _say(f"rig, {key}", f"{ours:g} (nominal {nominal:g})")
    for text in report.found_in_rig:
        _say("rig, as diagnosed", text)
    for name, entries in report.metadata:
        if name in _FOR_PROGRAMS:
            continue
        plain = {key: value for key, value in entries.items() if key != _TOLD_BELOW}
        shown = [f"{key} {_short(value)}" for key, value in plain.items() if value and "\n" not in value]
        shown += [f"{key} ({len(value)} characters)" for key, value in plain.items() if "\n" in value]
        _say(name, ", ".join(shown))
    for time_ns, node, began, new in told_settings(report.setups):
        word = "at the start" if began else f"changed at {_seconds(time_ns, start)} s"
        _say(f"{node} {word}", ", ".join(f"{key} {_short(value)}" for key, value in new.items() if value != ""))
    for time_ns, calibration in report.calibrations:
        _say(f"calibration from {_seconds(time_ns, start)} s on", _short(" ".join(calibration.split())))
    for name, size in report.attachments:
        _say("attachment", f"{name}, {size} bytes")


def _say(what: str, text: str) -> None:
    console.print(f"[cyan]{escape(what)}[/]: {escape(text)}", highlight=False)


def _short(value: object, limit: int = 120) -> str:
    text = str(value)
    return text if len(text) <= limit else f"{text[:limit]}... ({len(text)} characters)"


def _show_events(report: Report, start: int) -> None:
    if not report.events:
        console.print("no events")
        return
    table = Table(title="Events", title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)
    for name in ("s", "level", "node", "what"):
        table.add_column(name, justify="right" if name == "s" else "left", no_wrap=name != "what")
    for event in report.events[:_EVENTS_SHOWN]:
        values = ", ".join(f"{k} {v}" for k, v in event.values.items() if k != "start_ns")
        text = f"{event.code}: {event.message}" + (f" ({values})" if values else "")
        level = _LEVELS.get(event.level, str(event.level))
        table.add_row(_seconds(event.time_ns, start), level, event.source, escape(text))
    console.print(table)
    if len(report.events) > _EVENTS_SHOWN:
        console.print(f"... and {len(report.events) - _EVENTS_SHOWN} more (--json shows all)")


def _show_recovery(result: Recovery) -> None:
    from pneumo_ros.log.repair import describe

    found = result.salvaged
    console.print(f"{result.output}: {result.kept} messages kept, {_lost(found)}", highlight=False, soft_wrap=True)
    for loss in found.losses:
        console.print(f"[yellow]lost[/] {describe(loss)}", highlight=False, soft_wrap=True)
    for note in found.notes:
        console.print(f"[cyan]note[/] {note}", highlight=False, soft_wrap=True)


def _lost(found: Salvaged) -> str:
    if found.expected is not None:
        return f"{found.lost} of {found.expected} lost"
    torn = f"; the broken stretches held about {found.lost}" if found.lost else ""
    return f"how many the log once held is not known{torn}"


def _show_comparison(result: Comparison) -> None:
    for title, names in (("only in the first", result.only_first), ("only in the second", result.only_second)):
        if names:
            console.print(f"{title}: {', '.join(names)}", highlight=False)
    _show_kinship(result)
    settings = Table("where", "key", "first", "second", title="Settings that differ", title_justify="left",
                     box=SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)  # fmt: skip
    for d in result.settings:
        settings.add_row(d.where, d.key, escape(_short(d.first, 60)), escape(_short(d.second, 60)))
    console.print(settings if result.settings else "same settings")
    counts = Table("topic", "first", "second", "payload", title="Messages", title_justify="left", box=SIMPLE_HEAD)
    for name, (a, b) in result.counts.items():
        if a == b == 0:
            continue  # of nothing there is nothing to compare
        counts.add_row(name, str(a), str(b), "equal byte by byte" if name in result.identical else "differs")
    console.print(counts)
    console.print(_signals_table(result))


def _show_kinship(result: Comparison) -> None:
    """Whether road and rig are the same, and how the logs were laid over each other."""
    rig = [d.key for d in result.settings if d.where == "rig"]
    if rig:
        console.print(f"[yellow]two rigs[/]: {', '.join(rig)} differ", highlight=False)
    if result.roads == "two":
        console.print("[yellow]two roads[/]: differences are of the roads as well; laid over each other at their start")
    elif result.roads == "same":
        moved = f"; the second log is moved by {-result.offset:+.3f} s to meet it" if result.offset else ""
        console.print(f"same road{moved}", highlight=False)


def _signals_table(result: Comparison) -> Table:
    signals = Table(title="Signals: std of each, difference at equal times", title_justify="left", box=SIMPLE_HEAD,
                    padding=(0, 1, 0, 0), pad_edge=False)  # fmt: skip
    signals.add_column("topic, column", no_wrap=True)
    for title in ("unit", "first", "second", "count", "rms", "largest"):
        signals.add_column(title, justify="right", no_wrap=True)
    before = ""
    for s in (s for s in result.signals if s.topic not in _NO_SIGNALS):
        if s.topic != before:
            signals.add_row(s.topic)
            before = s.topic
        factor, unit = _SHOWN_AS.get(s.unit, (1.0, s.unit))
        std, gap = [_number(factor * one) for one in s.std], [_number(factor * one) for one in (s.rms, s.largest)]
        signals.add_row(f"  {s.column}", unit, *std, str(s.common), *gap)
    return signals


def _number(value: float) -> str:
    if abs(value) < ROUNDING:
        value = 0.0
    short = f"{value:.3g}" if abs(value) >= 1e-2 or not value else f"{value:.2g}"
    return short.replace("e+0", "e").replace("e-0", "e-") if math.isfinite(value) else "-"


if __name__ == "__main__":
    app()
