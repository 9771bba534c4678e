# SPDX-License-Identifier: Apache-2.0
"""Which logs of a folder belong together, to which rig and which date, by their names alone."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import pytest

from pneumo_ros.fleet.sessions import date_in, sessions_in


def made(folder: Path, *names: str) -> Path:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(b"")
    return folder


def test_pairs_folders_and_single_logs(tmp_path: Path) -> None:
    made(tmp_path, "a-fit.mcap", "a-holdout.mcap", "unit-2/2026-03-01/fit.csv", "unit-2/2026-03-01/holdout.csv",
         "unit-2/2026-04-01.csv", "b_fit.csv", "notes.txt", "rig.yaml")  # fmt: skip
    made(tmp_path, "bag_2026-05-02/metadata.yaml", "bag_2026-05-02/bag_0.mcap", "out/x/report.csv", ".hidden/z.csv")
    found = {one.name: one for one in sessions_in(tmp_path, tmp_path / "out")}
    assert sorted(found) == ["a", "b_fit", "bag_2026-05-02", "unit-2/2026-03-01", "unit-2/2026-04-01"]
    assert [log.name for log in found["a"].logs] == ["a-fit.mcap", "a-holdout.mcap"]
    assert found["unit-2/2026-03-01"].holdout is not None and found["b_fit"].holdout is None
    assert {name: one.rig for name, one in found.items()} == {
        "a": "a", "b_fit": "b_fit", "bag_2026-05-02": "bag", "unit-2/2026-03-01": "unit-2",
        "unit-2/2026-04-01": "unit-2"}  # fmt: skip
    assert found["unit-2/2026-04-01"].date == datetime(2026, 4, 1) and found["a"].date is None


def test_a_file_beside_a_log_is_none_and_a_result_is_not_looked_into(tmp_path: Path) -> None:
    made(tmp_path, "f_x.mat", "f_y.mat", "old/diagnosis.json", "old/residual.mcap")
    assert [one.name for one in sessions_in(tmp_path, tmp_path / "out", ("_y.mat",))] == ["f_x"]


@pytest.mark.parametrize(
    ("text", "date"),
    [
        ("unit/2026-03-01", datetime(2026, 3, 1)),
        ("20260301T101530_run", datetime(2026, 3, 1, 10, 15, 30)),
        ("2025-01-01/unit 2026-03-01 10-15", datetime(2026, 3, 1, 10, 15)),
        ("run 20261399", None),
        ("run 7", None),
    ],
)
def test_the_last_date_of_a_path_counts(text: str, date: datetime | None) -> None:
    assert date_in(text) == date
