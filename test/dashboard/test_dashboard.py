# SPDX-License-Identifier: Apache-2.0
"""The dashboard in a real browser: loads offline, moves, stops the rig, outlives the session; and who may see it."""

from __future__ import annotations

import asyncio
import os
import re
import signal
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import IO

import numpy as np
import pytest
from helpers import sessions
from helpers.browser import browser
from helpers.small_logs import contract_log, write

pytest.importorskip("bokeh")
from bokeh.document import Document
from bokeh.models import Legend
from bokeh.plotting import figure
from bokeh.util.token import generate_jwt_token, generate_session_id
from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import WebSocketClosedError, websocket_connect

from pneumo_ros.dashboard.guard import MAX_VIEWERS, is_loopback
from pneumo_ros.dashboard.pace import Pace
from pneumo_ros.dashboard.page import Page
from pneumo_ros.dashboard.panels import MOTION, PANELS, TYRES, Samples, derive, thin
from pneumo_ros.dashboard.ring import Ring
from pneumo_ros.dashboard.source import Playback, Status
from pneumo_ros.log import topics
from pneumo_ros.log.inspection import Event, read_events
from pneumo_ros.log.reading import read_log
from pneumo_ros.plant.air_spring import MEAN_AREA, VOLUME_OFFSET
from pneumo_ros.rig import load_rig

URL = re.compile(r"http://\S+")


# Names of parameters that are wider than their field.
LABELS = """
const wide = [];
function walk(root) {
  for (const e of root.querySelectorAll('*')) {
    if (e.tagName === 'LABEL' && e.offsetWidth) {
      const text = document.createRange(); text.selectNodeContents(e);
      const field = e.getRootNode().host.getBoundingClientRect().width;
      if (text.getBoundingClientRect().width > field) wide.push(e.textContent);
    }
    if (e.shadowRoot) walk(e.shadowRoot);
  }
}
walk(document); return wide;
"""


@contextmanager
def served(*arguments: str, module: str = "pneumo_ros.cli.view") -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """The command line's own server; gives the address it prints."""
    process = subprocess.Popen(
        [sys.executable, "-m", module, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        env={**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "COLUMNS": "300"},
    )  # fmt: skip
    assert process.stdout is not None
    try:
        said = []
        for line in process.stdout:
            said.append(line)
            if found := URL.search(line):
                yield found.group(), process
                break
        else:
            raise AssertionError("".join(said))
        process.send_signal(signal.SIGINT)
        process.wait(20)
    finally:
        process.kill()


@pytest.fixture(scope="module")
def log_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("log") / "a.mcap", contract_log(8000))


def test_derived_signals() -> None:
    """A pose put through the geometry comes back; the tyre force is stiffness times squeeze."""
    rig, time = load_rig(), np.array([0, 10])
    heave, pitch = np.array([0.02, 0.03]), np.array([0.01, -0.02])
    points = [heave + rig.front_arm.value * pitch, heave - rig.rear_arm.value * pitch, heave * 0.1, heave * 0.2]
    found = derive(
        {
            topics.DISPLACEMENT.name: Samples(time, topics.DISPLACEMENT.names, np.column_stack(points)),
            topics.ROAD.name: Samples(time, topics.ROAD.names, np.array([[0.001, 0.002], [0.003, 0.004]])),
        },
        rig,
    )
    np.testing.assert_allclose(found[MOTION].values, np.column_stack([heave, pitch]), atol=1e-15)
    assert found[TYRES].values[1, 1] == pytest.approx(14000.0 * (0.004 - 0.006))
    assert TYRES not in derive({topics.DISPLACEMENT.name: found[topics.DISPLACEMENT.name]}, rig)


def test_thinning_keeps_every_peak() -> None:
    t = np.arange(10_000.0)
    y = np.zeros_like(t)
    y[[1234, 7777]] = 5.0, -3.0
    short_t, short_y = thin(t, y, 600)
    assert len(short_t) <= 601 and short_y.max() == 5.0 and short_y.min() == -3.0
    assert np.all(np.diff(short_t) > 0) and short_t[-1] == t[-1]
    assert short_t[short_y == 5.0] == [1234.0]


def test_playback_moves_steps_seeks_and_loops(log_path: Path) -> None:
    play = Playback(read_log(log_path))
    shown = lambda: (play.status().now_ns - play.start_ns) * 1e-9  # noqa: E731
    play.speed = 2.0
    play.tick(0.5)
    assert shown() == pytest.approx(1.0)
    window = play.window(0.1)["/rig/displacement"]
    assert len(window.time_ns) == 51 and window.time_ns[-1] == play.status().now_ns
    play.step(0.02)
    play.tick(1.0)
    assert shown() == pytest.approx(1.02) and play.status().state == "paused"
    play.playing = True
    play.tick(100.0)
    assert shown() == pytest.approx(15.998) and play.status().state == "paused"
    play.play(True)  # at the end: from the beginning
    assert shown() == 0.0 and play.status().state == "playing"
    play.loop = True
    play.tick(100.0)
    assert shown() == 0.0 and play.status().state == "playing"
    play.seek(-5.0)
    assert shown() == 0.0


def test_no_legend_covers_a_curve(log_path: Path) -> None:
    document = Document()
    Page(document, Playback(read_log(log_path), seconds_before=60.0))
    plots = list(document.select({"type": figure}))
    assert len(plots) == len(PANELS)
    for plot in plots:
        assert [one for one in plot.above if isinstance(one, Legend)] == plot.legend[:], plot.title.text


class Unheard(Playback):
    """A session whose events are known before its first sample, as a viewer that joins may have it."""

    heard = False

    def status(self) -> Status:
        known = super().status()
        return known if self.heard else replace(known, now_ns=0, start_ns=0)

    def events(self) -> list[Event]:
        start = {"start_ns": str(self.start_ns)}
        return [Event(self.start_ns + 2 * 10**9, 0, "plant", "session_started", "first sample", start)]


def test_times_of_events_count_from_the_first_sample_as_soon_as_it_is_known(log_path: Path) -> None:
    document, source = Document(), Unheard(read_log(log_path))
    page = Page(document, source)
    table = next(iter(document.select({"name": "events"}))).source
    assert table.data["time"] == [""] and table.data["message"] == ["first sample"], "the clock's start is not read"
    source.heard = True
    page.refresh()
    assert table.data["time"] == ["2.000"]


class Tripped(Playback):
    """A session that tripped early and then went on with hundreds of late estimates."""

    def events(self) -> list[Event]:
        late = [Event(self.start_ns + k * 10**7, 1, "controller", "estimate_stale", "late", {}) for k in range(2, 500)]
        return [Event(self.start_ns + 10**7, 2, "plant", "estop", "emergency stop: valves closed", {}), *late]


def test_a_trip_stands_above_hundreds_of_warnings_that_came_later(log_path: Path) -> None:
    document = Document()
    Page(document, Tripped(read_log(log_path)))
    data = next(iter(document.select({"name": "events"}))).source.data
    assert data["code"][:3] == ["estop", "estimate_stale", "estimate_stale"] and data["level"][0] == "error"
    assert data["time"][1] == "4.990" and len(data["code"]) == 200  # of the others the newest first


def fetch(url: str, **headers: str) -> int:
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=20) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return error.code


def greeted(url: str, origin: str, cookie: str = "") -> bool:
    """Whether the server opens its web socket to a page of this origin and says hello (Bokeh's ACK)."""

    async def connect() -> bool:
        headers = {"Origin": origin, **({"Cookie": cookie} if cookie else {})}
        address = url.replace("http", "ws", 1).rstrip("/") + "/ws"
        # Bokeh's tokens hold for five minutes from their making, less than the suite takes.
        token = generate_jwt_token(generate_session_id())
        socket = await websocket_connect(HTTPRequest(address, headers=headers), subprotocols=["bokeh", token])
        return await asyncio.wait_for(socket.read_message(), 10) is not None

    try:
        return asyncio.run(connect())
    except (HTTPClientError, WebSocketClosedError):
        return False


def test_only_this_computer_and_this_page_with_the_token(log_path: Path) -> None:
    assert is_loopback("127.0.0.1") and is_loopback("localhost") and not is_loopback("0.0.0.0")
    for options in ((), ("--host", "0.0.0.0")):
        with served(str(log_path), *options) as (url, _):
            bare, token = re.sub(r"//[^:]+:", "//127.0.0.1:", url).split("?token=")
            kept, origin, port = f"pneumo_token={token}", bare.rstrip("/"), bare.rstrip("/").rpartition(":")[2]
            assert len(token) >= 24 and (options or url.startswith("http://127.0.0.1:"))
            for path in ("", "?token=wrong", "static/js/bokeh.min.js", "ws", "autoload.js", "nothing"):
                assert fetch(bare + path) == 403, path
            assert fetch(f"{bare}?token={token}") == 403  # without a cookie jar: sent on to the page, without the token
            assert fetch(bare, Cookie=kept) == 200 and fetch(bare, **{"X-Pneumo-Token": token}) == 200
            assert fetch(f"{bare}static/js/bokeh.min.js", Cookie=kept) == 200
            # A site whose name was bound to this computer's address comes with its own name (DNS rebinding).
            for host in (f"evil.example:{port}", "127.0.0.1", "127.0.0.1:1", f"127.0.0.1.evil.example:{port}", ""):
                assert fetch(bare, Cookie=kept, Host=host) in (400, 403), host
            assert fetch(bare, Cookie=kept, Origin="http://evil.example") == 403
            assert not greeted(bare, "http://evil.example", kept) and not greeted(bare, origin)
            assert not greeted(bare, "null", kept) and not greeted(bare, origin, "pneumo_token=wrong")
            assert greeted(bare, origin, kept)


def test_web_sockets_of_ones_own_making_open_no_more_tabs_than_pages_do(log_path: Path) -> None:
    async def opened(url: str, cookie: str) -> list[int]:
        """Status of each attempt, all of them kept open; 101 for those that were let in."""

        async def one() -> tuple[int, object]:
            headers = {"Origin": url.rstrip("/"), "Cookie": cookie}
            token = generate_jwt_token(generate_session_id())
            request = HTTPRequest(url.replace("http", "ws", 1) + "ws", headers=headers)
            try:
                socket = await websocket_connect(request, subprotocols=["bokeh", token])
                return (101 if await socket.read_message() is not None else 0), socket
            except HTTPClientError as error:
                return error.code, None

        return [status for status, _ in [await one() for _ in range(MAX_VIEWERS + 3)]]

    with served(str(log_path)) as (url, _):
        bare, token = url.split("?token=")
        assert asyncio.run(opened(bare, f"pneumo_token={token}")) == [101] * MAX_VIEWERS + [503] * 3
        assert fetch(bare, Cookie=f"pneumo_token={token}") == 503


@pytest.mark.slow
def test_a_log_plays_in_the_browser(log_path: Path) -> None:
    with served(str(log_path)) as (url, _), browser() as tab:
        tab.open(url)
        tab.wait(lambda: max(tab.drawn(), default=0) > 5000, "plots to be drawn")
        first = tab.model("position", "value")
        tab.wait(lambda: tab.model("position", "value") > first + 0.3, "playback to move")
        tab.click("Play / pause")
        tab.wait(lambda: "paused" in tab.model("status", "text"), "playback to pause")
        assert "a.mcap" in tab.driver.title


_PLOTS = """
const lefts = [];
function walk(root) {
  for (const e of root.querySelectorAll('*')) {
    if (e.classList.contains('bk-Figure') && e.offsetWidth) lefts.push(Math.round(e.getBoundingClientRect().left));
    if (e.shadowRoot) walk(e.shadowRoot);
  }
}
walk(document); return [document.documentElement.scrollWidth, lefts];
"""


@pytest.mark.slow
@pytest.mark.parametrize("overlay", [False, True])
def test_pages_fit_a_telephone_and_a_screen(log_path: Path, overlay: bool) -> None:
    """One column of plots at 390 px, two at 1280 px, and nothing to be pushed sideways; every tab gets its own page."""
    with served(str(log_path), *(("--with", str(log_path)) if overlay else ())) as (url, _), browser() as tab:
        for width, columns in ((390, 1), (1280, 2)):
            size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
            tab.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
            tab.driver.get(url)
            tab.wait(lambda: max(tab.drawn(), default=0) > 5000, "plots to be drawn")
            across, lefts = tab.driver.execute_script(_PLOTS)
            assert across <= width and len(lefts) >= 6 and len(set(lefts)) == columns


def line_with(words: str, stream: IO[str], seconds: float) -> bool:
    """Whether a line with these words comes in time."""
    found = threading.Event()

    def look() -> None:
        if any(words in line for line in stream):
            found.set()

    threading.Thread(target=look, daemon=True).start()
    return found.wait(seconds)


@pytest.mark.slow
def test_the_running_rig_is_shown_stopped_and_outlived(tmp_path: Path) -> None:
    """One real session: the red button closes the valves, a gain changes, and the page stays when the session ends."""
    pytest.importorskip("rclpy")
    path = tmp_path / "session.mcap"
    domain = str(sessions.own_domain())
    command = ("run", "--view", "--single-process", "--duration", "300", "--no-picture", "--domain-id", domain,
               "--output", str(path))  # fmt: skip
    with served(*command, module="pneumo_ros.cli.main") as (url, process), browser() as tab:
        tab.open(url)
        tab.wait(lambda: ">live<" in tab.model("status", "text"), "the session", 60)
        tab.click("EMERGENCY STOP")
        tab.wait(lambda: "emergency stop: done" in tab.model("answers", "text"), "the stop to be confirmed")
        tab.wait(lambda: tab.model("set-controller-pole", "value"), "the gains")
        assert tab.model("set-controller-pole", "title") == "controller.pole (1/s, 0.5 to 200)"
        assert tab.model("set-controller-follow_axles", "label") == "controller.follow_axles: off"
        assert tab.model("gains", "visible") is False  # the pictures come first
        tab.click("Parameters")
        tab.wait(lambda: tab.model("gains", "visible"), "the parameters to unfold")
        assert tab.driver.execute_script(LABELS) == [], "names that run into their neighbours"
        tab.driver.execute_script("Bokeh.documents[0].get_model_by_name('set-controller-pole').value = 12.5")
        tab.wait(lambda: "controller.pole = 12.5: set" in tab.model("answers", "text"), "the gain to change")
        os.kill(sessions.children(process.pid)["single_process"], signal.SIGINT)
        tab.wait(lambda: "cut short" in tab.model("status", "text"), "the session's end", 60)
        tab.wait(lambda: tab.model("estop", "disabled"), "the red button to end with its session")
        tab.wait(lambda: max(tab.drawn(), default=0) > 5000, "the last samples to stay")
        assert process.poll() is None and process.stdout is not None
        assert line_with("the dashboard stays", process.stdout, 120.0)
    log = read_log(path)
    codes = [event.code for event in read_events(log)]
    assert "estop" in codes and "parameter_changed" in codes
    assert_valves_closed(log, next(e.time_ns for e in read_events(log) if e.code == "estop"))


def assert_valves_closed(log: object, after_ns: int) -> None:
    """With closed valves the air's mass stays: P V^n is constant (Eq. 4.22 without flow)."""
    rig = load_rig()
    truth = log.joint(topics.TRUTH.name)  # type: ignore[attr-defined]
    x = truth.position[truth.stamp_ns > after_ns + 100_000_000]
    assert len(x) > 20
    heights = x[:, 0] + rig.front_arm.value * x[:, 1] - x[:, 2], x[:, 0] - rig.rear_arm.value * x[:, 1] - x[:, 3]
    for height, pressure in zip(heights, x[:, 8:10].T, strict=True):
        air = pressure * (VOLUME_OFFSET + MEAN_AREA * height) ** rig.polytropic_exponent.value
        assert np.ptp(air) < 1e-3 * air.mean()


def shown_by(takes: float, seconds: float = 60.0) -> tuple[int, int]:
    """Pictures that a browser draws which needs so many s for each, and the most that ever waited in it."""
    pace, waiting, most, drawn, ready = Pace(), [], 0, 0, np.inf
    for now in np.arange(0.0, seconds, 0.01).tolist():
        if waiting and now >= ready:
            drawn += 1
            pace.drawn(waiting.pop(0), now)
            ready = now + takes if waiting else np.inf
        if round(now * 100) % 10 == 0 and pace.due(now):
            waiting.append(pace.send(now))
            ready = min(ready, now + takes)
            most = max(most, len(waiting))
    return drawn, most


def test_a_slow_browser_never_falls_behind() -> None:
    """Ten pictures a second where it can; half of its time, and no queue, where it cannot; few where nobody listens."""
    assert shown_by(0.02)[0] >= 590 and shown_by(0.02)[1] == 1
    assert shown_by(0.4) == (pytest.approx(74, abs=4), 1)
    assert shown_by(3.0)[0] >= 8 and shown_by(3.0)[1] <= 3
    assert shown_by(1000.0) == (0, 6)


def test_ring_keeps_the_newest_and_begins_again_when_time_goes_back() -> None:
    ring = Ring(("a",), capacity=4)
    for i in range(6):
        ring.append(10 * i, [float(i)])
    assert ring.since(0).time_ns.tolist() == [20, 30, 40, 50]
    assert ring.since(35).values[:, 0].tolist() == [4.0, 5.0]
    ring.append(45, [9.0])  # a little late: sorted in
    assert ring.since(0).time_ns.tolist() == [30, 40, 45, 50]
    assert ring.since(45).values[:, 0].tolist() == [9.0, 5.0]
    ring.append(-(10**9) - 1, [7.0])
    assert ring.since(-(10**10)).values[:, 0].tolist() == [7.0]
