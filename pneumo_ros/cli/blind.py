# SPDX-License-Identifier: Apache-2.0
"""`pneumo blind`: cases whose answer is withheld, made, diagnosed and scored by anyone."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from pneumo_ros import __version__
from pneumo_ros.cli.app import App
from pneumo_ros.cli.terminal import Console
from pneumo_ros.errors import InputError

if TYPE_CHECKING:
    from pneumo_ros.casemaker.scoring.results import Found

app = App(no_args_is_help=True, add_completion=False, help="Check the diagnosis on cases whose answer is withheld.")

Folder = Annotated[Path, typer.Argument(help="Folder of the set: manifest.json, cases/, labels.json.")]
Workers = Annotated[int, typer.Option(help="Local processes.", min=1)]
Scheduler = Annotated[str, typer.Option(help="Dask scheduler, tcp://host:8786; its workers must see the folder.")]
Only = Annotated[str, typer.Option(help="Only cases whose name contains this.")]


@app.command()
def make(
    folder: Folder,
    set_name: Annotated[
        str, typer.Option("--set", help="full (280 cases), full-0.7 to full-0.1, dev, dev2 to dev8, ci.")
    ] = "dev",
    workers: Workers = 1,
    scheduler: Scheduler = "",
    only: Only = "",
    first: Annotated[int, typer.Option(help="Only the first N cases; their order is shuffled. 0: all.", min=0)] = 0,
) -> None:
    """Draw the cases of a set, write their logs, seal their labels.

    Finished cases are kept: the same command goes on after an interruption. A case takes about 17 s of one core.
    """
    from pneumo_ros.casemaker.plan import plan
    from pneumo_ros.cli.blind_work import make_case

    cases = [case for case in plan(set_name) if only in case.name][: first or None]
    if not cases:
        raise InputError("no case has this in its name", key="--only", value=only, remedy="leave it away to make all")
    _refuse_other_set(folder, set_name)
    items = [(case, str(folder)) for case in cases]
    _run("making", make_case, items, [case.name for case in cases], workers, scheduler)
    seal_set(folder, set_name, [case.name for case in cases])


@app.command()
def diagnose(
    folder: Folder,
    output: Annotated[Path | None, typer.Option(help="Folder for the diagnoses; default FOLDER/diagnoses.")] = None,
    workers: Workers = 1,
    scheduler: Scheduler = "",
    only: Only = "",
) -> None:
    """Run the diagnosis on every case of a set; it sees the logs and which effects to do without, nothing else."""
    results = output or folder / "diagnoses"
    entries = [entry for entry in read_manifest(folder)["cases"] if only in entry["name"]]
    if not entries:
        raise InputError("no case has this in its name", where=folder, key="--only", value=only,
                         remedy="leave it away to diagnose all")  # fmt: skip
    from pneumo_ros.cli.blind_work import diagnose_case

    # What the local processes leave of the cores helps each of them; of a cluster's computers nothing is known.
    threads = 1 if scheduler else max(1, (os.cpu_count() or 1) // workers)
    items = [(entry["name"], tuple(entry["withhold"]), str(folder), str(results), threads) for entry in entries]
    _run("diagnosing", diagnose_case, items, [entry["name"] for entry in entries], workers, scheduler)


@app.command()
def score(
    folder: Folder,
    labels: Annotated[Path | None, typer.Option(help="The maker's labels; default FOLDER/labels.json.")] = None,
    results: Annotated[Path | None, typer.Option(help="Folder of the diagnoses; default FOLDER/diagnoses.")] = None,
    output: Annotated[Path | None, typer.Option(help="Markdown page to write; default FOLDER/results.md.")] = None,
    expect: Annotated[
        Path | None, typer.Option(help="JSON {case: verdict} of what must be kept; exit 1 if one changed.")
    ] = None,
) -> None:
    """Open the answers, check their seals, score the diagnosis and four baselines."""
    manifest = read_manifest(folder)
    from pneumo_ros.casemaker.scoring.report import write_report
    from pneumo_ros.casemaker.scoring.results import load_results
    from pneumo_ros.casemaker.seal import opened

    digests = {entry["name"]: entry["label_sha256"] for entry in manifest["cases"]}
    wanted = None if expect is None else _expected(expect)
    answers = opened(labels or folder / "labels.json", digests)
    found = load_results(results or folder / "diagnoses", answers)
    page = output or folder / "results.md"
    summary = write_report(page, answers, found, manifest)
    Console(soft_wrap=True, highlight=False).print(summary, markup=False)
    if wanted is not None:
        _hold_to(wanted, found)


def read_manifest(folder: Path) -> dict[str, Any]:
    """The public manifest of a set.

    Raises
    ------
    InputError
        if the folder holds none, or it is not one.
    """
    path = folder / "manifest.json"
    try:
        manifest = dict(json.loads(path.read_text(encoding="utf-8")))
        for entry in manifest["cases"]:
            entry["name"], entry["withhold"], entry["label_sha256"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        reason = error.strerror if isinstance(error, OSError) else f"not a manifest of cases: {error}"
        raise InputError(f"cannot read the manifest ({reason})", where=path,
                         remedy="give the folder of `pneumo blind make`") from error  # fmt: skip
    return manifest


def _refuse_other_set(folder: Path, set_name: str) -> None:
    if not (folder / "manifest.json").exists():
        return
    held = read_manifest(folder).get("set")
    if held != set_name:
        raise InputError("the folder holds another set", where=folder, key="--set", value=set_name, allowed=str(held),
                         remedy="choose another folder")  # fmt: skip


def _run(what: str, work: Any, items: list[Any], names: list[str], workers: int, scheduler: str) -> None:
    from pneumo_ros.workers import run_each

    by_item = dict(zip(items, names, strict=True))
    failed = []
    with _bar() as progress:
        task = progress.add_task(what, total=len(items))
        for item, error in run_each(work, items, workers, scheduler or None):
            progress.advance(task)
            if error:
                failed.append(by_item[item])
                progress.console.print(f"[red]{by_item[item]}[/red] {error}", highlight=False)
    if failed:
        raise InputError(f"{len(failed)} of {len(items)} cases failed", value=", ".join(sorted(failed)),
                         remedy="run the same command again: finished cases are kept")  # fmt: skip


def seal_set(folder: Path, set_name: str, names: Sequence[str]) -> None:
    """Write manifest.json and labels.json; what is sealed already keeps its seal, new cases are added."""
    from pneumo_ros.casemaker.plan import plan, seed_of
    from pneumo_ros.casemaker.seal import sealed

    before = read_manifest(folder)["cases"] if (folder / "manifest.json").exists() else []
    entries = json.loads((folder / "labels.json").read_text(encoding="utf-8")) if before else []
    new = [name for name in names if name not in {entry["name"] for entry in before}]
    labels = [json.loads((folder / "labels" / f"{name}.json").read_text(encoding="utf-8")) for name in new]
    salted, digests = sealed(labels)
    withheld = {case.name: list(case.withhold) for case in plan(set_name)}
    added = [{"name": name, "withhold": withheld[name], "label_sha256": digests[name]} for name in new]
    manifest = {"set": set_name, "seed": seed_of(set_name), "software": f"pneumo_ros {__version__}",
                "cases": before + added}  # fmt: skip
    for name, content in (("labels.json", entries + salted), ("manifest.json", manifest)):
        part = folder / f"{name}.part"
        part.write_text(json.dumps(content, indent=1), encoding="utf-8")
        part.rename(folder / name)


def _expected(path: Path) -> dict[str, str]:
    try:
        return {str(name): str(verdict) for name, verdict in dict(json.loads(path.read_text(encoding="utf-8"))).items()}
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"cannot read the expected verdicts ({error})", where=path, key="--expect",
                         remedy='give a JSON file {"case": "verdict"}') from error  # fmt: skip


def _hold_to(wanted: Mapping[str, str], found: Mapping[str, Found]) -> None:
    """Exit with 1 and a line for each case whose verdict is not the wanted one."""
    console = Console(stderr=True, soft_wrap=True, highlight=False)
    changed = 0
    for name, verdict in wanted.items():
        now = f"is now {found[name].verdict} ({found[name].probability:.2f})" if name in found else "was not diagnosed"
        if name not in found or found[name].verdict != verdict:
            console.print(f"[red]{name}[/red]: verdict must be {verdict}, {now}")
            changed += 1
    if changed:
        console.print(f"{changed} of {len(wanted)} verdicts changed")
        raise typer.Exit(1)
    Console().print(f"all {len(wanted)} verdicts kept")


def _bar() -> Progress:
    return Progress(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
                    TimeRemainingColumn())  # fmt: skip


if __name__ == "__main__":
    app()
