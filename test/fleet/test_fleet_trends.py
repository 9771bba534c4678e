# SPDX-License-Identifier: Apache-2.0
"""Rows of a diagnosis, what grows over dates, and the page that says so."""

from __future__ import annotations

import csv
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest

from pneumo_ros.fleet.page import render
from pneumo_ros.fleet.rows import Row, refused, rows_of, write_csv
from pneumo_ros.fleet.trends import trends_of


def found(force: float | None, place: str = "rail") -> dict[str, Any]:
    """A diagnosis with friction of a force, or with nothing."""
    gap = {"nominal": 0.5, "refit": 0.4, "best": 0.1}
    if force is None:
        return {"verdict": "none", "probability": 1.0, "gap": gap, "budget": []}
    points = [[-1.0, -force, -1.1 * force, -0.9 * force, 0.5], [1.0, force, 0.9 * force, 1.1 * force, 0.5]]
    curve = {"x": {"name": "rate", "unit": "m/s"}, "y": {"name": "force", "unit": "N"}, "points": points}
    entry = {"effects": ["coulomb_friction"], "places": [place], "share": 0.64, "share_ci90": [0.49, 0.81],
             "law": "coulomb_friction", "curve": curve}  # fmt: skip
    parameters = {"friction_force": {"value": force, "std": 0.05 * force, "unit": "N"}}
    return {"verdict": "coulomb_friction", "probability": 0.99, "gap": gap, "budget": [entry],
            "ranking": [{"parameters": parameters}]}  # fmt: skip


def rows(*forces: float | None, rig: str = "unit") -> list[Row]:
    return [row for k, force in enumerate(forces, 1) for row in rows_of(f"{rig}/{k}", rig, datetime(2026, k, 1),
            found(force))]  # fmt: skip


def test_a_row_has_the_amount_of_the_measured_curve() -> None:
    (row,) = rows(2.0)
    assert (row.size, row.size_unit) == (pytest.approx(2.0), "N")
    assert (row.size_low, row.size_high) == (pytest.approx(1.8), pytest.approx(2.2))
    assert row.part == pytest.approx(0.5 * 0.8) and (row.parameter, row.value) == ("friction_force", 2.0)


@pytest.mark.parametrize(
    ("forces", "course"),
    [((1.0, 1.5, 2.0), "grows"), ((None, 2.0), "appears"), ((2.0, None), "goes"), ((2.0, 1.0), "shrinks"),
     ((2.0, 2.1), "stays"), ((2.0,), "once")],
)  # fmt: skip
def test_what_its_first_and_last_interval_do_not_share_has_changed(
    forces: tuple[float | None, ...], course: str
) -> None:
    (trend,) = trends_of(rows(*forces))
    assert trend.course == course and trend.unit == "N"


def test_a_log_that_tells_nothing_is_no_point() -> None:
    table = [*rows(1.0, 2.0), refused("unit/3", "unit", datetime(2026, 3, 1), "no such column")]
    table += rows_of("unit/4", "unit", datetime(2026, 4, 1), {**found(None), "verdict": "unknown"})
    (trend,) = trends_of(table)
    assert len(trend.points) == 2 and trend.course == "grows"


def test_the_page_names_what_grew_and_escapes_what_files_are_called(tmp_path: Path) -> None:
    table = [*rows(1.0, 2.0, rig="<b>unit</b>"), *rows(None, None, rig="other")]
    page = render(table, "fleet")
    assert "coulomb friction grows at rail of &lt;b&gt;unit&lt;/b&gt;." in page and "<b>unit" not in page
    assert page.count("nothing") == 2 and "<script" not in page
    write_csv(tmp_path / "rigs.csv", table)
    with (tmp_path / "rigs.csv").open() as stream:
        assert [line["verdict"] for line in csv.DictReader(stream)] == ["coulomb_friction"] * 2 + ["none"] * 2
