# SPDX-License-Identifier: Apache-2.0
"""The air spring on a shaker: what Tables 5.4 and 5.5 say, and the static tables the Chapter 5 model looks up."""

from __future__ import annotations

import csv
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.paths import share_file
from pneumo_ros.plant.air_spring import AreaSurface, build_linear_surface
from pneumo_ros.units import INCH, POUND_MASS, PSI, SQUARE_INCH

FREQUENCY, DAMPING, AREA = (
    "table_5_4_natural_frequency_hz.csv",
    "table_5_5_damping_ratio.csv",
    "table_5_2_effective_area_in2.csv",
)


class Bench(NamedTuple):
    """Both tables, rows by pressure and columns by payload.

    Attributes
    ----------
    payload_lb : (4,) as printed
    mass : (5, 4) kg
    gauge : (5, 4) Pa
    frequency : (5, 4) natural frequency, rad/s
    damping : (5, 4) damping ratio
    surface : effective area by linear look-up in Table 5.2 (Section 5.6)
    """

    payload_lb: Array
    mass: Array
    gauge: Array
    frequency: Array
    damping: Array
    surface: AreaSurface


@lru_cache(maxsize=1)
def load_bench() -> Bench:
    """Read the tables that ship with the package."""
    gauges, names, frequency = _table(FREQUENCY)
    payload = np.array([float(name.split("_")[0]) for name in names])
    heights, columns, areas = _table(AREA)
    pressures = np.array([float(name.split("_")[0]) for name in columns])
    shape = frequency.shape
    return Bench(
        payload,
        np.broadcast_to(payload * POUND_MASS, shape).copy(),
        np.broadcast_to((gauges * PSI)[:, None], shape).copy(),
        2.0 * np.pi * frequency,
        _table(DAMPING)[2],
        build_linear_surface(heights * INCH, pressures * PSI, areas * SQUARE_INCH),
    )


def _table(name: str) -> tuple[Array, list[str], Array]:
    with share_file("config", "tables", name).open(newline="", encoding="utf-8") as handle:
        header, *rows = [row for row in csv.reader(handle) if row]
    values = np.array([[float(cell) for cell in row] for row in rows])
    return values[:, 0], header[1:], values[:, 1:]
