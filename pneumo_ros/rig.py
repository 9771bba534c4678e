"""The rig's parameters: typed, in SI, each with the tolerance its maker states.

Nothing else in the package holds a number of the rig. ``config/rig.yaml`` is the nominal one; a session log
carries its own copy under ``/rig/config``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import yaml

from pneumo_ros.errors import InputError
from pneumo_ros.paths import share_file


@dataclass(frozen=True)
class Quantity:
    """A number with the standard deviation its maker knows it to, and its unit.

    ``std`` is one sigma in the same unit; 0 means exact (or not to be estimated).
    """

    value: float
    std: float
    unit: str


@dataclass(frozen=True)
class Limit:
    """Unit and allowed range (inclusive) of a rig parameter, with what it means."""

    unit: str
    low: float
    high: float
    meaning: str


LIMITS: dict[str, Limit] = {
    "design_height": Limit("m", 0.0305, 0.0558, "air spring height both ends are levelled to"),
    "sprung_mass": Limit("kg", 1.0, 1000.0, "body with payload"),
    "pitch_inertia": Limit("kg m2", 0.01, 1000.0, "body's moment of inertia about its centre of mass"),
    "front_arm": Limit("m", 0.01, 5.0, "centre of mass to front axle"),
    "rear_arm": Limit("m", 0.01, 5.0, "centre of mass to rear axle"),
    "unsprung_mass_front": Limit("kg", 0.05, 200.0, "front axle with wheel"),
    "unsprung_mass_rear": Limit("kg", 0.05, 200.0, "rear axle with wheel"),
    "tyre_stiffness_front": Limit("N/m", 100.0, 1e7, "front tyre, linear"),
    "tyre_stiffness_rear": Limit("N/m", 100.0, 1e7, "rear tyre, linear"),
    "bushing_damping": Limit("N s/m", 0.0, 1e5, "viscous damping between body and axle, each end"),
    "polytropic_exponent": Limit("1", 1.0, 1.67, "of the air in spring and orifices"),
    "supply_temperature": Limit("K", 200.0, 400.0, "stagnation temperature of the supply"),
    "supply_pressure": Limit("Pa", 110e3, 3e6, "absolute"),
    "ambient_pressure": Limit("Pa", 50e3, 110e3, "absolute"),
    "outlet_area_front": Limit("m2", 0.0, 1e-4, "constant opening to the atmosphere"),
    "outlet_area_rear": Limit("m2", 0.0, 1e-4, "constant opening to the atmosphere"),
    "inlet_area_max": Limit("m2", 1e-8, 1e-3, "fully open inlet valve"),
    "effective_area_scale": Limit("1", 0.2, 5.0, "factor on the effective area surface"),
    "volume_scale": Limit("1", 0.2, 5.0, "factor on the air spring volume"),
    "discharge_coefficient": Limit("1", 0.05, 2.0, "factor on every orifice area"),
    "displacement_noise": Limit("m", 0.0, 0.01, "standard deviation of white LVDT noise"),
    "pressure_noise": Limit("Pa", 0.0, 1e5, "standard deviation of white pressure noise"),
}


@dataclass(frozen=True)
class Rig:
    """Every number of the scaled half car (Table 3.4, sections 5.6 and 6.3), SI, with tolerances."""

    name: str
    design_height: Quantity
    sprung_mass: Quantity
    pitch_inertia: Quantity
    front_arm: Quantity
    rear_arm: Quantity
    unsprung_mass_front: Quantity
    unsprung_mass_rear: Quantity
    tyre_stiffness_front: Quantity
    tyre_stiffness_rear: Quantity
    bushing_damping: Quantity
    polytropic_exponent: Quantity
    supply_temperature: Quantity
    supply_pressure: Quantity
    ambient_pressure: Quantity
    outlet_area_front: Quantity
    outlet_area_rear: Quantity
    inlet_area_max: Quantity
    effective_area_scale: Quantity
    volume_scale: Quantity
    discharge_coefficient: Quantity
    displacement_noise: Quantity
    pressure_noise: Quantity

    @property
    def wheelbase(self) -> float:
        """Distance between the axles, m."""
        return self.front_arm.value + self.rear_arm.value

    def with_values(self, **values: float) -> Rig:
        """A copy with some values changed; tolerances and units stay.

        Raises
        ------
        InputError
            if a name is unknown or a value out of its range.
        """
        changed = {}
        for name, value in values.items():
            _limit_of(name, "with_values")
            changed[name] = replace(getattr(self, name), value=_checked(name, value, "with_values"))
        return replace(self, **changed)

    def to_dict(self) -> dict[str, Any]:
        """The mapping under ``rig:`` of the YAML form."""
        out: dict[str, Any] = {"name": self.name}
        for name in LIMITS:
            q: Quantity = getattr(self, name)
            out[name] = {"value": q.value, "std": q.std, "unit": q.unit}
        return out

    def to_yaml(self) -> str:
        """The text that /rig/config carries."""
        return yaml.safe_dump({"rig": self.to_dict()}, sort_keys=False)


def load_rig(path: str | Path | None = None) -> Rig:
    """Read a rig from YAML; without a path, the nominal rig that ships with the package.

    Raises
    ------
    InputError
        naming file, key, value, allowed range and remedy.
    """
    source = Path(path) if path is not None else share_file("config", "rig.yaml")
    try:
        text = source.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"cannot read the rig file ({error})", where=source, remedy="give a readable YAML file"
        ) from error
    return parse_rig(text, str(source))


def parse_rig(text: str, where: str = "rig") -> Rig:
    """Read a rig from YAML text; ``where`` names the text in errors.

    A key that the text leaves out keeps the nominal value, except that a text without ``rig:`` is refused.
    """
    try:
        document = yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f" at line {mark.line + 1}" if mark is not None else ""
        raise InputError(f"broken YAML{place}", where=where, remedy="mend the syntax") from error
    if not isinstance(document, Mapping) or not isinstance(document.get("rig"), Mapping):
        raise InputError("no mapping 'rig:' found", where=where, remedy="start from config/rig.yaml")
    return _from_mapping(document["rig"], where)


def _from_mapping(entries: Mapping[str, Any], where: str) -> Rig:
    known = {f.name for f in fields(Rig)}
    for key in entries:
        if key not in known:
            _limit_of(str(key), where)
    base = {} if set(known) <= set(entries) else _nominal_entries()
    quantities = {name: _quantity(name, entries.get(name, base.get(name)), where) for name in LIMITS}
    name = str(entries.get("name", base.get("name", "unnamed")))
    return Rig(name=name, **quantities)


def _nominal_entries() -> dict[str, Any]:
    text = share_file("config", "rig.yaml").read_text(encoding="utf-8")
    return dict(yaml.safe_load(text)["rig"])


def _limit_of(name: str, where: str) -> Limit:
    if name not in LIMITS:
        raise InputError(
            "unknown rig parameter",
            where=where,
            key=name,
            allowed=", ".join(LIMITS),
            remedy="correct the name or remove it",
        )
    return LIMITS[name]


def _quantity(name: str, entry: object, where: str) -> Quantity:
    limit = _limit_of(name, where)
    if not isinstance(entry, Mapping) or "value" not in entry:
        raise InputError(
            "needs a mapping with value, std and unit",
            where=where,
            key=name,
            value=entry,
            remedy=f"write {name}: {{value: ..., std: ..., unit: {limit.unit}}}",
        )
    extra = set(entry) - {"value", "std", "unit"}
    if extra:
        raise InputError(
            "unknown entry",
            where=where,
            key=f"{name}.{sorted(map(str, extra))[0]}",
            allowed="value, std, unit",
            remedy="remove it",
        )
    unit = str(entry.get("unit", limit.unit))
    if unit != limit.unit:
        raise InputError(
            "wrong unit",
            where=where,
            key=f"{name}.unit",
            value=unit,
            allowed=limit.unit,
            remedy="convert the value to SI",
        )
    std = _number(f"{name}.std", entry.get("std", 0.0), where)
    if std < 0.0:
        raise InputError(
            "negative tolerance",
            where=where,
            key=f"{name}.std",
            value=std,
            allowed=">= 0",
            remedy="give one standard deviation",
        )
    return Quantity(_checked(name, entry["value"], where), std, unit)


def _checked(name: str, raw: object, where: str) -> float:
    limit = _limit_of(name, where)
    value = _number(name, raw, where)
    if not limit.low <= value <= limit.high:
        raise InputError(
            "value out of range",
            where=where,
            key=name,
            value=value,
            allowed=f"{limit.low:g} to {limit.high:g} {limit.unit}",
            remedy="check value and unit",
        )
    return value


def _number(key: str, raw: object, where: str) -> float:
    if isinstance(raw, bool) or not isinstance(raw, int | float) or not math.isfinite(raw):
        raise InputError(
            "not a finite number",
            where=where,
            key=key,
            value=raw,
            allowed="a finite number",
            remedy="write it like 1.4 or 1.0e-05",
        )
    return float(raw)
