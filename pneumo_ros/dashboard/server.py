# SPDX-License-Identifier: Apache-2.0
"""Serve the dashboard: to this computer alone unless told otherwise, and then only to who has the token."""

from __future__ import annotations

import hmac
import ipaddress
import secrets
import signal
import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.server.auth_provider import AuthProvider
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.server.util import bind_sockets
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.web import RequestHandler

from pneumo_ros.errors import InputError

COOKIE = "pneumo_token"
LOGIN = "/login"


class _Refusal(RequestHandler):
    """Where a viewer without the token ends up."""

    def get(self) -> None:
        self.set_status(403)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish("This dashboard needs its token: open the address that `pneumo view` printed.\n")


class _TokenAuth(AuthProvider):
    """The token comes once in the address and stays as a cookie, which the page's web socket carries as well."""

    def __init__(self, token: str) -> None:
        self._token = token
        super().__init__()

    @property
    def get_user(self) -> Callable[[Any], str | None]:
        def user(handler: RequestHandler) -> str | None:
            given = handler.get_argument("token", None)
            if given is not None and hmac.compare_digest(given.encode(), self._token.encode()):
                handler.set_cookie(COOKIE, self._token, httponly=True, samesite="Strict")
                return "viewer"
            kept = handler.get_cookie(COOKIE)
            return "viewer" if kept is not None and hmac.compare_digest(kept.encode(), self._token.encode()) else None

        return user

    @property
    def login_url(self) -> str:
        return LOGIN

    @property
    def login_handler(self) -> type[RequestHandler]:
        return _Refusal


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


def is_loopback(host: str) -> bool:
    """Whether only this computer can reach ``host``."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def serve(
    build: Callable[[Document], None], host: str = "127.0.0.1", port: int = 0, token: str | None = None
) -> Dashboard:
    """Start listening.

    Parameters
    ----------
    build : fills the document of each browser tab
    host : address to bind; anything but loopback needs a token, which is made if none is given
    port : 0 takes a free one
    token : asked of every viewer; None asks nobody on loopback

    Raises
    ------
    InputError
        if the address cannot be bound.
    """
    secret = token or (None if is_loopback(host) else secrets.token_urlsafe(24))
    try:
        sockets, port = bind_sockets(host, port)
    except OSError as error:
        raise InputError(
            f"cannot listen ({error.strerror or error})",
            where=f"{host}:{port}",
            remedy="choose another --port or --host",
        ) from error
    # Without a token the page's origin is the guard: another site open in the same browser must not press the buttons.
    origins = {"*"} if secret else {f"{name}:{port}" for name in ("127.0.0.1", "localhost", "[::1]")}
    settings: dict[str, Any] = {"auth_provider": _TokenAuth(secret)} if secret else {}
    tornado = BokehTornado({"/": Application(FunctionHandler(build))}, extra_websocket_origins=origins, **settings)
    http = HTTPServer(tornado)
    http.add_sockets(sockets)
    server = BaseServer(IOLoop.current(), tornado, http)
    server.start()
    return Dashboard(server, f"http://{_named(host)}:{port}/" + (f"?token={secret}" if secret else ""))


def _named(host: str) -> str:
    """An address that a browser can open."""
    if host in ("0.0.0.0", "::", ""):
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host
