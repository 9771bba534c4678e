# SPDX-License-Identifier: Apache-2.0
"""`pneumo diagnose`: where the gap between log and model lies, which effect makes it, how far it shrinks."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from pneumo_ros.cli.app import App, program
from pneumo_ros.cli.diagnose_against import check_against, fitted_half_car
from pneumo_ros.cli.diagnosis_shown import progress_bar, show
from pneumo_ros.cli.existing import Overwrite, claimed, refuse_old_diagnosis
from pneumo_ros.cli.own_laws import own_laws
from pneumo_ros.cli.rig_notes import tell_assumed
from pneumo_ros.cli.terminal import Console
from pneumo_ros.errors import InputError

app = App(add_completion=False)


@app.command()
def diagnose(
    fit: Annotated[
        list[Path] | None,
        typer.Argument(help="Logs to fit, one or more: .mcap, or a bag folder.", metavar="FIT.mcap [more...]"),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Folder for diagnosis.json, report.html, residual.mcap; needed with logs."),
    ] = None,
    holdout: Annotated[
        Path | None, typer.Option(help="Log that nothing is fitted to; default: the last 35 % of the last fit log.")
    ] = None,
    rig: Annotated[
        Path | None,
        typer.Option(
            help="Rig file (YAML); effects it names are part of the model; default: the rig that the log carries."
        ),
    ] = None,
    edit: Annotated[
        Path | None,
        typer.Option(
            help="Log after a known change (payload, supply ...), predicted without refitting; its own /rig/config "
            "states the change."
        ),
    ] = None,
    effect: Annotated[
        list[Path] | None,
        typer.Option(help="Python file with an effect of your own (EFFECT = ...), repeatable: docs/diagnosis.md."),
    ] = None,
    without: Annotated[list[str] | None, typer.Option(help="Effect id that must not compete, repeatable.")] = None,
    save_rig: Annotated[
        Path | None,
        typer.Option(
            help="Write the corrected rig with its effects (YAML) here, for --rig of run, emulate, replay and diagnose."
        ),
    ] = None,
    rig_model: Annotated[
        Path | None,
        typer.Option(
            "--rig-model",
            "--fmu",
            help="A rig of your own: its physics, rig.py or model.fmu, with the YAML of that name beside it, or --rig. "
            "Logs may then be tables: CSV, Parquet, .mat (docs/your-rig.md, docs/fmu.md).",
        ),
    ] = None,
    against: Annotated[
        Path | None,
        typer.Option(help="An earlier log: it fits the rig, and FIT is diagnosed against that rig. What has changed?"),
    ] = None,
    pairs: Annotated[bool, typer.Option(help="Look for two effects at once as well.")] = True,
    overwrite: Overwrite = False,
    tables: Annotated[
        bool, typer.Option("--tables", help="Instead of logs: what the Chapter 5 model misses in Tables 5.4 and 5.5.")
    ] = False,
) -> None:
    """Diagnose the sim-to-real gap of a log: where it lies, which unmodelled effect causes it, how far it shrinks.

    About 20 s of one core for two logs of 15 s at 500 Hz with one effect, longer with several. Exit code 0 whatever
    the verdict, 2 for logs, rigs or effects that cannot be used. Gaps are RMS of log minus free-running model over the
    log's standard deviation, all channels.
    """
    console = Console()
    if tables:
        from pneumo_ros.cli.diagnose_tables import run_tables

        if fit:
            raise InputError("--tables takes no logs", value=fit[0], remedy="leave away either the logs or --tables")
        run_tables(console, output)
        return
    if not fit or output is None:
        missing = "no log to fit" if not fit else "no folder for the diagnosis"
        raise InputError(missing, where="pneumo diagnose", remedy="pneumo diagnose FIT.mcap --output FOLDER")
    check_against(against)
    if rig_model is not None:
        from pneumo_ros.cli.diagnose_own import diagnose_own

        if edit is not None or effect:
            key, given = ("--effect", effect[0]) if effect else ("--edit", edit)
            raise InputError("is the half car's own", where=given, key=key, remedy="leave it away with --rig-model")
        diagnose_own(console, rig_model, fit, holdout, output, rig, without or (), save_rig, against, pairs, overwrite)
        return
    _check_kind(fit)
    _check_files(fit, holdout, edit, rig, effect)
    refuse_old_diagnosis(output, save_rig, overwrite, [rig] if rig is not None else [])
    from pneumo_ros.diagnosis.diagnose import Options
    from pneumo_ros.diagnosis.half_car.experiment import design_experiment
    from pneumo_ros.diagnosis.half_car.from_logs import prepared
    from pneumo_ros.diagnosis.half_car.saved_rig import save_corrected_rig
    from pneumo_ros.diagnosis.report import Asked, claim_folder, write_outputs
    from pneumo_ros.rig import load_rig

    with claimed(output), own_laws(effect or ()), ExitStack() as held:
        if save_rig is not None:
            claim_folder(save_rig.parent)
            if save_rig.is_dir():
                raise InputError("is a folder", where=save_rig, key="--save-rig", remedy="name a file, RIG.yaml")
        own = None if rig is None else load_rig(rig)
        if own is not None:
            tell_assumed(console, own, rig)
        if against is not None:
            own = held.enter_context(fitted_half_car(console, against, own, effect or (), pairs))
        threads = os.cpu_count() or 1
        task = prepared(fit, holdout, own, edit, effect or (), without or (), threads)
        options = Options(pairs=pairs, experiment=design_experiment, threads=threads)
        with progress_bar(console) as progress:
            bar = progress.add_task("diagnosing", total=1.0)
            found = task.diagnose(options, lambda share, what: progress.update(bar, completed=share, description=what))
        asked = Asked(tuple(fit), holdout, output, save_rig, _repeated(rig, effect, without), _bench(fit[0]), program())
        files, first = write_outputs(output, found, task.model, task.fit, task.holdout, asked=asked)
        if found.experiment is not None:
            files += found.experiment.write(output)
        if save_rig is not None:
            files.append(save_corrected_rig(found, task.model, save_rig))
        show(console, found, first)
        for file in files:
            console.print(f"written  {file}", highlight=False, markup=False, soft_wrap=True)


def _bench(log: Path) -> tuple[str, ...]:
    """Options of `pneumo run` that reach the rig a log is of, simulated or not; none for another recorder's."""
    from pneumo_ros.log.inspection import final_parameters
    from pneumo_ros.log.reading import read_log

    nodes = final_parameters(read_log(log))
    daq, hidden = nodes.get("daq", {}), str(nodes.get("plant", {}).get("simulated_rig", ""))
    given = [(f"--{key}", str(daq[key])) for key in ("port", "calibration") if daq.get(key)]
    if daq:
        return ("--source", "serial", *(word for pair in given for word in pair))
    if hidden:
        beside = log.parent / hidden  # the log was made where it lies, and is diagnosed from elsewhere
        return ("--set", f"plant.simulated_rig={beside if beside.is_file() and not Path(hidden).is_file() else hidden}")
    return ("--source", "sim") if "plant" in nodes else ()


def _repeated(rig: Path | None, effects: Sequence[Path] | None, without: Sequence[str] | None) -> tuple[str, ...]:
    """Options of this diagnosis that the next one needs as well."""
    words = [("--rig", rig)] if rig is not None else []
    words += [("--effect", path) for path in effects or ()]
    return tuple(str(word) for pair in (*words, *(("--without", name) for name in without or ())) for word in pair)


def _check_kind(fit: Sequence[Path]) -> None:
    """Tables are of rigs of one's own: the half car's log carries its rig."""
    from pneumo_ros.own_rig.tables import is_table

    for log in fit:
        if is_table(log) and log.is_file():
            raise InputError("a table says nothing of its rig", where=log,
                             remedy="give the model with --rig-model rig.py (docs/your-rig.md)")  # fmt: skip


def _check_files(
    fit: Sequence[Path], holdout: Path | None, edit: Path | None, rig: Path | None, effects: Sequence[Path] | None
) -> None:
    """What is read is there, before seconds of imports."""
    from pneumo_ros.log.bags import check_log

    for log in (*fit, holdout, edit):
        if log is not None:
            check_log(log)
    for key, file in (("--rig", rig), *(("--effect", path) for path in effects or ())):
        if file is not None and not file.is_file():
            raise InputError("no such file", where=file, key=key, remedy="check the name")
