"""`pneumo`: verbs are imported only when asked for, so that `pneumo --help` is quick."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from typer.core import TyperGroup

from pneumo_ros import __version__
from pneumo_ros.errors import PneumoError

BAD_INPUT = 2
VERBS: dict[str, str] = {
    "run": "Run a session: simulate or drive the rig in closed loop and log it.",
    "log": "Inspect, check, recover, export and compare logs.",
    "view": "See a log in the browser.",
    "thesis": "Recompute the thesis: its tables, figures and claims, with verdicts.",
}


class LazyGroup(TyperGroup):
    """A group whose commands live in ``pneumo_ros.cli.<verb>`` as a Typer app named ``app``."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Verbs in the order of :data:`VERBS`."""
        return list(VERBS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Import a verb; the modules import what is heavy inside their functions."""
        if cmd_name not in VERBS:
            return None
        command = typer.main.get_command(import_module(f"pneumo_ros.cli.{cmd_name}").app)
        command.name = cmd_name
        return command


app = typer.Typer(
    cls=LazyGroup,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(wanted: bool) -> None:
    if wanted:
        print(f"pneumo {__version__}")
        raise typer.Exit


@app.callback()
def root(
    version: Annotated[bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show it.")] = False,
) -> None:
    """Active pneumatic half-car rig: run, log, replay, and diagnose the sim-to-real gap."""


def main() -> None:
    """Entry point: a mistake of the user is one line on standard error and exit code 2."""
    try:
        app()
    except PneumoError as error:
        Console(stderr=True, highlight=False, soft_wrap=True).print(f"[red]error:[/red] {escape(str(error))}")
        sys.exit(BAD_INPUT)


if __name__ == "__main__":
    main()
