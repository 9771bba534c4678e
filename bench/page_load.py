# SPDX-License-Identifier: Apache-2.0
"""What viewers cost the control loop: its periods without a page, with one, and with 200 connections and slow readers.

Real sessions in real time; the page is served beside them as ``pneumo run --view`` does. Half of the connections ask
for the page, half open a web socket with a session of their own; slow readers open one and never read. Prints a table;
the figures are the nodes' own over their last 5000 steps, from the log.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import urllib.parse
from collections import Counter
from pathlib import Path

from bokeh.util.token import generate_jwt_token, generate_session_id
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.simple_httpclient import SimpleAsyncHTTPClient
from tornado.websocket import WebSocketClosedError, websocket_connect

from pneumo_ros.log.reading import read_log

URL = re.compile(r"http://\S+")
COOKIE = "pneumo_token"
FIGURES = ("period p50 (us)", "period p99 (us)", "period max (us)", "step p99 (us)", "missed periods")
NODES = ("plant", "controller")
SMALL = 2048  # bytes of receive buffer of a slow reader


class Load:
    """Connections to one dashboard; what became of them."""

    def __init__(self, url: str, connections: int, slow: int) -> None:
        address = urllib.parse.urlsplit(url)
        self.place, self.cookie = address.netloc, f"{COOKIE}={urllib.parse.parse_qs(address.query)['token'][0]}"
        self.connections, self.slow = connections, slow
        self.outcomes: Counter[str] = Counter()
        self._sockets: list[socket.socket] = []

    def run(self) -> None:
        """Until the dashboard is gone."""
        os.nice(19)  # of this thread alone: who asks is not what is measured
        for _ in range(self.slow):
            self._never_read()
        AsyncHTTPClient.configure(SimpleAsyncHTTPClient, max_clients=self.connections)
        asyncio.run(self._all())

    async def _all(self) -> None:
        await asyncio.gather(*(self._ask() if k % 2 else self._listen() for k in range(self.connections)))

    async def _ask(self) -> None:
        """The page, again and again."""
        while True:
            try:
                request = HTTPRequest(f"http://{self.place}/", headers={"Cookie": self.cookie}, request_timeout=60.0)
                answer = await AsyncHTTPClient().fetch(request, raise_error=False)
                self.outcomes[f"page {answer.code}"] += 1
            except HTTPClientError as error:  # cut off
                self.outcomes[f"page {error.code}"] += 1
            except OSError:
                return
            await asyncio.sleep(1.0)

    async def _listen(self) -> None:
        """A web socket with a Bokeh session of its own; every message is taken."""
        token = generate_jwt_token(generate_session_id())
        headers = {"Cookie": self.cookie, "Origin": f"http://{self.place}"}
        try:
            request = HTTPRequest(f"ws://{self.place}/ws", headers=headers, connect_timeout=60.0, request_timeout=60.0)
            found = await websocket_connect(request, subprotocols=["bokeh", token])
            self.outcomes["socket opened"] += 1
            while await found.read_message() is not None:
                self.outcomes["messages"] += 1
        except HTTPClientError as error:
            self.outcomes[f"socket {error.code}"] += 1
        except (WebSocketClosedError, OSError):
            self.outcomes["socket closed"] += 1

    def _never_read(self) -> None:
        """A web socket whose other end takes nothing."""
        host, _, port = self.place.partition(":")
        made = socket.socket()
        made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, SMALL)
        made.connect((host, int(port)))
        token = generate_jwt_token(generate_session_id())
        lines = (
            "GET /ws HTTP/1.1", f"Host: {self.place}", "Upgrade: websocket", "Connection: Upgrade",
            "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
            f"Sec-WebSocket-Protocol: bokeh, {token}", f"Origin: http://{self.place}", f"Cookie: {self.cookie}", "", "",
        )  # fmt: skip
        made.sendall("\r\n".join(lines).encode())
        self._sockets.append(made)


def session(folder: Path, seconds: float, view: bool, connections: int, slow: int) -> tuple[dict[str, str], str]:
    """Figures of the nodes by "node: figure", and what became of the connections."""
    log = folder / "session.mcap"
    command = [sys.executable, "-m", "pneumo_ros.cli.main", "run", "--isolate", "--realtime", "--no-picture",
               "--no-report", "--duration", str(seconds), "--output", str(log),
               *(["--view"] if view else [])]  # fmt: skip
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert process.stdout is not None
    load: Load | None = None
    lines: list[str] = []
    for line in process.stdout:
        lines.append(line)
        if view and load is None and (found := URL.search(line)):
            load = Load(found.group(), connections, slow)
            threading.Thread(target=load.run, daemon=True).start()
        if "the dashboard stays" in line:
            process.send_signal(2)
    if process.wait(60) not in (0, 130):
        raise SystemExit("".join(lines))
    return figures(log), str(dict(load.outcomes)) if load is not None else ""


def figures(log: Path) -> dict[str, str]:
    """What the nodes said of their loops before the session ended."""
    out: dict[str, str] = {}
    for _, message in read_log(log).messages("/diagnostics"):
        for status in message.status:
            node = status.name.partition(":")[0]
            if node in NODES:
                out.update({f"{node}: {v.key}": v.value for v in status.values if v.key in FIGURES})
    return out


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--connections", type=int, default=200)
    parser.add_argument("--slow", type=int, default=4)
    options = parser.parse_args()
    rows = {
        "no page": (False, 0, 0),
        "page, one viewer": (True, 1, 0),
        f"{options.connections} connections, {options.slow} slow": (True, options.connections, options.slow),
    }
    names = [f"{node}: {figure}" for node in NODES for figure in FIGURES]
    print(f"| | {' | '.join(names)} |\n|{'---|' * (len(names) + 1)}")
    for label, (view, connections, slow) in rows.items():
        with tempfile.TemporaryDirectory() as folder:
            found, outcomes = session(Path(folder), options.seconds, view, connections, slow)
        print(f"| {label} | {' | '.join(found.get(name, '') for name in names)} | {outcomes}", flush=True)


if __name__ == "__main__":
    main()
