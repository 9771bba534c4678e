# SPDX-License-Identifier: Apache-2.0
"""What is made of a finished session: tables, picture, page."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer

from pneumo_ros.cli.interruption import Interrupted, interrupt
from pneumo_ros.cli.terminal import Console

if TYPE_CHECKING:
    from pneumo_ros.session.plan import Values
    from pneumo_ros.session.summary import Recorded


ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)  # who sends one asks for the session's end


class Wanted(NamedTuple):
    """What is made of a finished session."""

    summary: bool
    picture: bool
    page: bool


def report_unless_asked_to_end(console: Console, target: Path, values: Values, wanted: Wanted, code: int) -> None:
    """The session and its log are done; who asks again to end gets no report, and the session's own exit ``code``."""
    try:
        for number in ENDING:  # from the first one on an end may be asked for
            signal.signal(number, interrupt)
        _report(console, target, values, wanted)
    except Interrupted:
        _hear_no_more()
        console.print(f"no report was made; log {target}")
        raise typer.Exit(code) from None


@contextmanager
def heard_no_more_after() -> Iterator[None]:
    """Whoever asks for an end when all has ended is not heard: the signal would kill the leaving interpreter, and a
    finished session would end with a code that says otherwise.
    """
    try:
        yield
    finally:
        _hear_no_more()


def _hear_no_more() -> None:
    for number in ENDING:
        signal.signal(number, signal.SIG_IGN)


def _report(console: Console, target: Path, values: Values, wanted: Wanted) -> None:
    """Table of the active run beside passive valves on the same road, the picture and the page."""
    from pneumo_ros.cli.passive import passive_run
    from pneumo_ros.log.reading import read_log
    from pneumo_ros.rig import load_rig
    from pneumo_ros.session.summary import load_session

    if not any(wanted):
        console.print(f"log      {target}", soft_wrap=True)
        return
    session = load_session(target)
    other = passive_run(session, load_rig(str(values["road_profile"].get("rig", "")) or None))
    if wanted.summary:
        _summarise(console, target, session, other)
    console.print(f"log      {target}", soft_wrap=True)
    if wanted.picture:
        from pneumo_ros.session.picture import draw_session

        png = target.with_suffix(".png")
        draw_session(session, png, other, f"{values['controller']['controller']}, {target.name}")
        console.print(f"picture  {png}", soft_wrap=True)
    if wanted.page and session.left_out:
        console.print(f"report   none of a session this long; pneumo log report {target} makes it", soft_wrap=True)
    elif wanted.page:
        from pneumo_ros.session.report import write_report

        html = target.with_suffix(".html")
        write_report(read_log(target), html, other)
        console.print(f"report   {html}", soft_wrap=True)


def _summarise(console: Console, target: Path, session: Recorded, other: Recorded | None) -> None:
    """Tables of ride and loops, and what a reader must be warned of."""
    from pneumo_ros.cli.tables import summary_table, timing_table
    from pneumo_ros.log import topics
    from pneumo_ros.log.reading import read_log
    from pneumo_ros.session.summary import loop_timing, summarise, wall_time
    from pneumo_ros.session.warnings import warnings_of

    told = read_log(target, [topics.EVENTS.name, topics.DIAGNOSTIC.name])
    loop = loop_timing(told)
    ours = summarise(session, loop, wall_time(told), warnings_of(told, loop, session.mode))
    console.print(summary_table(ours, summarise(other) if other is not None else None))
    console.print(timing_table(ours))
    for line in ours.warnings:
        console.print(f"[yellow]warning[/]  {line}", highlight=False, soft_wrap=True)
