# SPDX-License-Identifier: Apache-2.0
"""Numbers with their uncertainty, in the units that people read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from pneumo_ros.arrays import Array


def quantity_words(name: str, quantity: Mapping[str, Any]) -> str:
    """``7.1 ± 0.2 N`` of a value, its standard deviation if it has one, and its unit."""
    cells = quantity_cells(name, quantity)
    return f"{cells['value']} {cells['unit']}".rstrip()


def quantity_cells(name: str, quantity: Mapping[str, Any]) -> dict[str, str]:
    """Name, value with its standard deviation, and unit."""
    value, std = float(quantity["value"]), float(quantity.get("std") or 0.0)
    unit, factor = readable(str(quantity.get("unit") or "1"), np.array([value]))
    if unit == "1" and "error" in name:
        unit, factor = "%", 100.0
    return {"name": name.replace("_", " "), "value": rounded(value * factor, std * factor), "unit": _shown(unit)}


def quantity_row(name: str, quantity: Mapping[str, Any], prior: tuple[float, float] | None) -> dict[str, Any]:
    """The same beside what the rig's maker states: nominal value, tolerance, and how many tolerances it moved."""
    cells: dict[str, Any] = {**quantity_cells(name, quantity), "nominal": "", "tolerance": "", "sigmas": 0.0}
    if prior is None:
        return cells
    nominal, std = prior
    _, factor = readable(str(quantity.get("unit") or "1"), np.array([float(quantity["value"])]))
    moved = (float(quantity["value"]) - nominal) / std if std > 0.0 else 0.0
    return {**cells, "nominal": f"{nominal * factor:.5g}", "tolerance": f"{std * factor:.2g}", "sigmas": moved}


def _shown(unit: str) -> str:
    return "" if unit == "1" else unit


# SI unit -> (unit shown, factor, smallest value in SI that it is used from) [display]
_READABLE: Final = {
    "m": (("mm", 1e3, 0.5), ("µm", 1e6, 5e-4)), "m2": (("mm²", 1e6, 1e-2),), "m3": (("cm³", 1e6, 1e-2),),
    "Pa": (("kPa", 1e-3, np.inf),), "s": (("ms", 1e3, 0.5),), "kg/s": (("g/s", 1e3, 0.5), ("mg/s", 1e6, 1e-3)),
}  # fmt: skip


def readable(unit: str, values: Array) -> tuple[str, float]:
    """Unit and factor that make values of an SI unit easy to read: mm for millimetres, kPa for pressures."""
    size = float(np.max(np.abs(values))) if len(values) else 0.0
    found = (unit, 1.0)
    for name, factor, below in _READABLE.get(unit, ()):
        if 0.0 < size < below:
            found = (name, factor)
    return found


def rounded(value: float, std: float) -> str:
    """Value and standard deviation, the latter with two digits; four digits of the value without one."""
    if not np.isfinite(std) or std <= 0.0:
        return f"{value:.4g}"
    digits = int(np.floor(np.log10(std))) - 1
    if digits >= -6 and abs(value) < 1e6:
        places = max(-digits, 0)
        return f"{value:.{places}f} ± {std:.{places}f}"
    power = int(np.floor(np.log10(max(abs(value), std))))
    places = max(power - digits, 0)
    return f"({value / 10.0**power:.{places}f} ± {std / 10.0**power:.{places}f})·10^{power}"
