# SPDX-License-Identifier: Apache-2.0
"""`pneumo diagnose --tables`: what the Chapter 5 model misses in Tables 5.4 and 5.5."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from pneumo_ros.cli.terminal import Console
from pneumo_ros.errors import InputError
from pneumo_ros.files import new_file
from pneumo_ros.thesis.bench_tables import Judged, TableDiagnosis, diagnose_tables

TITLES = {
    "frequency": "Table 5.4, natural frequency",
    "damping": "Table 5.5, damping ratio (at the printed natural frequency)",
}
FILE = "tables.json"


def run_tables(console: Console, output: Path | None) -> None:
    """Diagnose both tables, print the competition and, with a folder, write it as JSON.

    Raises
    ------
    InputError
        if the folder cannot be written.
    """
    found = diagnose_tables()
    for table, one in found.items():
        _show(console, TITLES[table], one)
    if output is not None:
        console.print(f"written: {_write(output, found)}", highlight=False, soft_wrap=True)


def _show(console: Console, title: str, one: TableDiagnosis) -> None:
    from pneumo_ros.cli.tables import simple_table

    console.print(f"[bold]{title}[/bold]: {one.verdict}")
    console.print(
        f"held-out gap: nominal {one.nominal:.3f}, re-estimated {one.refit:.3f}, chosen {one.chosen_gap:.3f} "
        "(1: as wrong as saying the mean; each payload held out in turn)",
        highlight=False,
    )
    rows = [(j.law.id, f"{j.gap:.3f}", f"{one.shrink(j):+.0%}", _sizes(j)) for j in one.laws]
    console.print(simple_table(("law", "gap", "shrink", "size (over the folds)"), rows))


def _sizes(judged: Judged) -> str:
    parts = []
    for p in judged.law.parameters:
        value, low, high = judged.parameters[p.name]
        unit = "" if p.unit == "1" else f" {p.unit}"
        edge = ", at its bound" if value in (p.low, p.high) or value > 0.999 * p.high else ""
        parts.append(f"{p.name.replace('_', ' ')} {value:.3g} ({low:.3g} ... {high:.3g}){unit}{edge}")
    return "; ".join(parts)


def _write(folder: Path, found: Mapping[str, TableDiagnosis]) -> Path:
    path = folder / FILE
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with new_file(path) as part:
            part.write_text(json.dumps({name: one.to_json() for name, one in found.items()}, indent=1) + "\n")
    except OSError as error:
        raise InputError(
            f"cannot write the diagnosis ({error})", where=folder, remedy="choose another folder"
        ) from error
    return path
