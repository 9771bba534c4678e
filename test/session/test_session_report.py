# SPDX-License-Identifier: Apache-2.0
"""The session's page says what happened, stands alone, and shows trips first."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from helpers.small_logs import STORE, T0, Message, contract_log, joint, text, write
from typer.testing import CliRunner

from pneumo_ros.cli.log import app
from pneumo_ros.errors import InputError
from pneumo_ros.log.decoded import STRING
from pneumo_ros.log.reading import read_log
from pneumo_ros.rig import load_rig
from pneumo_ros.session.report import write_report


def event(time_ns: int, level: int, code: str, message: str) -> Message:
    kinds = STORE.types
    pair = kinds["diagnostic_msgs/msg/KeyValue"]("code", code)
    status = kinds["diagnostic_msgs/msg/DiagnosticStatus"](level, "plant", message, "rig", [pair])
    array = kinds["diagnostic_msgs/msg/DiagnosticArray"](joint(time_ns, []).header, [status])  # type: ignore[attr-defined]
    return ("/rig/events", "diagnostic_msgs/msg/DiagnosticArray", time_ns, array)


def parameter_event(time_ns: int) -> Message:
    kind = "rcl_interfaces/msg/ParameterEvent"
    time = STORE.types["builtin_interfaces/msg/Time"](0, time_ns)
    return ("/parameter_events", kind, time_ns, STORE.types[kind](time, "/controller", [], [], []))


class Balanced(HTMLParser):
    """Fails on tags that do not close, and collects what the page refers to."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.references: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.references += [value or "" for name, value in attrs if name in ("src", "href")]
        if tag not in ("meta", "img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_page(tmp_path: Path) -> None:
    rig = load_rig().with_values(sprung_mass=51.5)
    messages = [
        *contract_log(),
        ("/rig/config", STRING, T0 + 1, text(rig.to_yaml())),
        ("/rig/setup", STRING, T0, text("node: controller\nparameters: {pole: 10.0}\n")),
        ("/rig/setup", STRING, T0 + 10**8, text("node: controller\nparameters: {pole: 20.0}\n")),
        ("/rig/calibration", STRING, T0, text("sprung_front: {slope: -0.0270281}\n")),
        *[parameter_event(1000)] * 20,  # all of one instant, long before the first sample
        event(T0 + 2 * 10**8, 2, "trip_pressure", "<b>too high</b>"),
        event(T0 + 5 * 10**8, 0, "session_complete", "the session's duration has passed"),
    ]
    log = write(tmp_path / "a.mcap", messages)
    page = tmp_path / "a.html"
    result = CliRunner().invoke(app, ["report", str(log)])
    assert result.exit_code == 0, result.output
    html = page.read_text(encoding="utf-8")
    parser = Balanced()
    parser.feed(html)
    assert not parser.open and all(r.startswith("data:image/png;base64,") for r in parser.references)
    assert "http:" not in html and "https:" not in re.sub(r"base64,[^\"]+", "", html)
    assert html.index("trip_pressure") < html.index("The ride") and "&lt;b&gt;too high" in html
    for words in (
        "pole 20.0",
        "changed",
        "session_complete",
        "51.5",
        "50.33",
        "inlets saturated",
        "/valve/command",
        "-0.0270281",
    ):
        assert words in html, words
    rows = [re.sub(r"<[^>]+>", " ", row).split() for row in html.split("<tr>")]
    assert ["0.100", "controller", "changed", "pole", "20.0"] in [row[:5] for row in rows], "since the first sample"
    assert any(row[:2] == ["0.200", "error"] for row in rows)
    assert not re.search(r">\s*nan\s*<", html)
    assert "--bad)" in html.split("border-left")[1][:40]


def test_a_session_that_was_cut_short_says_so_first(tmp_path: Path) -> None:
    messages = [*contract_log(), event(T0 + 5 * 10**8, 0, "session_complete", "the session's duration has passed")]
    log = write(tmp_path / "a.mcap", messages, metadata={"session": {"complete": "false", "reason": "node daq died"}})
    write_report(read_log(log), tmp_path / "a.html")
    head = (tmp_path / "a.html").read_text(encoding="utf-8").split("</header>")[0]
    assert "not complete: node daq died" in head and "duration has passed" not in head


def test_a_log_of_no_rig_is_refused(tmp_path: Path) -> None:
    log = read_log(write(tmp_path / "a.mcap", [m for m in contract_log(20) if m[0] != "/rig/config"]))
    with pytest.raises(InputError, match="/rig/config"):
        write_report(log, tmp_path / "a.html")
    assert not list(tmp_path.glob("*.html*"))
