# SPDX-License-Identifier: Apache-2.0
"""Who may talk to the dashboard: every request, the web socket's too, is looked at before anything answers it."""

from __future__ import annotations

import hmac
import ipaddress
import re
import socket
from base64 import b64encode
from collections.abc import Callable, Collection
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from bokeh.util.token import get_session_id
from tornado.httputil import HTTPHeaders, HTTPServerRequest
from tornado.web import OutputTransform, RequestHandler

COOKIE = "pneumo_token"
HEADER = "X-Pneumo-Token"
MAX_VIEWERS = 8  # tabs; each costs 5 % of a core
_SCRIPT = re.compile(rb"<script(?![^>]*\ssrc=)[^>]*>(.*?)</script>", re.DOTALL)


@dataclass(frozen=True)
class Refusal:
    """Why a request gets no answer."""

    status: int
    text: str


@dataclass(frozen=True)
class Guard:
    """The rules.

    Attributes
    ----------
    host, port : what the server listens on
    token : asked of every request
    viewers : Bokeh sessions of the tabs that are open
    """

    host: str
    port: int
    token: str
    viewers: Callable[[], Collection[str]]

    def refusal(self, request: HTTPServerRequest) -> Refusal | None:
        """Why not, or None."""
        socketed = request.headers.get("Upgrade", "").lower() == "websocket"
        if not self.knows(request.host):
            return Refusal(403, "This dashboard does not answer under that name.")  # a name that was bound anew
        origin = request.headers.get("Origin") or request.headers.get("Sec-WebSocket-Origin")
        if (origin is not None or socketed) and origin != f"http://{request.host}":
            return Refusal(403, "A page of another origin may not use this dashboard.")
        if not self.entitled(request):
            return Refusal(403, "This dashboard needs its token: open the address that `pneumo view` printed.")
        if self.crowded(request, socketed):
            return Refusal(503, f"{MAX_VIEWERS} tabs are open already: close one and load this page again.")
        return None

    def crowded(self, request: HTTPServerRequest, socketed: bool) -> bool:
        """Whether it would open one tab too many, by the page or by a web socket with a session of its own making."""
        there = self.viewers()
        if len(there) < MAX_VIEWERS:
            return False
        return request.path == "/" or (socketed and session_of(request) not in there)

    def knows(self, host: str) -> bool:
        """Whether the Host header names this server: by address, or by the name of this computer.

        A site that binds its own name to this computer's address (DNS rebinding) comes with its own name.
        """
        name, _, port = host.lower().rpartition(":")
        if port != str(self.port) or not name:
            return False
        if name in self._names():
            return True
        try:
            address = ipaddress.ip_address(name.strip("[]"))
        except ValueError:
            return False
        return address.is_loopback if is_loopback(self.host) else True

    def _names(self) -> set[str]:
        names = {"localhost", self.host.lower()} - {"", "0.0.0.0", "::"}
        return names if is_loopback(self.host) else names | {socket.gethostname().lower()}

    def entitled(self, request: HTTPServerRequest) -> bool:
        """Whether the token came: as cookie, as header, or, to be turned into a cookie, in the page's address."""
        cookie = request.cookies.get(COOKIE)
        given = [cookie.value if cookie is not None else "", request.headers.get(HEADER, "")]
        if request.path == "/" and request.method == "GET":
            given += [value.decode("utf-8", "replace") for value in request.query_arguments.get("token", [])]
        # Each is compared in full, in a time that says nothing of where it differs.
        equal = [hmac.compare_digest(text.encode(), self.token.encode()) for text in given]
        return any(equal)


def session_of(request: HTTPServerRequest) -> str:
    """The Bokeh session a web socket asks for; '' if what it sent is none."""
    token = request.headers.get("Sec-WebSocket-Protocol", "").rpartition(",")[2].strip()
    try:
        return str(get_session_id(token))
    except Exception:  # whatever bytes from outside do to a decoder
        return ""


def is_loopback(host: str) -> bool:
    """Whether only this computer can reach ``host``."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


class Refused(RequestHandler):
    """The answer to a refused request, whatever its method."""

    def initialize(self, refusal: Refusal) -> None:
        """Take the reason."""
        self._refusal = refusal

    def prepare(self) -> None:
        """Answer at once."""
        self.set_status(self._refusal.status)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(self._refusal.text + "\n")


class Admitted(RequestHandler):
    """The token leaves the address, where history and referrers would keep it, and becomes a cookie."""

    def initialize(self, token: str) -> None:
        """Take the token."""
        self._token = token

    def get(self) -> None:
        """To the page itself."""
        self.set_cookie(COOKIE, self._token, httponly=True, samesite="Strict", path="/")
        self.redirect("/")


class Policy(OutputTransform):
    """Headers of every answer: scripts from this server and the page's own one only, nothing framed, nothing kept.

    The page's own script is known by its hash, so a script that a text of a log managed to bring would not run.
    Bokeh builds the callbacks of its widgets with ``new Function`` (unsafe-eval), from this package's code, and sets
    styles in place.
    """

    def transform_first_chunk(
        self, status_code: int, headers: HTTPHeaders, chunk: bytes, finishing: bool
    ) -> tuple[int, HTTPHeaders, bytes]:
        """Add them."""
        own = " ".join(f"'sha256-{b64encode(sha256(s).digest()).decode()}'" for s in _SCRIPT.findall(chunk))
        headers["Content-Security-Policy"] = (
            f"default-src 'none'; script-src 'self' 'unsafe-eval' {own}; style-src 'self' 'unsafe-inline'; "
            "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self'; base-uri 'none'; "
            "form-action 'none'; frame-ancestors 'none'"
        )
        headers["X-Content-Type-Options"] = "nosniff"
        headers["Referrer-Policy"] = "no-referrer"
        headers["Cross-Origin-Resource-Policy"] = "same-origin"
        headers["Cache-Control"] = "no-store"
        return status_code, headers, chunk


def delegate(application: Any, request: HTTPServerRequest, guard: Guard) -> Any:
    """What answers instead of the application: a refusal, or the exchange of the token; None to go on."""
    refusal = guard.refusal(request)
    if refusal is not None:
        return application.get_handler_delegate(request, Refused, {"refusal": refusal})
    if request.path == "/" and "token" in request.query_arguments:
        return application.get_handler_delegate(request, Admitted, {"token": guard.token})
    return None
