# SPDX-License-Identifier: Apache-2.0
"""Two hundred texts that would be markup, commands or formulas, in every place of a log, through every way out."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import pytest
from helpers.browser import Browser, browser
from helpers.hostile import MARK, hostile_log, hostile_texts
from typer.testing import CliRunner

from pneumo_ros.cli.main import app
from pneumo_ros.cli.terminal import Console
from pneumo_ros.diagnosis.report.plots import ladder
from pneumo_ros.errors import InputError
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.tables import export, file_name
from pneumo_ros.printable import one_line, printable
from pneumo_ros.session.report import write_report

TEXTS = hostile_texts()
UNSHOWN = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]")
COLOURS = re.compile(r"\x1b\[[0-9;]*m")
# Elements that only a text could have made, in the page and in the shadow roots Bokeh draws into.
_FOREIGN = """
const found = [];
function walk(root) {
  for (const e of root.querySelectorAll('*')) {
    if (e.matches('img[src="x"], iframe, [onerror], [onload], a[href^="javascript"]')) found.push(e.outerHTML);
    if (e.tagName === 'SCRIPT' && e.textContent.includes('pwned')) found.push(e.outerHTML);
    if (e.shadowRoot) walk(e.shadowRoot);
  }
}
walk(document); return [window.pwned || 0, found];
"""
_SCROLL = """
function* walk(root) {
  for (const e of root.querySelectorAll('*')) { yield e; if (e.shadowRoot) yield* walk(e.shadowRoot); }
}
for (const e of walk(document)) { if (e.matches('.slick-viewport')) { e.scrollTop = arguments[0]; } }
const rows = [];
for (const e of walk(document)) { if (e.matches('.slick-row')) rows.push(e.textContent); }
return rows;
"""


@pytest.fixture(scope="module")
def log_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return hostile_log(tmp_path_factory.mktemp("log") / "a<img src=x onerror=window.pwned=1>\u202e.mcap")


def assert_harmless(tab: Browser) -> None:
    pwned, found = tab.driver.execute_script(_FOREIGN)
    assert not pwned and not found, found


def test_there_are_two_hundred_texts() -> None:
    assert len(set(TEXTS)) == 200 and sum(MARK in text for text in TEXTS) > 50


@pytest.mark.slow
def test_the_page_shows_them_and_runs_none(log_path: Path) -> None:
    from test_dashboard import served  # type: ignore[import-not-found]

    with served(str(log_path)) as (url, _), browser() as tab:
        tab.open(url)
        tab.wait(
            lambda: len(tab.model("events", "source") or ()) and "paused" in tab.model("status", "text"), "the end"
        )
        seen: set[str] = set()
        foreign: list[object] = []

        def all_seen() -> bool:
            """Scrolled through once more: a slow browser draws some rows after they are read."""
            for place in range(0, 6000, 150):
                seen.update(tab.driver.execute_script(_SCROLL, place))
                pwned, found = tab.driver.execute_script(_FOREIGN)
                foreign.extend([pwned, *found] if pwned or found else [])
            return len(seen) >= 200

        tab.wait(all_seen, "every text")
        assert not foreign and any("<script>" in row for row in seen)
        # The policy holds by itself: an inline script that got into the page would not run.
        tab.driver.execute_script(f"const s = document.createElement('script'); s.textContent = '{MARK}';"
                                  "document.body.append(s)")  # fmt: skip
        assert not tab.driver.execute_script("return window.pwned || 0")


@pytest.mark.slow
def test_the_report_shows_them_and_runs_none(log_path: Path, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    write_report(read_log(log_path), page)
    content = page.read_text(encoding="utf-8")
    assert (
        "<script" not in content and "default-src 'none'" in content and not UNSHOWN.search(content.replace("\t", ""))
    )
    with browser() as tab:
        tab.driver.get(page.as_uri())
        assert_harmless(tab)
        assert "<script>" in tab.driver.execute_script("return document.body.innerText")


@pytest.mark.parametrize(
    "verb",
    [("info",), ("validate",), ("compare", "LOG"), ("info", "--json"), ("compare", "LOG", "--json")],
    ids=" ".join,
)
def test_the_terminal_shows_them_and_obeys_none(log_path: Path, verb: tuple[str, ...]) -> None:
    done = CliRunner().invoke(
        app, ["log", verb[0], str(log_path), *(str(log_path) if v == "LOG" else v for v in verb[1:])]
    )
    assert done.exception is None or isinstance(done.exception, SystemExit), repr(done.exception)
    assert "pwned" in done.output and not UNSHOWN.search(done.output)


@pytest.mark.parametrize("text", TEXTS)
def test_a_colour_terminal_gets_our_sequences_only(text: str) -> None:
    out = io.StringIO()
    console = Console(file=out, force_terminal=True, width=200)
    console.print(text, soft_wrap=True)
    console.print(f"[red]{'x'}[/] {text}", soft_wrap=True)
    assert not UNSHOWN.search(COLOURS.sub("", out.getvalue()).replace("\t", ""))
    error = str(InputError("cannot read", where=text, key=text, value=text, remedy="give another"))
    assert "\n" not in error and not UNSHOWN.search(error)
    assert not UNSHOWN.search(one_line(text)) and printable(printable(text)) == printable(text)
    assert "/" not in file_name(text, ".csv") and "\0" not in file_name(text, ".csv")


def test_tables_hold_texts_and_no_formulas(log_path: Path, tmp_path: Path) -> None:
    files = export(read_log(log_path), tmp_path)
    assert len(files) > 400 and all(file.parent == tmp_path for file in files)
    cells = 0
    for file in files:
        with file.open(newline="", encoding="utf-8") as stream:
            for row in csv.reader(stream):
                cells += len(row)
                for cell in row:
                    formula = cell.lstrip()[:1] in ("=", "+", "-", "@") or cell[:1] in ("\t", "\r", "\n")
                    assert not formula or re.fullmatch(r"-?[0-9.e+-]+", cell), repr(cell)
    assert cells > 2000


def test_drawings_of_a_diagnosis_escape_names() -> None:
    drawn = ladder([(text, 0.5, "") for text in TEXTS])
    assert "<script" not in drawn and "<img" not in drawn
