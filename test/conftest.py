# SPDX-License-Identifier: Apache-2.0
"""Shared helpers of the tests: where the reference data is, and a clear word when it is not there."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
NO_SKIP = "PNEUMO_NO_SKIP"  # set in CI: a skip is an error there, unless it is one of these
ALLOWED_SKIPS = {
    "reference data not found": "other people's measurements do not ship with the package",
    "this computer stalled too long": "a timeout was right to trip before the scenario began, several times in a row",
}


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder with the real measurements that do not ship with the package."""
    folder = Path(os.environ.get("PNEUMO_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip(f"reference data not found at {folder}; set PNEUMO_SHARED to its folder")
    return folder


@pytest.fixture(scope="session")
def practice(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """A practice log by its name, "leak-front-fit" for example, see test/data/README.md."""
    from helpers.practice import made

    folder = tmp_path_factory.mktemp("practice")
    return lambda name: made(name, folder)


@pytest.fixture(autouse=True)
def ordinary_priority() -> Iterator[None]:
    """A driver takes the best nice value for its process, which here is the process of every test after it."""
    before = os.getpriority(os.PRIO_PROCESS, 0)
    yield
    if os.getpriority(os.PRIO_PROCESS, 0) != before:
        os.setpriority(os.PRIO_PROCESS, 0, before)


@pytest.fixture(autouse=True)
def own_state(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """An emergency stop outlives its program: no test finds that of another one, or leaves one to the user."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))


def pytest_sessionstart() -> None:
    """What numba kept of functions with an older law inside is thrown away: it looks at the caller's file alone."""
    package = ROOT / "pneumo_ros"
    latest = max(file.stat().st_mtime for file in (package / "laws").glob("*.py"))
    for folder in ("laws", "effects", "slots", "own_rig"):
        for kept in (package / folder).rglob("*.nbi"):
            if kept.stat().st_mtime < latest:
                kept.unlink(missing_ok=True)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with many slow tests come first, so that processes that share the files end together."""
    slow = Counter(item.path for item in items if item.get_closest_marker("slow"))
    items.sort(key=lambda item: -slow[item.path])


def refuse_skip(report: Any, environment: str) -> None:
    """Make a skipped report a failed one, where skips are refused and its reason is not listed."""
    if not environment or not report.skipped or hasattr(report, "wasxfail"):
        return
    reason = str(report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr)
    if not any(allowed in reason for allowed in ALLOWED_SKIPS):
        report.outcome, report.longrepr = "failed", f"skipped, which CI does not allow: {reason}"


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport() -> Generator[None, Any, None]:
    """A test that skips."""
    made = yield
    refuse_skip(made.get_result(), os.environ.get(NO_SKIP, ""))


@pytest.hookimpl(hookwrapper=True)
def pytest_make_collect_report() -> Generator[None, Any, None]:
    """A module that skips, for want of a package."""
    made = yield
    refuse_skip(made.get_result(), os.environ.get(NO_SKIP, ""))
