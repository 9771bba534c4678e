# SPDX-License-Identifier: Apache-2.0
"""``pneumo view``: a session in the browser, recorded or running."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from pneumo_ros.cli.app import App
from pneumo_ros.cli.terminal import Console
from pneumo_ros.errors import InputError

app = App(add_completion=False, help="Show a session in the browser: a log played back, or a running session.")
console = Console()
NICE = 10  # drawing for browsers gives way to the nodes that run beside it
END_PATIENCE = 5.0  # s a dashboard has to close its connections

Host = Annotated[str, typer.Option(help="Address to serve on; other computers reach it only if you name one.")]
Port = Annotated[int, typer.Option(help="Port; 0 takes a free one.", min=0, max=65535)]
Token = Annotated[str | None, typer.Option(help="Ask every viewer for this token; one is made if you give none.")]


@app.command()
def view(
    log: Annotated[
        Path | None, typer.Argument(help="Session log (.mcap) or bag folder; without one, the running session.")
    ] = None,
    other: Annotated[
        Path | None, typer.Option("--with", help="A second log, laid over the first, aligned by their road.")
    ] = None,
    host: Host = "127.0.0.1",
    port: Port = 0,
    token: Token = None,
    domain_id: Annotated[
        int | None,
        typer.Option(
            "--domain", "--domain-id", help="DDS domain of the running session; the environment's by default."
        ),
    ] = None,
    namespace: Annotated[str, typer.Option(help="ROS namespace of the running session.")] = "",
) -> None:
    """Serve the dashboard and print its address; Ctrl-C ends it."""
    _need_bokeh()
    if log is not None:
        view_log(log, host, port, token, other)
    else:
        view_live(host, port, token, domain_id, namespace)


def view_log(path: Path, host: str, port: int, token: str | None, other: Path | None = None) -> None:
    """Play a log back, each browser tab at its own position; a residual log, or two logs, are laid over each other."""
    from pneumo_ros.log.salvage import read_or_salvage

    log, remark = read_or_salvage(path)
    from pneumo_ros.dashboard.overlay import Overlay, is_residual, series_of
    from pneumo_ros.dashboard.page import Page
    from pneumo_ros.dashboard.server import serve
    from pneumo_ros.dashboard.source import Playback

    if remark:
        console.print(f"[yellow]{remark}[/]", highlight=False, soft_wrap=True)
    if other is not None or is_residual(log):
        series = series_of(log, None if other is None else read_or_salvage(other)[0])
        dashboard = serve(lambda document: _keep(Overlay(document, log.path.name, series)), host, port, token)
    else:
        Playback(log)  # says what is wrong with the log before anybody waits for a page
        dashboard = serve(lambda document: _keep(Page(document, Playback(log))), host, port, token)
    console.print(f"dashboard at {dashboard.url}  (Ctrl-C ends it)", highlight=False, soft_wrap=True)
    dashboard.run()


def view_live(host: str, port: int, token: str | None, domain_id: int | None, namespace: str = "") -> None:
    """Show the session that runs on a DDS domain, with its gains and the emergency stop."""
    from pneumo_ros.dashboard.page import Page
    from pneumo_ros.dashboard.server import serve
    from pneumo_ros.nodes.dashboard_link import LiveLink
    from pneumo_ros.nodes.spin import end_with_supervisor

    end_with_supervisor()
    os.nice(NICE)
    with LiveLink(domain_id, namespace) as link:
        dashboard = serve(lambda document: _keep(Page(document, link, link)), host, port, token)
        console.print(f"dashboard at {dashboard.url}  (Ctrl-C ends it)", highlight=False, soft_wrap=True)
        dashboard.run()


@contextmanager
def beside(domain_id: int | None, namespace: str = "") -> Iterator[Viewer]:
    """The live dashboard in a process of its own, so that drawing never holds up a node; ended on leaving.

    Who kills this process ends the dashboard as well: nobody would know its address any more.
    """
    _need_bokeh()
    from pneumo_ros.session.middleware import middleware_settings
    from pneumo_ros.session.supervisor import SUPERVISOR

    domain = ["--domain-id", str(domain_id)] if domain_id is not None else []
    domain += ["--namespace", namespace] if namespace else []
    environment = {**os.environ, **middleware_settings(os.environ), SUPERVISOR: str(os.getpid())}
    process = subprocess.Popen(
        [sys.executable, "-m", "pneumo_ros.cli.view", *domain], env=environment, start_new_session=True
    )
    try:
        yield Viewer(process)
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(END_PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@dataclass(frozen=True)
class Viewer:
    """The dashboard's process."""

    process: subprocess.Popen[bytes]

    def wait(self) -> None:
        """Until the user has seen enough (Ctrl-C)."""
        with suppress(KeyboardInterrupt):
            self.process.wait()


def _keep(page: object) -> None:
    """The document holds the page through its callbacks."""


def _need_bokeh() -> None:
    try:
        import bokeh  # noqa: F401
    except ImportError as error:
        raise InputError("the dashboard needs Bokeh", remedy="pip install 'pneumo_ros[view]'") from error


if __name__ == "__main__":
    app()
