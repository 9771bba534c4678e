# SPDX-License-Identifier: Apache-2.0
"""`pneumo diagnose-all`: a folder of logs, one table; finished ones are kept; what cannot be used is said."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import pytest
from helpers.browser import browser
from helpers.folders import ROOT
from helpers.own_rigs import chamber_log
from typer.testing import CliRunner, Result

from pneumo_ros.cli import diagnose_all
from pneumo_ros.errors import InputError

CHAMBER = ROOT / "examples" / "chamber" / "rig.py"


def run(folder: Path, *more: str) -> Result:
    words = [folder / "logs", "-o", folder / "out", "--rig-model", CHAMBER, "--workers", 1, *more]
    return CliRunner().invoke(diagnose_all.app, [str(word) for word in words])


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Result]:
    folder = tmp_path_factory.mktemp("fleet")
    unit = folder / "logs" / "unit-1"
    unit.mkdir(parents=True)
    chamber_log(unit / "2026-01-03.csv", 1, 1e-5)
    chamber_log(unit / "2026-02-03.csv", 2, 3e-4)
    (unit / "2026-03-03.csv").write_text("a;b\n")
    return folder, run(folder)


@pytest.mark.slow
def test_a_leak_that_came_is_in_the_table(done: tuple[Path, Result]) -> None:
    folder, result = done
    assert result.exit_code == 0, result.output
    assert "unit-1: leak at wall appears: 0 -> " in result.output and "2026-03-03: InputError" in result.output
    with (folder / "out" / "rigs.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    told = [(row["rig"], row["date"][:10], row["verdict"]) for row in rows]
    assert told == [("unit-1", "2026-01-03", "none"), ("unit-1", "2026-02-03", "leak"),
                    ("unit-1", "2026-03-03", "refused")]  # fmt: skip
    assert float(rows[1]["size"]) == pytest.approx(3e-4 * 6.9e5, rel=0.15) and rows[1]["size_unit"] == "Pa/s"
    assert (folder / "out" / "unit-1" / "2026-02-03" / "report.html").is_file()


@pytest.mark.slow
def test_finished_ones_are_kept_until_a_log_is_newer(done: tuple[Path, Result]) -> None:
    folder, _ = done
    results = {path: path.stat().st_mtime_ns for path in folder.glob("out/unit-1/*/diagnosis.json")}
    again = run(folder)
    assert "2 of 3 are finished and kept" in again.output
    assert {path: path.stat().st_mtime_ns for path in results} == results
    log, result = folder / "logs/unit-1/2026-01-03.csv", folder / "out/unit-1/2026-01-03/diagnosis.json"
    os.utime(log, ns=(results[result] + 1, results[result] + 1))
    assert "1 of 3 are finished" in run(folder, "--no-pairs").output
    assert result.stat().st_mtime_ns > results[result]


@pytest.mark.slow
def test_the_page_shows_rigs_by_dates(done: tuple[Path, Result]) -> None:
    with browser() as tab:
        tab.driver.get((done[0] / "out" / "rigs.html").as_uri())
        shown = tab.driver.execute_script("return document.body.innerText")
        dots = tab.driver.execute_script("return document.querySelectorAll('circle.dot').length")
        wide = tab.driver.execute_script("return document.documentElement.scrollWidth <= window.innerWidth")
    assert "leak appears at wall of unit-1." in shown and "not usable" in shown
    assert dots == 2 and wide


@pytest.mark.parametrize("wrong", ["empty", "missing", "a file"])
def test_a_folder_without_logs_is_told(wrong: str, tmp_path: Path) -> None:
    if wrong != "missing":
        (tmp_path / "logs").mkdir() if wrong == "empty" else (tmp_path / "logs").write_text("")
    told = run(tmp_path).exception
    assert isinstance(told, InputError) and len(str(told).splitlines()) == 1
    assert {"empty": "no log in the folder", "missing": "no such file or folder", "a file": "not a folder"}[
        wrong
    ] in str(told)
