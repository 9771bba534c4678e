# SPDX-License-Identifier: Apache-2.0
"""A session from its processes' start to their end, with a progress bar, and what becomes of its log."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.markup import escape

from pneumo_ros.cli.terminal import Console
from pneumo_ros.errors import InputError

if TYPE_CHECKING:
    from pneumo_ros.session.plan import Values
    from pneumo_ros.session.supervisor import Place
from pneumo_ros.cli.session_plan import session_nodes

FAILED = 1
INTERRUPTED = 130  # as a shell says of Ctrl-C
MIN_SAMPLES = 10  # fewer make no figures


def run_session(
    console: Console, values: Values, target: Path, single_process: bool, place: Place, verbose: bool
) -> int:
    """Start the nodes, show how far the session is, and see it end; a failed one exits with :data:`FAILED`.

    Returns the exit code: :data:`FAILED` as well where a timed session was cut short without any process failing.
    """
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    from pneumo_ros.session.supervisor import NodeProcess, SessionError, StopAsked, Supervisor

    rig_node = "daq" if "daq" in values else "plant"
    names = ("single_process",) if single_process else session_nodes("serial" if rig_node == "daq" else "sim")
    nodes = [NodeProcess(name, f"pneumo_ros.nodes.{name}") for name in names]
    lead = "single_process" if single_process else rig_node
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.1f} s of {task.fields[length]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    length = float(values[rig_node]["duration"])
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("session", total=length or None, length=f"{length:g} s" if length else "any")
        show = (lambda node, line: console.print(f"{node}: {line}", markup=False)) if verbose else (lambda _, __: None)
        supervisor = Supervisor(nodes, values, lead, place, lambda t: progress.update(task, completed=t), show)
        try:
            with supervisor:
                supervisor.wait()
            progress.stop()
            return _tell_early(console, target, rig_node, bool(length))
        except SessionError as error:
            progress.stop()
            Console(stderr=True, highlight=False, soft_wrap=True).print(
                f"[red]session failed:[/red] {escape(str(error))}"
            )
            _save_what_is_left(target)
            raise typer.Exit(FAILED) from error
        except StopAsked as asked:
            progress.stop()
            _tell_stopped(console, target, str(asked), supervisor.failure_of_lead())
    return 0


def _tell_early(console: Console, target: Path, rig_node: str, timed: bool) -> int:
    """The exit code of a session that nobody ended, and a word where it was over before its time: somebody stopped the
    node that is the rig.
    """
    from pneumo_ros.log.inspection import end_of_session
    from pneumo_ros.log.reading import read_log

    complete, reason = end_of_session(read_log(target, []))
    if not complete:
        err = Console(stderr=True, highlight=False, soft_wrap=True)
        err.print(f"[red]session failed:[/red] {escape(reason)}")
        return FAILED
    if not timed:
        console.print(f"stopped by whoever ended node {rig_node}; the log is finished")
    return 0


def _tell_stopped(console: Console, target: Path, by: str, failure: str) -> None:
    """What became of the log when somebody ended the session; an end before the first sample leaves none."""
    from pneumo_ros.log import topics
    from pneumo_ros.log.reading import read_log

    if failure:
        console.print(f"stopped by {by}, after this: {failure}", markup=False, soft_wrap=True)
        _save_what_is_left(target)
        raise typer.Exit(FAILED)
    if not target.exists():
        console.print(f"stopped by {by} before the session began: there is no log")
        raise typer.Exit(INTERRUPTED)
    found = read_log(target, [topics.DISPLACEMENT.name]).topics.get(topics.DISPLACEMENT.name)
    if found is None or found.count < MIN_SAMPLES:
        console.print(f"stopped by {by} before there was anything to show; the log holds the start: {target}")
        raise typer.Exit(INTERRUPTED)
    console.print(f"stopped by {by}; the log is finished")


def _save_what_is_left(target: Path) -> None:
    """Say where the log is; if its recorder died, make a readable one of what it had written."""
    from pneumo_ros.log.repair import recover

    out = Console(stderr=True, highlight=False, soft_wrap=True)
    part = target.with_name(target.name + ".part")
    if target.exists():
        out.print(f"log until then: {target}")
        return
    if not part.exists():
        return
    try:
        found = recover(part, target.with_suffix(".recovered.mcap"))
    except InputError as error:
        out.print(f"the recorder left nothing that can be read: {error}")
        return
    out.print(f"recovered {found.kept} messages: {found.output}")
