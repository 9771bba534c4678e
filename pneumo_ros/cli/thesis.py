# SPDX-License-Identifier: Apache-2.0
"""`pneumo thesis`: recompute the thesis's tables, figures and claims."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from pneumo_ros.cli.app import App
from pneumo_ros.cli.terminal import Console

if TYPE_CHECKING:
    from pneumo_ros.thesis.report import Chapter

app = App(add_completion=False)
console = Console()


@app.command()
def thesis(
    chapter: Annotated[list[str] | None, typer.Argument(help="2, 3, 4, 5, 6 or beyond; all by default.")] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="HTML page to write.")] = Path("thesis.html"),
    settings: Annotated[
        Path | None, typer.Option(help="YAML of what the thesis leaves out; config/thesis.yaml by default.")
    ] = None,
    claims: Annotated[Path | None, typer.Option(help="Write the table of claims as Markdown as well.")] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 1 if a claim does not hold.")] = False,
) -> None:
    """Run the thesis's experiments and write a page: pictures, tables beside the printed ones, claims with verdicts."""
    from pneumo_ros.thesis.book import book

    wanted = book(chapter or ())
    from pneumo_ros.thesis.page import write_claims, write_page
    from pneumo_ros.thesis.settings import load_settings

    values = load_settings(settings)
    with Progress(
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn(),
        console=console, transient=True,
    ) as progress:  # fmt: skip
        task = progress.add_task("starting", total=wanted.steps)
        begun = 0

        def step(name: str) -> None:
            nonlocal begun
            progress.update(task, description=name, completed=begun)
            begun += 1

        chapters = wanted.build(values, step)
    write_page(output, chapters, values)
    if claims is not None:
        write_claims(claims, chapters)
    _summary(chapters, output)
    if strict and not all(claim.holds for c in chapters for claim in c.claims):
        raise typer.Exit(1)


def _summary(chapters: Sequence[Chapter], output: Path) -> None:
    from pneumo_ros.thesis.page import heading

    table = Table("chapter", "claims", "hold", "do not hold")
    for c in chapters:
        failed = [claim.key for claim in c.claims if not claim.holds]
        table.add_row(heading(c), str(len(c.claims)), str(len(c.claims) - len(failed)), ", ".join(failed))
    console.print(table)
    console.print(f"page: {output}")


if __name__ == "__main__":
    app()
