# SPDX-License-Identifier: Apache-2.0
"""Which effect grows where: its size over the dates of a rig.

A size counts where a diagnosis named the effect, and is 0 where one named none of it; a log that could not tell is no
point. What its first and last 90 % intervals do not share has grown, or shrunk.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pneumo_ros.fleet.rows import REFUSED, Row

SILENT = ("unknown", "not_testable", REFUSED)  # verdicts that say nothing of an effect's size


@dataclass(frozen=True)
class Point:
    """Size of an effect on a date, with its 90 % interval."""

    date: str
    size: float
    low: float
    high: float


@dataclass(frozen=True)
class Trend:
    """An effect at a place of a rig over its dates.

    Attributes
    ----------
    points : by date; RMS over the signals' standard deviation
    unit : of the sizes; "" for RMS over the signals' standard deviation, where a curve has no amount on some date
    course : ``appears``, ``grows``, ``shrinks``, ``goes``, ``stays``, or ``once`` where there is one date
    """

    rig: str
    effect: str
    place: str
    points: tuple[Point, ...]
    unit: str
    course: str

    @property
    def change(self) -> float:
        """Of its size from the first to the last date, over the larger of the two."""
        first, last = self.points[0].size, self.points[-1].size
        return (last - first) / max(first, last, 1e-300)


def trends_of(rows: Sequence[Row]) -> list[Trend]:
    """Every effect of every rig, those that grew most first."""
    keys = dict.fromkeys((row.rig, row.effect, row.place) for row in rows if row.effect)
    found = [_trend(rig, effect, place, rows) for rig, effect, place in keys]
    return sorted(found, key=lambda one: -one.change)


def _trend(rig: str, effect: str, place: str, rows: Sequence[Row]) -> Trend:
    told = [row for row in rows if row.rig == rig and row.verdict not in SILENT]
    here = {row.name: row for row in told if (row.effect, row.place) == (effect, place)}
    units = {row.size_unit for row in here.values()}
    unit = units.pop() if len(units) == 1 else ""
    dated = dict(sorted({row.name: row.date for row in told}.items(), key=lambda one: one[1]))
    points = tuple(_point(date, here.get(name), unit) for name, date in dated.items())
    return Trend(rig, effect, place, points, unit, course(points))


def _point(date: str, row: Row | None, unit: str) -> Point:
    """0 where a log named something else, or nothing."""
    if row is None:
        return Point(date, 0.0, 0.0, 0.0)
    values = (row.size, row.size_low, row.size_high) if unit else (row.part, row.part_low, row.part_high)
    return Point(date, *(value or 0.0 for value in values))


def course(points: Sequence[Point]) -> str:
    """What an effect did from its first to its last date."""
    if len(points) < 2:
        return "once"
    first, last = points[0], points[-1]
    if last.low > first.high:
        return "appears" if first.size == 0.0 else "grows"
    if last.high < first.low:
        return "goes" if last.size == 0.0 else "shrinks"
    return "stays"
