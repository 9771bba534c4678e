"""Shared helpers of the tests: where the reference data is, and a clear word when it is not there."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder with the reference tables, check values and sample logs that do not ship with the package."""
    folder = Path(os.environ.get("PNEUMO_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip(f"reference data not found at {folder}; set PNEUMO_SHARED to its folder")
    return folder


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Real-time tests get two more tries: a stall of a shared machine is not the code's; the bounds stay."""
    for item in items:
        if item.get_closest_marker("realtime"):
            item.add_marker(pytest.mark.flaky(reruns=2, reruns_delay=1))
