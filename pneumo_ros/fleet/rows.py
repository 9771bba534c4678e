# SPDX-License-Identifier: Apache-2.0
"""What was found in each log, a row an effect: for CSV, Parquet and the page."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from pneumo_ros.files import new_file

NO_AMOUNT = ("1", "SI")  # units of a share, and of a reading of any kind
REFUSED = "refused"


@dataclass(frozen=True)
class Row:
    """One effect of one log, or that there is none.

    Attributes
    ----------
    name, rig, date : of the session; the date in ISO form
    verdict, probability : as in diagnosis.json; ``refused`` where a log could not be used
    effect, place : "" where nothing is named
    share, share_low, share_high : of the squared nominal held-out gap, with its 90 % interval
    part, part_low, part_high : RMS of the gap that it makes over the signals' standard deviation
    size, size_low, size_high, size_unit : RMS of the force, flow ... itself along the log, of its measured curve; none
        where its curve is none of an amount
    parameter, value, std, unit : the law's first parameter, where its law is the library's
    gap_nominal, gap_refit, gap_best : as in diagnosis.json
    problem : why a log was refused
    """

    name: str
    rig: str
    date: str
    verdict: str
    probability: float | None = None
    effect: str = ""
    place: str = ""
    share: float | None = None
    share_low: float | None = None
    share_high: float | None = None
    part: float | None = None
    part_low: float | None = None
    part_high: float | None = None
    size: float | None = None
    size_low: float | None = None
    size_high: float | None = None
    size_unit: str = ""
    parameter: str = ""
    value: float | None = None
    std: float | None = None
    unit: str = ""
    gap_nominal: float | None = None
    gap_refit: float | None = None
    gap_best: float | None = None
    problem: str = ""

    @property
    def when(self) -> datetime:
        """The date."""
        return datetime.fromisoformat(self.date)


def rows_of(name: str, rig: str, date: datetime, found: Mapping[str, Any]) -> list[Row]:
    """Rows of a finished diagnosis (diagnosis.json)."""
    gap = found["gap"]
    common: dict[str, Any] = {
        "name": name, "rig": rig, "date": date.isoformat(sep=" "), "verdict": str(found["verdict"]),
        "probability": float(found["probability"]), "gap_nominal": _number(gap["nominal"]),
        "gap_refit": _number(gap["refit"]), "gap_best": _number(gap["best"])}  # fmt: skip
    named = found["verdict"] not in ("none", "unknown", "not_testable")
    effects = [_effect(entry, found) for entry in found.get("budget") or ()] if named else []
    return [Row(**common, **one) for one in effects] or [Row(**common)]


def refused(name: str, rig: str, date: datetime, problem: str) -> Row:
    """The row of a log that could not be used."""
    return Row(name, rig, date.isoformat(sep=" "), REFUSED, problem=problem)


def _number(value: Any) -> float | None:
    return None if value is None else float(value)


def _effect(entry: Mapping[str, Any], found: Mapping[str, Any]) -> dict[str, Any]:
    share, (low, high) = float(entry["share"]), (float(x) for x in entry["share_ci90"])
    nominal = float(found["gap"]["nominal"])
    part, part_low, part_high = (nominal * max(x, 0.0) ** 0.5 for x in (share, low, high))
    return {"effect": "+".join(entry["effects"]), "place": ", ".join(entry["places"]), "share": share, "share_low": low,
            "share_high": high, "part": part, "part_low": part_low, "part_high": part_high, **_size(entry.get("curve")),
            **_parameter(entry, found)}  # fmt: skip


def _size(curve: Mapping[str, Any] | None) -> dict[str, Any]:
    """RMS of a curve's amount, weighted by where the log was; none of a share or of a reading over itself."""
    if curve is None or curve["y"]["unit"] in NO_AMOUNT or curve["y"]["unit"] == curve["x"]["unit"]:
        return {}
    points = np.array(curve["points"], dtype=float)
    weight = points[:, 4] / np.sum(points[:, 4])
    size, band = (float(np.sqrt(weight @ y**2)) for y in (points[:, 1], 0.5 * (points[:, 3] - points[:, 2])))
    return {"size": size, "size_low": max(size - band, 0.0), "size_high": size + band,
            "size_unit": str(curve["y"]["unit"])}  # fmt: skip


def _parameter(entry: Mapping[str, Any], found: Mapping[str, Any]) -> dict[str, Any]:
    """The law's first parameter, of a log with one effect that follows its law."""
    if entry["law"] == "differs" or len(found["budget"]) != 1 or not found["ranking"]:
        return {}
    name, one = next(iter(found["ranking"][0]["parameters"].items()), ("", None))
    if one is None:
        return {}
    return {"parameter": name, "value": _number(one["value"]), "std": _number(one["std"]), "unit": str(one["unit"])}


def write_csv(path: Path, rows: Sequence[Row]) -> None:
    """The table as CSV."""
    with new_file(path) as part, part.open("w", newline="", encoding="utf-8") as stream:
        out = csv.DictWriter(stream, [field.name for field in fields(Row)])
        out.writeheader()
        out.writerows(asdict(row) for row in rows)


def write_parquet(path: Path, rows: Sequence[Row]) -> bool:
    """The table as Parquet; False where pyarrow is not installed."""
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        return False
    text = {field.name for field in fields(Row) if field.type == "str"}
    schema = pa.schema([(field.name, pa.string() if field.name in text else pa.float64()) for field in fields(Row)])
    with new_file(path) as part:
        parquet.write_table(pa.Table.from_pylist([asdict(row) for row in rows], schema=schema), part)
    return True
