# SPDX-License-Identifier: Apache-2.0
"""``pneumo replay``: a log again - live into ROS, stepped through today's code, or its road through the rig."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich import box
from rich.table import Table

from pneumo_ros.cli.app import App
from pneumo_ros.cli.rig_notes import tell_assumed
from pneumo_ros.cli.terminal import Console
from pneumo_ros.documents import parse_json
from pneumo_ros.errors import InputError

if TYPE_CHECKING:
    from pneumo_ros.log.decoded import Log
    from pneumo_ros.rig import Rig
    from pneumo_ros.session.replay import Replayed
    from pneumo_ros.session.rerun import Rerun
    from pneumo_ros.session.what_if import Row

app = App(add_completion=False)
console = Console()
DIFFERS = 1
SHOWN = {"m": ("mm", 1e3), "Pa": ("kPa", 1e-3)}  # unit -> unit that people read, and factor to it


@dataclass(frozen=True)
class Given:
    """What the user puts in place of what the log says: parameters, rig file, effects' files, valve profile."""

    overrides: Mapping[str, Mapping[str, Any]]
    rig: Path | None
    effects: tuple[Path, ...]
    valves: Path | None


@app.command()
def replay(
    log: Annotated[
        Path, typer.Argument(help="Session log (.mcap) or bag folder; a damaged one as far as it is whole.")
    ],
    stepped: Annotated[
        bool, typer.Option("--stepped", help="Through today's estimator and controller, compared sample by sample.")
    ] = False,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", help="node.parameter=value, repeatable: what would have been commanded?"),
    ] = None,
    closed_loop: Annotated[
        bool, typer.Option("--closed-loop", help="The recorded road through the rig's model, which then reacts.")
    ] = False,
    open_loop: Annotated[
        bool, typer.Option("--open-loop", help="The recorded road and valve openings through any rig (--rig).")
    ] = False,
    diagnosis: Annotated[
        Path | None, typer.Option(help="diagnosis.json: --closed-loop runs the rig as it was diagnosed.")
    ] = None,
    rig: Annotated[
        Path | None,
        typer.Option(
            help="Rig file (YAML) in place of the log's: --closed-loop runs it with its effects, --stepped believes it."
        ),
    ] = None,
    effect: Annotated[
        list[Path] | None,
        typer.Option(
            help="Python file with an effect that the log's rig names, repeatable; a log's own path is not used."
        ),
    ] = None,
    valves: Annotated[
        Path | None,
        typer.Option(help="Valve profile that the session played; the path that a log names is never opened."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Write the log with the replayed topics in place (.mcap).")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Write the overlay plot here (.png).")] = None,
    rate: Annotated[float, typer.Option(help="Live: speed, 1 is real time.", min=0.01, max=100.0)] = 1.0,
    start: Annotated[float, typer.Option(help="Live: begin this many seconds into the log.", min=0.0)] = 0.0,
    paused: Annotated[bool, typer.Option("--paused", help="Live: wait for space, or parameter paused=false.")] = False,
    loop: Annotated[bool, typer.Option("--loop", help="Live: begin again at the end.")] = False,
    everything: Annotated[
        bool, typer.Option("--all", help="Live: republish recorded outputs too, not only what the nodes take in.")
    ] = False,
    domain_id: Annotated[int | None, typer.Option(help="Live: DDS domain.", min=0, max=232)] = None,
) -> None:
    """Replay a log. Live by default: its inputs are published again, with /clock, for nodes that run beside it."""
    from pneumo_ros.log.salvage import read_or_salvage

    found, remark = read_or_salvage(log)
    if remark:
        console.print(f"[yellow]{remark}[/]", highlight=False, soft_wrap=True)
    if open_loop:
        if closed_loop or stepped or set_ or diagnosis is not None:
            raise InputError("the valves are the recorded ones, so no controller runs", where="--open-loop",
                             remedy="leave out --closed-loop, --stepped, --set and --diagnosis")  # fmt: skip
        _open_loop(found, rig, plot)
    elif closed_loop or diagnosis is not None:
        given = Given(parse_overrides(set_), rig, tuple(effect or ()), valves)
        _closed_loop(found, given, diagnosis, plot)
    elif stepped or set_:
        _stepped(found, Given(parse_overrides(set_), rig, (), valves), output, plot)
    else:
        if rig is not None:
            raise InputError("a live replay publishes what was recorded and simulates no rig", where="--rig",
                             remedy="add --closed-loop, or leave it out")  # fmt: skip
        from pneumo_ros.cli.replay_live import play

        play(found, rate, start, paused, loop, everything, domain_id)


def parse_overrides(texts: list[str] | None) -> dict[str, dict[str, Any]]:
    """``controller.pole=20`` ... -> node -> parameter -> value.

    Raises
    ------
    InputError
        if a text is of another form or names a node that replay does not run.
    """
    from pneumo_ros.session.plan import parse_setting
    from pneumo_ros.session.replay import TABLES

    out: dict[str, dict[str, Any]] = {}
    for text in texts or []:
        node, name, value = parse_setting(text)
        if node not in TABLES:
            raise InputError("not a node that replay runs", where="--set", key=node, allowed=", ".join(TABLES))
        out.setdefault(node, {})[name] = value
    return out


def _believed(log: Log, path: Path | None) -> Rig | None:
    """The rig that estimator and controller believe; that its effects do nothing here is said."""
    from pneumo_ros.rig import load_rig

    rig = log.config if path is None else load_rig(path)
    if rig is not None and rig.effects:
        names = ", ".join(one.label for one in rig.effects)
        text = f"the measurements are the recorded ones, so the rig's effects do nothing here: {names}"
        console.print(f"[cyan]note[/] {text}", highlight=False, soft_wrap=True)
    return rig


def _stepped(log: Log, given: Given, output: Path | None, plot: Path | None) -> None:
    from pneumo_ros.log.rewriting import refuse_target, write_log
    from pneumo_ros.session.replay import replay as step
    from pneumo_ros.session.replay import replayed_log, warm_up

    overrides, rig = given.overrides, _believed(log, given.rig)
    if output is not None:
        refuse_target(output, log.path)
    warm_up(log)
    begin = time.perf_counter()
    result = step(log, overrides, rig, given.valves)
    took = time.perf_counter() - begin
    _show_run(result, took)
    if overrides:
        _show_what_if(log, result, rig, plot)
    else:
        console.print(agreement_table(result))
        if plot is not None:
            _draw(result, plot, f"{log.path.name}, replayed")
    if output is not None:
        write_log(replayed_log(log, result), output, {"replay": {"source": log.path.name, "set": str(dict(overrides))}})
        console.print(f"log      {output}", highlight=False, soft_wrap=True)
    if not overrides and any(not a.identical for a in result.agreements):
        raise typer.Exit(DIFFERS)


def _show_run(result: Replayed, took: float) -> None:
    span = (result.estimate.stamp_ns[-1] - result.estimate.stamp_ns[0]) * 1e-9 if len(result.estimate.stamp_ns) else 0.0
    speed = f"{span / took:.0f} times real time" if took > 0.0 else ""
    console.print(f"{len(result.estimate.stamp_ns)} samples, {span:.3f} s, in {took:.2f} s ({speed})", highlight=False)
    if result.skipped:
        console.print(
            f"{result.skipped} of {result.samples} samples were never taken by the running estimator; left out"
        )
    for note in result.notes:
        console.print(f"[cyan]note[/] {note}", highlight=False, soft_wrap=True)


def agreement_table(result: Replayed) -> Table:
    """Each replayed topic beside its recording."""
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("topic", no_wrap=True)
    for title in ("samples", "equal bytes", "first difference s", "largest difference"):
        table.add_column(title, justify="right")
    start = int(result.estimate.stamp_ns[0]) if len(result.estimate.stamp_ns) else 0
    for a in result.agreements:
        worst = max(range(len(a.names)), key=lambda k: a.largest[k], default=0)
        largest = "0" if a.identical or not a.largest else f"{a.largest[worst]:.3g} ({a.names[worst]})"
        first = "" if a.first_difference_ns is None else f"{(a.first_difference_ns - start) * 1e-9:.3f}"
        table.add_row(a.topic, str(a.compared), "all" if a.identical else str(a.equal), first, largest)
    return table


def _show_what_if(log: Log, result: Replayed, rig: Rig | None, plot: Path | None) -> None:
    from pneumo_ros.rig import load_rig
    from pneumo_ros.session.what_if import CAVEAT, what_if

    changed = ", ".join(
        f"{node}.{name} = {value}" for node, own in result.overridden.items() for name, value in own.items()
    )
    console.print(f"what if {changed}", highlight=False, soft_wrap=True)
    console.print(what_if_table(what_if(result, rig or load_rig())))
    console.print(CAVEAT, highlight=False, soft_wrap=True)
    _draw(result, plot or log.path.with_name(f"{log.path.stem}-what-if.png"), f"{log.path.name}: {changed}")


def what_if_table(rows: list[Row]) -> Table:
    """Recorded and replayed figures."""
    table = Table("figure", "unit", "recorded", "replayed", "change", box=box.SIMPLE_HEAD)
    for row in rows:
        change = f"{100.0 * (row.replayed / row.recorded - 1.0):+.1f} %" if row.recorded else ""
        table.add_row(row.name, row.unit, f"{row.recorded:.4g}", f"{row.replayed:.4g}", change)
    return table


def _draw(result: Replayed, path: Path, title: str) -> None:
    from pneumo_ros.session.what_if import draw_overlay

    draw_overlay(result, path, title)
    console.print(f"picture  {path}", highlight=False, soft_wrap=True)


def _closed_loop(log: Log, given: Given, diagnosis: Path | None, plot: Path | None) -> None:
    from pneumo_ros.session.rerun import draw_rerun

    result = _again(log, given) if diagnosis is None else _diagnosed(log, given, diagnosis)
    for note in result.notes:
        console.print(f"[cyan]note[/] {note}", highlight=False)
    console.print(rerun_table(result))
    if plot is not None:
        draw_rerun(result, plot, f"{log.path.name}: its road through the rig's model in closed loop")
        console.print(f"picture  {plot}", highlight=False, soft_wrap=True)


def _open_loop(log: Log, path: Path | None, plot: Path | None) -> None:
    from pneumo_ros.effects.stepping import stepped_rig
    from pneumo_ros.plant.stepping import plain_rig
    from pneumo_ros.rig import load_rig
    from pneumo_ros.session.rerun import draw_rerun, open_loop

    rig = log.config if path is None else load_rig(path)
    if rig is None:
        raise InputError("no /rig/config in the log", where=log.path, remedy="give the rig with --rig FILE.yaml")
    tell_assumed(console, rig, path)
    result = open_loop(log, rig, stepped_rig if rig.diagnosed else plain_rig)
    for note in result.notes:
        console.print(f"[cyan]note[/] {note}", highlight=False)
    console.print(rerun_table(result, "open loop"))
    if plot is not None:
        draw_rerun(result, plot, f"{log.path.name}: its road and openings through {rig.name}", "open loop, model")
        console.print(f"picture  {plot}", highlight=False, soft_wrap=True)


def _again(log: Log, given: Given) -> Rerun:
    """From rest, on the log's rig or the given one, with its effects if it has any."""
    from pneumo_ros.effects.configured import library_of, with_files
    from pneumo_ros.effects.loading import origins
    from pneumo_ros.effects.stepping import stepped_rig
    from pneumo_ros.rig import load_rig
    from pneumo_ros.session.rerun import rerun

    rig = log.config if given.rig is None else load_rig(given.rig)
    if rig is not None and rig.effects:
        rig = with_files(rig, given.effects)
        for text in origins(library_of(rig)):
            console.print(text, highlight=False, soft_wrap=True)
    build = stepped_rig if rig is not None and rig.diagnosed else None
    return rerun(log, given.overrides, rig, build, given.valves)


def _diagnosed(log: Log, given: Given, path: Path) -> Rerun:
    """On the rig as diagnosed; the rig given is the one that the diagnosis was told, if it was told one."""
    from pneumo_ros.diagnosis.half_car.closed_loop import rerun_diagnosed
    from pneumo_ros.diagnosis.half_car.signals import read_signals
    from pneumo_ros.effects.configured import with_files
    from pneumo_ros.log.inspection import read_setups, seed_of
    from pneumo_ros.rig import load_rig
    from pneumo_ros.session.replay import plan

    try:
        document = parse_json(path.read_text(encoding="utf-8"), path)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the diagnosis ({error})", where=path, remedy="give diagnosis.json") from error
    setups, notes = list(read_setups(log)), list[str]()
    nodes = ("estimator", "controller")
    values = [plan(setups, node, given.overrides.get(node, {}), notes, given.valves).start for node in nodes]
    seed = int(seed_of(log).get("plant", 0))
    signals = read_signals(log.path, None if given.rig is None else load_rig(given.rig))
    signals = replace(signals, rig=with_files(signals.rig, given.effects))
    result = rerun_diagnosed(signals, document, values[0], values[1], seed)
    return replace(result, notes=(*result.notes, *notes))


def rerun_table(result: Rerun, how: str = "closed loop") -> Table:
    """Each measured channel: as recorded, as the model gives it, in mm and kPa."""
    from pneumo_ros.session.rerun import compare_channels

    table = Table("channel", "unit", "std, recorded", f"std, {how}", "off by, of std", box=box.SIMPLE_HEAD)
    for name, unit, recorded, ours, gap in compare_channels(result):
        shown, factor = SHOWN.get(unit, (unit, 1.0))
        table.add_row(name, shown, f"{factor * recorded:.4g}", f"{factor * ours:.4g}", f"{gap:.3f}")
    table.caption, table.caption_justify = "off by: rms difference over the recorded std", "left"
    return table


if __name__ == "__main__":
    app()
