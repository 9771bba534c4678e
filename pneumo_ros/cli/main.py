# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E402
"""`pneumo`: verbs are imported only when asked for, so that `pneumo --help` is quick."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType

INTERRUPTED = 130  # exit code, as a shell says of Ctrl-C

# Before numpy is loaded, here and in every process that is started: our matrices are small, and the threads of a BLAS
# then spin for longer than they compute. A diagnosis takes three times the processor, a node misses its periods.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def _stopped(number: int = signal.SIGINT, frame: FrameType | None = None) -> None:
    started = sys.modules.get("multiprocessing.process")
    if started is None or started.parent_process() is None:  # of a batch's processes only the first one says it
        os.write(2, b"stopped by the user\n")
    os._exit(INTERRUPTED)


if __name__ in ("__main__", "__mp_main__") or sys.argv[0].endswith("pneumo"):
    signal.signal(signal.SIGINT, _stopped)  # first of all: nothing has begun that would have to end in order

from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from pneumo_ros import __version__
from pneumo_ros.cli.app import App
from pneumo_ros.cli.interruption import interrupt
from pneumo_ros.errors import PneumoError, is_interruption, not_one_of

BAD_INPUT = 2
VERBS: dict[str, str] = {
    "demo": "See it work: hide an effect in the rig, drive it, diagnose the logs, open the answer.",
    "run": "Run a session: simulate or drive the rig in closed loop and log it.",
    "diagnose": "Explain the sim-to-real gap of logs: where it lies, which effect causes it, how far it shrinks.",
    "diagnose-all": "Diagnose every log of a folder; one table of rigs by dates: which effect grows where.",
    "effects": "Show what the diagnosis can name: meaning, parameters, what looks alike, the check by hand.",
    "blind": "Make cases with a hidden effect, diagnose them, open the answers and score.",
    "replay": "Replay a log: live into ROS, stepped through today's code, or its road through the rig.",
    "log": "Look into a session log: info, validate, recover, export, compare, scene, report.",
    "view": "Show a session in the browser: a log played back, or a running session.",
    "emulate": "Open a pseudo-terminal that behaves like the rig, with faults to inject.",
    "calibrate": "Fit a sensor's calibration from points, or check what is in force.",
    "thesis": "Reproduce the experiments of the thesis, its tables and its claims.",
}


class LazyGroup(TyperGroup):
    """A group whose commands live in ``pneumo_ros.cli.<verb>`` as a Typer app named ``app``."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Verbs in the order of :data:`VERBS`."""
        return list(VERBS)

    _listing = False

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """The list of verbs needs their names and summaries only: nothing is imported."""
        self._listing = True
        try:
            super().format_help(ctx, formatter)
        finally:
            self._listing = False

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Import a verb; the modules import what is heavy inside their functions."""
        if cmd_name not in VERBS:
            return None
        if self._listing:
            return TyperCommand(cmd_name, help=VERBS[cmd_name])
        command = typer.main.get_command(import_module(f"pneumo_ros.cli.{cmd_name.replace('-', '_')}").app)
        command.name = cmd_name
        return command

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The verb that runs."""
        name = args[0]
        if name.startswith("-"):
            return super().resolve_command(ctx, args)
        if name not in VERBS:
            raise not_one_of("no such verb", name, VERBS, where="pneumo")
        command = self.get_command(ctx, name)
        signal.signal(signal.SIGINT, interrupt)  # from here on a verb may have something to end
        return name, command, args[1:]

    def invoke(self, ctx: Any) -> Any:
        """Run the verb; Ctrl-C that it leaves to us is one line."""
        try:
            return super().invoke(ctx)
        except (KeyboardInterrupt, SystemError) as error:
            if not is_interruption(error):
                raise
            print("stopped by the user", file=sys.stderr)
            raise typer.Exit(INTERRUPTED) from None


app = App(
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
    max_chunk: Annotated[
        int | None,
        typer.Option(help="Largest chunk of a log that is unpacked, MiB; 256 by default.", min=1, max=4096),
    ] = None,
) -> None:
    """Active pneumatic half-car rig: run, log, replay, and diagnose the sim-to-real gap."""
    if max_chunk is not None:
        from pneumo_ros.log.bounds import set_chunk_limit

        set_chunk_limit(max_chunk)


def _trust_no_working_folder() -> None:
    """A folder of logs from elsewhere may hold anything: neither modules nor settings of compilers are taken from it.

    Numba reads ``.numba_config.yaml`` of the working folder and would load compiled code from where that says; what
    the environment names comes first. ``python -m`` looks for modules in the working folder unless told not to.
    """
    os.environ.setdefault("NUMBA_CACHE_DIR", "")
    os.environ.setdefault("PYTHONSAFEPATH", "1")


def main() -> None:
    """Entry point: a mistake of the user is one line on standard error and exit code 2."""
    _trust_no_working_folder()
    try:
        app()
    except PneumoError as error:
        from rich.console import Console
        from rich.markup import escape

        Console(stderr=True, highlight=False, soft_wrap=True).print(f"[red]error:[/red] {escape(str(error))}")
        sys.exit(BAD_INPUT)


if __name__ == "__main__":
    main()
