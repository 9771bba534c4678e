# SPDX-License-Identifier: Apache-2.0
"""Serve the dashboard: to this computer alone unless told otherwise, and only to who has the token."""

from __future__ import annotations

import secrets
import signal
import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.server.util import bind_sockets
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPServerRequest
from tornado.ioloop import IOLoop

from pneumo_ros.dashboard.guard import Guard, Policy, delegate
from pneumo_ros.errors import InputError

MAX_MESSAGE = 1 << 20  # bytes a browser may send at once
MAX_BODY = 1 << 16
IDLE = 30.0  # s an unused connection is kept
UNUSED = 5000  # ms that a page is kept for a browser that never opened its web socket


class _Guarded(BokehTornado):
    """Bokeh's application behind the guard: its pages, its static files and its web socket."""

    guard: Guard | None = None

    def find_handler(self, request: HTTPServerRequest, **options: Any) -> Any:
        """Ask the guard first."""
        own = None if self.guard is None else delegate(self, request, self.guard)
        return super().find_handler(request, **options) if own is None else own

    def viewers(self) -> set[str]:
        """Sessions of the tabs that are open."""
        return {session.id for session in self.get_sessions("/")}


@dataclass(frozen=True)
class Dashboard:
    """A server that is ready to run, and the address to open."""

    server: BaseServer
    url: str

    def run(self) -> None:
        """Serve until SIGINT or SIGTERM."""
        loop = self.server.io_loop
        for number in (signal.SIGINT, signal.SIGTERM):
            # Through the loop: an exception raised in the middle of a callback could be taken for that callback's own.
            loop.asyncio_loop.add_signal_handler(number, loop.stop)
        loop.start()
        self.close()

    def close(self) -> None:
        """End every session and free the port."""
        self.server.stop()
        self.server.unlisten()


def serve(
    build: Callable[[Document], None], host: str = "127.0.0.1", port: int = 0, token: str | None = None
) -> Dashboard:
    """Start listening.

    Parameters
    ----------
    build : fills the document of each browser tab
    host : address to bind
    port : 0 takes a free one
    token : asked of every viewer, on this computer too: others may have accounts on it; None makes one

    Raises
    ------
    InputError
        if the address cannot be bound.
    """
    secret = token or secrets.token_urlsafe(24)
    try:
        sockets, port = bind_sockets(host, port)
    except OSError as error:
        raise InputError(
            f"cannot listen ({error.strerror or error})",
            where=f"{host}:{port}",
            remedy="choose another --port or --host",
        ) from error
    tornado = _Guarded(
        {"/": Application(FunctionHandler(build))},
        extra_websocket_origins={"*"},  # the guard has looked at the origin already, and asks for more
        websocket_max_message_size_bytes=MAX_MESSAGE,
        check_unused_sessions_milliseconds=UNUSED,
        unused_session_lifetime_milliseconds=UNUSED,
    )
    tornado.guard = Guard(host, port, secret, tornado.viewers)
    tornado.add_transform(Policy)
    http = HTTPServer(tornado, max_body_size=MAX_BODY, idle_connection_timeout=IDLE, body_timeout=IDLE)
    http.add_sockets(sockets)
    server = BaseServer(IOLoop.current(), tornado, http)
    server.start()
    return Dashboard(server, f"http://{_named(host)}:{port}/?token={secret}")


def _named(host: str) -> str:
    """An address that a browser can open."""
    if host in ("0.0.0.0", "::", ""):
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host
