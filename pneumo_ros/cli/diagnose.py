"""`pneumo diagnose`: where the gap between log and model lies, which effect makes it, how far it shrinks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from pneumo_ros.errors import InputError

if TYPE_CHECKING:
    from pneumo_ros.gap.diagnosis import Diagnosis

app = typer.Typer()
SHOWN = 5  # rows of the ranking on the terminal; the file has all


@app.command()
def diagnose(
    fit: Annotated[
        list[Path] | None, typer.Argument(help="Logs (.mcap) to fit, one or more.", metavar="FIT.mcap [more...]")
    ] = None,
    output: Annotated[
        Path | None, typer.Option(help="Folder for diagnosis.json, report.html, residual.mcap; needed with logs.")
    ] = None,
    holdout: Annotated[
        Path | None, typer.Option(help="Log that nothing is fitted to; default: the last third of the last fit log.")
    ] = None,
    rig: Annotated[
        Path | None,
        typer.Option(
            help="Rig file (YAML); effects it names are part of the model; default: the rig that the log carries."
        ),
    ] = None,
    edit: Annotated[
        Path | None,
        typer.Option(help="Log after a known change (payload, supply, speed), predicted without refitting."),
    ] = None,
    effect: Annotated[
        list[Path] | None, typer.Option(help="Python file with an effect of your own (EFFECT = ...), repeatable.")
    ] = None,
    without: Annotated[list[str] | None, typer.Option(help="Effect id that must not compete, repeatable.")] = None,
    save_rig: Annotated[
        Path | None,
        typer.Option(
            help="Write the corrected rig with its effects (YAML) here, for --rig of run, emulate, replay and diagnose."
        ),
    ] = None,
    pairs: Annotated[bool, typer.Option(help="Look for two effects at once as well.")] = True,
    tables: Annotated[
        bool, typer.Option("--tables", help="Instead of logs: what the Chapter 5 model misses in Tables 5.4 and 5.5.")
    ] = False,
) -> None:
    """Diagnose the sim-to-real gap of a log: where it lies, which unmodelled effect causes it, how far it shrinks.

    About 20 s for two logs of 15 s at 500 Hz. The exit code is 0 whatever the verdict.
    """
    console = Console()
    if tables:
        from pneumo_ros.cli.diagnose_tables import run_tables

        run_tables(console, output)
        return
    if not fit or output is None:
        missing = "no log to fit" if not fit else "no folder for the diagnosis"
        raise InputError(missing, where="pneumo diagnose", remedy="pneumo diagnose FIT.mcap --output FOLDER")
    from pneumo_ros.gap.diagnose import Options
    from pneumo_ros.gap.experiment import design_experiment
    from pneumo_ros.gap.report import write_outputs
    from pneumo_ros.gap.run import prepared
    from pneumo_ros.gap.saved_rig import save_corrected_rig
    from pneumo_ros.rig import load_rig

    task = prepared(fit, holdout, None if rig is None else load_rig(rig), edit, effect or (), without or ())
    options = Options(pairs=pairs, experiment=design_experiment)
    with _bar(console) as progress:
        bar = progress.add_task("diagnosing", total=1.0)
        found = task.diagnose(options, lambda share, what: progress.update(bar, completed=share, description=what))
    files = write_outputs(output, found, task.model, task.fit, task.holdout)
    if found.experiment is not None:
        files += found.experiment.write(output)
    if save_rig is not None:
        files.append(save_corrected_rig(found, task.model, save_rig, effect or ()))
    _show(console, found)
    if found.experiment is not None:
        console.print(f"next experiment, {found.experiment.description}:", highlight=False, soft_wrap=True)
        console.print(f"  {found.experiment.command(output)}", highlight=False, soft_wrap=True)
    console.print("written: " + ", ".join(str(file) for file in files), highlight=False, soft_wrap=True)


def _show(console: Console, found: Diagnosis) -> None:
    """Verdict, held-out gaps and the head of the ranking."""
    from pneumo_ros.cli.tables import simple_table

    places = ", ".join(f"{place} {share:.0%}" for place, share in found.location[:3]) or "no place stands out"
    console.print(f"[bold]{found.verdict}[/bold]  probability {found.probability:.2f}; {places}")
    if len(found.ambiguity_group) > 1:
        console.print("not told apart by this log: " + ", ".join(found.ambiguity_group[1:]))
    g = found.gap
    console.print(
        f"held-out gap: nominal {g.nominal:.4f}, refit {g.refit:.4f}, best {g.best:.4f}, noise {g.noise_floor:.4f}",
        highlight=False,
    )
    rows = [
        (
            " + ".join(f"{e} ({s})" if s else e for e, s in zip(r.effects, r.sites, strict=False)) or r.effects[0],
            f"{r.probability:.2f}",
            f"{r.shrink:.1%}",
            f"{r.shrink_ci90[0]:.1%} ... {r.shrink_ci90[1]:.1%}",
        )
        for r in found.ranking[:SHOWN]
    ]
    console.print(simple_table(("structure", "probability", "shrink", "90 %"), rows))
    if found.edit is not None:
        e = found.edit
        console.print(
            f"edit test {e.log}: nominal {e.gap_nominal:.4f}, refit {e.gap_refit:.4f}, best {e.gap_best:.4f}",
            highlight=False,
        )
    for note in found.notes:
        console.print(f"note: {note}", highlight=False)


def _bar(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.description:42.42}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn(), console=console
    )
