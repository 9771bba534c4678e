# SPDX-License-Identifier: Apache-2.0
"""Numbers with units as people write them: ``0.669 +- 0.13 N s/m``, ``2 bar``, ``7 s``."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from pneumo_ros.errors import InputError, not_one_of
from pneumo_ros.units import ATMOSPHERE, DEGREE, INCH, KMH, POUND_FORCE, PSI

# Unit as written -> factor to SI, offset in SI, unit in SI. Gauge pressures become absolute ones.
UNITS: dict[str, tuple[float, float, str]] = {
    "1": (1.0, 0.0, "1"), "%": (0.01, 0.0, "1"),
    "m": (1.0, 0.0, "m"), "cm": (1e-2, 0.0, "m"), "mm": (1e-3, 0.0, "m"), "um": (1e-6, 0.0, "m"),
    "in": (INCH, 0.0, "m"),
    "m/s": (1.0, 0.0, "m/s"), "mm/s": (1e-3, 0.0, "m/s"), "km/h": (KMH, 0.0, "m/s"), "m/s2": (1.0, 0.0, "m/s2"),
    "g": (9.80665, 0.0, "m/s2"), "m2": (1.0, 0.0, "m2"), "mm2": (1e-6, 0.0, "m2"),
    "rad": (1.0, 0.0, "rad"), "deg": (DEGREE, 0.0, "rad"), "rev": (2.0 * math.pi, 0.0, "rad"),
    "rad/s": (1.0, 0.0, "rad/s"), "deg/s": (DEGREE, 0.0, "rad/s"), "rpm": (math.pi / 30.0, 0.0, "rad/s"),
    "s": (1.0, 0.0, "s"), "ms": (1e-3, 0.0, "s"), "us": (1e-6, 0.0, "s"), "ns": (1e-9, 0.0, "s"),
    "min": (60.0, 0.0, "s"),
    "N": (1.0, 0.0, "N"), "kN": (1e3, 0.0, "N"), "lbf": (POUND_FORCE, 0.0, "N"), "N m": (1.0, 0.0, "N m"),
    "kg": (1.0, 0.0, "kg"), "V": (1.0, 0.0, "V"), "mV": (1e-3, 0.0, "V"), "A": (1.0, 0.0, "A"), "mA": (1e-3, 0.0, "A"),
    "Pa": (1.0, 0.0, "Pa"), "kPa": (1e3, 0.0, "Pa"), "MPa": (1e6, 0.0, "Pa"), "bar": (1e5, 0.0, "Pa"),
    "mbar": (1e2, 0.0, "Pa"), "psi": (PSI, 0.0, "Pa"), "bar gauge": (1e5, ATMOSPHERE, "Pa"),
    "kPa gauge": (1e3, ATMOSPHERE, "Pa"), "psi gauge": (PSI, ATMOSPHERE, "Pa"),
    "K": (1.0, 0.0, "K"), "degC": (1.0, 273.15, "K"), "kg/s": (1.0, 0.0, "kg/s"), "g/s": (1e-3, 0.0, "kg/s"),
    "rad/s2": (1.0, 0.0, "rad/s2"), "deg/s2": (DEGREE, 0.0, "rad/s2"), "mN": (1e-3, 0.0, "N"),
    "mN m": (1e-3, 0.0, "N m"), "kN m": (1e3, 0.0, "N m"), "W": (1.0, 0.0, "W"), "kW": (1e3, 0.0, "W"),
    "m3": (1.0, 0.0, "m3"), "l": (1e-3, 0.0, "m3"), "ml": (1e-6, 0.0, "m3"), "m3/s": (1.0, 0.0, "m3/s"),
    "m3/h": (1.0 / 3600.0, 0.0, "m3/s"), "l/s": (1e-3, 0.0, "m3/s"), "l/min": (1e-3 / 60.0, 0.0, "m3/s"),
}  # fmt: skip
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_TEXT = re.compile(rf"^\s*({_NUMBER})\s*(?:(?:\+-|\+/-|±)\s*({_NUMBER})\s*(%)?)?\s*(.*?)\s*$")


@dataclass(frozen=True)
class Written:
    """A number as it was written: value, standard deviation (0: exact) and unit, SI where the unit is known."""

    value: float
    std: float
    unit: str


def conversion(unit: str, where: object, key: str) -> tuple[float, float, str]:
    """Factor, offset and SI name of a unit.

    Raises
    ------
    InputError
        if it is not known.
    """
    if unit not in UNITS:
        raise not_one_of("unknown unit", unit, UNITS, where=where, key=key)
    return UNITS[unit]


def quantity(text: object, where: object, key: str, known: bool = False) -> Written:
    """A number with its tolerance and unit.

    Parameters
    ----------
    known : refuse a unit that is not listed; else an unlisted one is a label, its number SI already

    Raises
    ------
    InputError
        if it is no number.
    """
    if isinstance(text, (int, float)) and not isinstance(text, bool):
        return _checked(Written(float(text), 0.0, "1"), text, where, key)
    found = _TEXT.match(text) if isinstance(text, str) else None
    if found is None:
        raise InputError("not a number with a tolerance and a unit", where=where, key=key, value=text,
                         allowed="such as 3.08, '3.08 +- 0.03 kg', '2 bar'")  # fmt: skip
    value, std = float(found[1]), float(found[2] or 0.0)
    std = 0.01 * std * abs(value) if found[3] else std
    unit = found[4] or "1"
    if unit in UNITS or known:
        factor, offset, name = conversion(unit, where, key)
        return _checked(Written(value * factor + offset, std * factor, name), text, where, key)
    return _checked(Written(value, std, unit), text, where, key)


def _checked(found: Written, text: object, where: object, key: str) -> Written:
    if not (math.isfinite(found.value) and math.isfinite(found.std)):
        raise InputError("not a finite number", where=where, key=key, value=text, allowed="finite numbers")
    if found.std < 0.0:
        raise InputError("a tolerance below zero", where=where, key=key, value=text, allowed="0 or more")
    return found
