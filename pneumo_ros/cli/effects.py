# SPDX-License-Identifier: Apache-2.0
"""`pneumo effects`: what the diagnosis can name: meaning, places, parameters, what looks alike, the check by hand."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pneumo_ros.cli.app import App

if TYPE_CHECKING:
    from rich.console import Console

    from pneumo_ros.effects.contract import Effect

app = App(add_completion=False)


@app.command()
def effects(
    effect: Annotated[str | None, typer.Argument(help="Id of one effect; all in a line each without.")] = None,
    file: Annotated[
        list[Path] | None, typer.Option("--effect", help="Python file with an effect of your own, repeatable.")
    ] = None,
) -> None:
    """What the diagnosis can name, and how to check it by hand on the rig."""
    from rich.console import Console

    from pneumo_ros.effects.loading import laws_of, load_library
    from pneumo_ros.errors import not_one_of

    library, console = laws_of(load_library(file or ())), Console(highlight=False)
    if effect is None:
        _list(console, library)
        return
    if effect not in library:
        raise not_one_of("no such effect", effect, library, where="pneumo effects")
    _show(console, library[effect])


def _list(console: Console, library: Mapping[str, Effect]) -> None:
    from pneumo_ros.cli.tables import plain_table

    console.print(plain_table(("effect", "meaning"), [(name, one.summary) for name, one in sorted(library.items())]))
    console.print("pneumo effects ID says more: parameters, what looks like it, how to check it by hand")


def _show(console: Console, effect: Effect) -> None:
    from rich.markup import escape

    from pneumo_ros.cli.tables import plain_table
    from pneumo_ros.effects.guide import displayed
    from pneumo_ros.effects.sheet import check_words, parameter_rows, places_of, sites_of

    console.print(f"[bold]{effect.id}[/]: {escape(effect.summary)}")
    if effect.guide is not None:
        console.print(escape(effect.guide.meaning))
    console.print(f"\n[bold]acts at[/] {sites_of(effect)}; [bold]blamed on[/] {places_of(effect)}")
    console.print(plain_table(("parameter", "typical", "from", "to", "unit"), parameter_rows(effect)))
    if effect.guide is None:
        return
    console.print(f"[bold]by hand[/] (with typical values): {escape(check_words(effect))}")
    for other, difference in effect.guide.mistaken_for.items():
        console.print(f"[bold]not {other}[/]: {escape(difference)}")
    size = effect.parameters[0]
    console.print(f"a first guess is {displayed(size.typical, size.unit)}")


if __name__ == "__main__":
    app()
