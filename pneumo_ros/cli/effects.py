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
    from pneumo_ros.slots.guides import GUIDES

    library, console = laws_of(load_library(file or ())), Console(highlight=False)
    if effect is None:
        _list(console, library)
    elif effect in library:
        _show(console, library[effect])
    elif effect in GUIDES:
        _show_family(console, effect)
    else:
        raise not_one_of("no such effect", effect, list(dict.fromkeys([*library, *GUIDES])), where="pneumo effects")


def _list(console: Console, library: Mapping[str, Effect]) -> None:
    from pneumo_ros.cli.tables import plain_table
    from pneumo_ros.slots.guides import GUIDES

    console.print(plain_table(("effect", "meaning"), [(name, one.summary) for name, one in sorted(library.items())]))
    console.print("pneumo effects ID says more: parameters, what looks like it, how to check it by hand")
    console.print(f"at the slots of a rig of your own (--rig-model): {', '.join(sorted(GUIDES))}")


def _show(console: Console, effect: Effect) -> None:
    from rich.markup import escape

    from pneumo_ros.cli.tables import plain_table
    from pneumo_ros.effects.guide import displayed
    from pneumo_ros.effects.sheet import check_words, parameter_rows, places_of, sites_of
    from pneumo_ros.slots.half_car import SLOT_FAMILIES

    console.print(f"[bold]{effect.id}[/]: {escape(effect.summary)}")
    if effect.guide is not None:
        console.print(escape(effect.guide.meaning))
    console.print(f"\n[bold]acts at[/] {sites_of(effect)}; [bold]a report shows it at[/] {places_of(effect)}")
    if effect.id in SLOT_FAMILIES:
        kind, family, *_ = SLOT_FAMILIES[effect.id]
        console.print(f"[bold]at a rig of your own[/]: {family} at a slot of kind {kind} (--rig-model)")
    console.print(plain_table(("parameter", "typical", "from", "to", "unit", "what it is"), parameter_rows(effect)))
    if effect.guide is None:
        return
    console.print(f"[bold]by hand[/] (with typical values): {escape(check_words(effect))}")
    _show_alike(console, effect.guide.mistaken_for)
    size = effect.parameters[0]
    console.print(f"[bold]typical size[/]: {displayed(size.typical, size.unit)}")


def _show_family(console: Console, family: str) -> None:
    """A family of a rig of one's own: its laws at each kind of slot, and its guide."""
    from rich.markup import escape

    from pneumo_ros.cli.tables import plain_table
    from pneumo_ros.slots.guides import GUIDES, plain_check
    from pneumo_ros.slots.sheet import laws_of_family

    guide = GUIDES[family]
    console.print(f"[bold]{family}[/], at slots of a rig of your own: {escape(guide.meaning)}\n")
    console.print(plain_table(("law", "at", "what it is"), laws_of_family(family)))
    console.print(f"[bold]by hand[/]: {escape(plain_check(guide))}")
    _show_alike(console, guide.mistaken_for)


def _show_alike(console: Console, others: Mapping[str, str]) -> None:
    """What looks like an effect, and what tells it apart."""
    from rich.markup import escape

    if others:
        console.print("[bold]looks like it[/], and what tells it apart:")
    for other, difference in others.items():
        console.print(f"  {other}: {escape(difference)}")


if __name__ == "__main__":
    app()
