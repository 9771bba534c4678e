# SPDX-License-Identifier: Apache-2.0
"""`pneumo diagnose-all`: every log of a folder, one table of rigs by dates."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from pneumo_ros.cli.app import App
from pneumo_ros.cli.fleet_work import RESULT, Piece, diagnose_piece, finished
from pneumo_ros.cli.terminal import Console
from pneumo_ros.errors import InputError

if TYPE_CHECKING:
    from pneumo_ros.fleet.rows import Row
    from pneumo_ros.fleet.sessions import Session

app = App(add_completion=False)
TABLES = ("rigs.csv", "rigs.parquet", "rigs.html")
SENSIBLE = 946_684_800_000_000_000  # ns, 2000-01-01: stamps before it count from a start, not from 1970


@app.command()
def diagnose_all(
    folder: Annotated[Path, typer.Argument(help="Folder of logs, by rigs and dates (docs/fleet.md).", metavar="DIR")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder of the results, one below it for each log.")],
    rig_model: Annotated[
        Path | None, typer.Option("--rig-model", "--fmu", help="A rig of your own: rig.py or model.fmu.")
    ] = None,
    rig: Annotated[
        Path | None, typer.Option(help="Rig file (YAML) of all logs; default: as `pneumo diagnose`.")
    ] = None,
    pairs: Annotated[bool, typer.Option(help="Look for two effects at once as well.")] = True,
    only: Annotated[str, typer.Option(help="Only logs whose name contains this.")] = "",
    workers: Annotated[int, typer.Option(help="Local processes; 0: one a core.", min=0)] = 0,
    scheduler: Annotated[str, typer.Option(help="Dask scheduler, tcp://host:8786; its workers see the folders.")] = "",
) -> None:
    """Diagnose every log of a folder and write one table of rigs by dates: which effect grows where.

    Finished diagnoses are kept: the same command goes on after an interruption, and takes in what is new. A log that
    cannot be used is a row that says why. Exit code 2 if none can.
    """
    console = Console()
    sessions = [one for one in _sessions(folder, output, rig_model, rig) if only in one.name]
    if not sessions:
        raise InputError("no log in the folder", where=folder, key="--only" if only else None, value=only or None,
                         allowed="NAME-fit with NAME-holdout, folders with fit and holdout, single logs")  # fmt: skip
    pieces = {_piece(one, output, rig_model, rig, pairs): one for one in sessions}
    problems = _run(console, pieces, workers or os.cpu_count() or 1, scheduler)
    rows = [row for piece, one in pieces.items() for row in _rows(one, Path(piece.folder), problems.get(one.name, ""))]
    if len(problems) == len(sessions):
        raise InputError("no log can be used", where=folder, value=next(iter(problems.values())),
                         remedy="see the lines above")  # fmt: skip
    written = _written(output, rows, folder.resolve().name)
    _tell(console, rows)
    console.print("written: " + ", ".join(str(path) for path in written), highlight=False, soft_wrap=True)


def _sessions(folder: Path, output: Path, model: Path | None, rig: Path | None) -> list[Session]:
    from pneumo_ros.fleet.sessions import sessions_in

    for key, path in (("DIR", folder), ("--rig-model", model), ("--rig", rig)):
        if path is not None and not path.exists():
            raise InputError("no such file or folder", where=path, key=key, remedy="check the name")
    if not folder.is_dir():
        raise InputError("not a folder", where=folder, key="DIR", remedy="`pneumo diagnose` takes single logs")
    return sessions_in(folder, output, _beside(model, rig))


def _beside(model: Path | None, rig: Path | None) -> tuple[str, ...]:
    """Endings of files that hold an input of the log beside them."""
    if model is None:
        return ()
    from pneumo_ros.own_rig.description import read_description
    from pneumo_ros.own_rig.from_files import rig_file_of

    described = read_description(rig_file_of(model, rig))
    return tuple(spec.beside[1] for spec in (*described.channels.values(), *described.inputs.values()) if spec.beside)


def _piece(one: Session, output: Path, model: Path | None, rig: Path | None, pairs: bool) -> Piece:
    if model is not None:
        from pneumo_ros.own_rig.from_files import rig_file_of

        rig = rig_file_of(model, rig)
    fit, holdout, into, physics, names = (
        "" if path is None else str(path.resolve()) for path in (one.fit, one.holdout, output / one.name, model, rig)
    )
    return Piece(fit, holdout, into, physics, names, pairs)


def _run(console: Console, pieces: Mapping[Piece, Session], workers: int, scheduler: str) -> dict[str, str]:
    """Diagnose what is not finished; why a log could not be, by its name."""
    from pneumo_ros.workers import run_each

    left = [piece for piece in pieces if not finished(piece)]
    problems: dict[str, str] = {}
    if len(left) < len(pieces):
        console.print(f"{len(pieces) - len(left)} of {len(pieces)} are finished and kept", highlight=False)
    with Progress(TextColumn("diagnosing"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
                  TimeRemainingColumn(), console=console) as progress:  # fmt: skip
        task = progress.add_task("", total=len(left))
        for piece, error in run_each(diagnose_piece, left, max(1, min(workers, len(left))), scheduler or None):
            progress.advance(task)
            if error:
                problems[pieces[piece].name] = error.removeprefix("InputError: ")
                progress.console.print(f"{pieces[piece].name}: {error}", highlight=False, markup=False, soft_wrap=True)
    return problems


def _rows(one: Session, folder: Path, problem: str) -> list[Row]:
    from pneumo_ros.fleet.rows import refused, rows_of

    rig = one.rig or "rig"
    if problem:
        return [refused(one.name, rig, one.date or _filed(one.fit), problem)]
    date = one.date or _logged(one.fit)
    return rows_of(one.name, rig, date, json.loads((folder / RESULT).read_text(encoding="utf-8")))


def _logged(log: Path) -> datetime:
    """When a log without a date in its name was made: its first stamp, else the file's own time."""
    if log.is_dir() or log.suffix == ".mcap":
        from pneumo_ros.log.reading import read_log

        held = read_log(log)
        first = [int(held.records(topic).log_time_ns[0]) for topic, info in held.topics.items() if info.count]
        if first and min(first) > SENSIBLE:
            return datetime.fromtimestamp(min(first) * 1e-9).replace(microsecond=0)
    return _filed(log)


def _filed(log: Path) -> datetime:
    return datetime.fromtimestamp(log.stat().st_mtime).replace(microsecond=0)


def _written(output: Path, rows: Sequence[Row], title: str) -> list[Path]:
    from pneumo_ros.fleet.page import write_page
    from pneumo_ros.fleet.rows import write_csv, write_parquet

    paths = [output / name for name in TABLES]
    try:
        write_csv(paths[0], rows)
        both = write_parquet(paths[1], rows)
        write_page(paths[2], rows, title)
    except OSError as error:
        raise InputError(f"cannot write the tables ({error})", where=output, remedy="choose another folder") from error
    return paths if both else [paths[0], paths[2]]


def _tell(console: Console, rows: Sequence[Row]) -> None:
    from pneumo_ros.fleet.page import amount, headline
    from pneumo_ros.fleet.trends import trends_of

    trends = trends_of(rows)
    console.print(headline(trends), highlight=False, markup=False)
    for one in trends:
        sizes = " -> ".join(amount(point.size, one.unit) for point in one.points)
        told = f"{one.rig}: {one.effect.replace('_', ' ')} at {one.place.replace('_', ' ')} {one.course}: {sizes}"
        console.print(f"  {told}", highlight=False, markup=False, soft_wrap=True)


if __name__ == "__main__":
    app()
