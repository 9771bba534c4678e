# SPDX-License-Identifier: Apache-2.0
"""A diagnosis on the terminal: how far it is, and what was found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from pneumo_ros.cli.terminal import Console

if TYPE_CHECKING:
    from pneumo_ros.diagnosis.report import Story
    from pneumo_ros.diagnosis.result import Diagnosis, EditTest

SHOWN = 5  # rows of the ranking on the terminal; the file has all


def show(console: Console, found: Diagnosis, first: Story) -> None:
    """What the report says first; then the budget, the head of the ranking, the notes, and what to do next."""
    from pneumo_ros.cli.tables import fact_table

    summary = found.to_json()
    console.print(f"[bold]{escape(first.headline)}[/bold]", highlight=False)
    console.print(f"{found.verdict} ({first.confidence})", highlight=False, markup=False)
    if first.facts:
        console.print(fact_table(first.facts))
    if found.verdict != "not_testable":
        show_budget(console, summary, found.verdict)
        _show_ranking(console, summary)
    if found.edit is not None:
        _show_edit(console, found.edit)
    for note in found.notes:
        console.print(f"note: {note}", highlight=False, markup=False)
    for step in first.steps:
        console.print(f"next: {step.text}", highlight=False, markup=False)
        for line in step.commands:  # whole, so that it can be copied
            console.print(f"  {line}", highlight=False, markup=False, soft_wrap=True)


def show_budget(console: Console, summary: Mapping[str, object], verdict: str) -> None:
    """What makes the gap, a row each; where no name is accepted, that these are only the closest ones."""
    from pneumo_ros.cli.tables import simple_table
    from pneumo_ros.diagnosis.report.budget import budget_rows
    from pneumo_ros.diagnosis.result import DIFFERS

    nobody = verdict == "unknown" and bool(summary.get("budget"))
    rows = []
    for row in budget_rows(summary):
        entry = row.get("entry", {})
        law = {"": "", DIFFERS: "another"}.get(str(entry.get("law", "")), "the library's")
        # Where no name is accepted, how probable each is stands below, in what competed.
        probable = () if nobody else (f"{entry['probability']:.2f}" if entry else "",)
        rows.append((row["words"], f"{100 * row['share']:.1f} %", law, *probable))
    head = "the closest names, none accepted" if nobody else "what makes the nominal model's gap"
    console.print(simple_table((head, "share", "law", *(() if nobody else ("probability",))), rows))


def _show_ranking(console: Console, summary: Mapping[str, Any]) -> None:
    from pneumo_ros.cli.tables import simple_table
    from pneumo_ros.diagnosis.report.words import ranking_words

    rows, shown = [], summary["ranking"][:SHOWN]
    for entry, words in zip(shown, ranking_words(shown), strict=True):
        lost = entry["gap_after"] is None or entry["shrink"] is None
        closed = "" if lost else f"{round(100 * entry['shrink'], 1) + 0.0:.1f} %"
        left = ("ran away", "") if lost else (f"{entry['gap_after']:.3g}", closed)
        rows.append((words, f"{entry['probability']:.2f}", *left))
    console.print(simple_table(("what competed", "probability", "gap left", "closed"), rows))


def _show_edit(console: Console, edit: EditTest) -> None:
    changes = ", ".join(f"{name} {100 * (factor - 1):+.1f} %" for name, factor in edit.changes.items())
    console.print(
        f"edit test on {edit.log} ({changes or 'nothing changed'}), nothing refitted: "
        f"gap nominal {edit.gap_nominal:.3g}, re-estimated {edit.gap_refit:.3g}, best {edit.gap_best:.3g}",
        highlight=False,
    )


def progress_bar(console: Console) -> Progress:
    """How far the diagnosis is."""
    return Progress(
        TextColumn("{task.description:42.42}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn(), console=console
    )
