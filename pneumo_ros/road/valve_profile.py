# SPDX-License-Identifier: Apache-2.0
"""Valve openings over time, read from a file: what is played instead of what a controller would command.

A CSV with a header that names columns and units, for example::

    # interpolation: held
    time_s,front_inlet_m2,rear_inlet_m2
    0.0,9.1e-7,5.3e-7
    1.0,1.2e-6,5.3e-7

``time_s`` counts from the first sample of the session, like the road's. Areas are in m2, mm2 or in2. A valve without a
column stays at trim. ``held`` (the default) keeps a row until the next, ``linear`` runs straight from row to row; the
first row counts before its time as well, the last one ever after.
"""

from __future__ import annotations

import csv
import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.errors import InputError
from pneumo_ros.rig.channels import VALVES
from pneumo_ros.units import SQUARE_INCH

AREA_UNITS = {"m2": 1.0, "mm2": 1e-6, "in2": SQUARE_INCH}
INTERPOLATIONS = ("held", "linear")
ROUNDING = 1e-6  # relative: a largest opening written with few digits is still the largest opening
SOON = 1e-9  # s: a row is in force from its own instant on, whatever the last digit of the clock
_TIME = "time_s"
_COLUMNS = f"{_TIME} and some of {', '.join(f'{valve}_m2' for valve in VALVES)} (or _mm2, _in2)"


@dataclass(frozen=True)
class ValveProfile:
    """Openings of the four valves as functions of time.

    Attributes
    ----------
    path : file it was read from
    times : (N,) s, increasing
    areas : (N, 4) m2, columns :data:`~pneumo_ros.rig.channels.VALVES`
    linear : straight between rows instead of held
    digest : SHA-256 of the file
    """

    path: str
    times: NDArray[np.float64]
    areas: NDArray[np.float64]
    linear: bool
    digest: str

    def at(self, time: float) -> NDArray[np.float64]:
        """(4,) m2 at a time, s."""
        row = int(np.searchsorted(self.times, time + SOON, side="right")) - 1
        if row < 0 or row >= len(self.times) - 1 or not self.linear:
            return self.areas[max(row, 0)]
        share = min(max((time - self.times[row]) / (self.times[row + 1] - self.times[row]), 0.0), 1.0)
        return np.asarray(self.areas[row] + share * (self.areas[row + 1] - self.areas[row]))

    @property
    def duration(self) -> float:
        """Time of the last row, s."""
        return float(self.times[-1])

    def describe(self) -> dict[str, Any]:
        """What a log says of it."""
        word = INTERPOLATIONS[int(self.linear)]
        return {"path": self.path, "sha256": self.digest, "rows": len(self.times), "duration_s": self.duration,
                "interpolation": word}  # fmt: skip


def read_profile(path: str | Path, rest: NDArray[np.float64], largest: float) -> ValveProfile:
    """Read a profile.

    Parameters
    ----------
    path : CSV file as in the module's text
    rest : (4,) m2 of a valve that has no column
    largest : m2, no opening may exceed it

    Raises
    ------
    InputError
        naming line and column, the value and what is allowed.
    """
    if not str(path):
        raise InputError("no valve profile to play", where="controller", key="valve_profile",
                         remedy="give it with pneumo run --valves FILE.csv")  # fmt: skip
    data, rows = _rows(path)
    words = [row[0].lstrip("# ") for _, row in rows if row[0].lstrip().startswith("#")]
    numbered = [(line, row) for line, row in rows if not row[0].lstrip().startswith("#")]
    if len(numbered) < 2:
        raise InputError("needs a header and at least one row", where=path, allowed=_COLUMNS)
    header, body = numbered[0], numbered[1:]
    columns = _header(path, *header)
    table = np.array([_numbers(path, line, row, len(columns)) for line, row in body])
    times = table[:, columns.index(None)]
    if np.any(np.diff(times) <= 0.0):
        line = body[int(np.argmax(np.diff(times) <= 0.0)) + 1][0]
        raise InputError("times do not increase", where=f"{path}, line {line}", key=_TIME)
    areas = np.tile(np.asarray(rest, dtype=float), (len(table), 1))
    for k, column in enumerate(columns):
        if column is not None:
            areas[:, column[0]] = table[:, k] * column[1]
    _check_range(path, areas, [line for line, _ in body], largest)
    return ValveProfile(str(path), times, np.clip(areas, 0.0, largest), _linear(path, words),
                        hashlib.sha256(data).hexdigest())  # fmt: skip


def _rows(path: str | Path) -> tuple[bytes, list[tuple[int, list[str]]]]:
    """The file's bytes and its lines that are not empty, with their numbers."""
    try:
        data = Path(path).read_bytes()
        lines = data.decode("utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the valve profile ({error})", where=path, remedy="give a CSV file") from error
    return data, [(n, next(csv.reader([line]))) for n, line in enumerate(lines, 1) if line.strip()]


def _linear(path: str | Path, words: list[str]) -> bool:
    stated = [word.partition(":")[2].strip().lower() for word in words if word.lower().startswith("interpolation")]
    if stated and stated[-1] not in INTERPOLATIONS:
        raise InputError("unknown interpolation", where=path, value=stated[-1], allowed=" or ".join(INTERPOLATIONS))
    return bool(stated) and stated[-1] == "linear"


def _header(path: str | Path, line: int, row: list[str]) -> list[tuple[int, float] | None]:
    """For each column the valve and its unit in m2, None for the time."""
    where, names = f"{path}, line {line}", [cell.strip() for cell in row]
    if _TIME not in names or len(names) < 2:
        raise InputError("no header with a time and a valve", where=where, value=", ".join(names), allowed=_COLUMNS)
    columns: list[tuple[int, float] | None] = []
    for name in names:
        valve, _, unit = name.rpartition("_")
        if name != _TIME and (valve not in VALVES or unit not in AREA_UNITS):
            raise InputError("unknown column, or one without a unit", where=where, key=name, allowed=_COLUMNS)
        columns.append(None if name == _TIME else (VALVES.index(valve), AREA_UNITS[unit]))
    if len({None if c is None else c[0] for c in columns}) < len(columns):
        raise InputError("a column occurs twice", where=where, value=", ".join(names))
    return columns


def _numbers(path: str | Path, line: int, row: list[str], count: int) -> list[float]:
    try:
        values = [float(cell) for cell in row]
    except ValueError as error:
        raise InputError(f"not a number ({error})", where=f"{path}, line {line}") from error
    if len(values) != count or not np.all(np.isfinite(values)):
        raise InputError(f"needs {count} finite numbers", where=f"{path}, line {line}", value=", ".join(row))
    return values


def _check_range(path: str | Path, areas: NDArray[np.float64], lines: list[int], largest: float) -> None:
    bad = np.argwhere((areas < 0.0) | (areas > largest * (1.0 + ROUNDING)))
    if len(bad):
        row, valve = (int(v) for v in bad[0])
        raise InputError("the valve cannot open so far", where=f"{path}, line {lines[row]}", key=VALVES[valve],
                         value=float(areas[row, valve]), allowed=f"0 to {largest:g} m2",
                         remedy="check value and unit")  # fmt: skip
