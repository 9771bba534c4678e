"""The rig's parameters: typed, in SI, each with the tolerance its maker states.

Nothing else in the package holds a number of the rig. ``config/rig.yaml`` is the nominal one; a session log
carries its own copy under ``/rig/config``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from pneumo_ros.documents import LARGEST, parse_yaml
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
    "model_form": Limit(
        "1", 0.0, 0.5, "share of each channel's std below which a difference is no effect to its maker"
    ),
}

# What an end may have of its own where the rig has one number for both, or where the command is not what happens.
END_LIMITS: dict[str, Limit] = {
    f"{name}_{end}": limit
    for end in ("front", "rear")
    for name, limit in {
        **{name: LIMITS[name] for name in
           ("bushing_damping", "effective_area_scale", "volume_scale", "discharge_coefficient")},
        "outlet_area": Limit("m2", 0.0, 1e-4, "opening that the commanded outlet area of ``rig:`` really gives"),
        "volume_slope": Limit("1", 0.2, 5.0, "factor on dV/dh about the design height"),
        "reference_pressure": Limit("Pa", 50e3, 3e6, "absolute; where the air has the supply's temperature (Eq. 4.17)"),
    }.items()
}  # fmt: skip


@dataclass(frozen=True)
class NamedEffect:
    """An effect that a diagnosis found in the rig; what ids, sites and parameters mean is in pneumo_ros/effects.

    Attributes
    ----------
    effect : id
    site : "front", "rear", "both", "" (the whole rig) or a channel
    parameters : name and value, SI
    source : SHA-256 of the Python source that defines it; empty for an effect of the library
    file : that source, only where the user gave the rig as a file and it stands beside it: never out of a log
    """

    effect: str
    site: str
    parameters: tuple[tuple[str, float], ...]
    source: str = ""
    file: str = field(default="", compare=False)

    @property
    def label(self) -> str:
        """Id and place, for messages."""
        return f"{self.effect} ({self.site or 'rig'})"

    def to_dict(self) -> dict[str, Any]:
        """Entry of the list ``effects:``, as a log carries it: no path."""
        out = {"effect": self.effect, "site": self.site, "parameters": dict(self.parameters)}
        return {**out, "source": self.source} if self.source else out

    def to_saved_dict(self) -> dict[str, Any]:
        """The same for a rig file, with the name of the Python file that stands beside it."""
        return {**self.to_dict(), "file": Path(self.file).name} if self.file else self.to_dict()


@dataclass(frozen=True)
class Rig:
    """Every number of the scaled half car (Table 3.4, sections 5.6 and 6.3), SI, with tolerances.

    ``ends`` (name of :data:`END_LIMITS`, value) and ``effects`` are what a diagnosis found beyond these numbers: a
    simulation with them behaves as the rig that was diagnosed. Controllers and estimators believe the numbers.
    """

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
    model_form: Quantity = Quantity(0.0, 0.0, "1")
    ends: tuple[tuple[str, float], ...] = ()
    effects: tuple[NamedEffect, ...] = ()

    @property
    def diagnosed(self) -> bool:
        """Whether the rig is more than the numbers of the nominal equations."""
        return bool(self.ends or self.effects)

    @property
    def findings(self) -> tuple[str, ...]:
        """What a diagnosis found beyond the numbers, one text each, for people and comparisons."""
        ends = tuple(f"{name} {value:.6g} {END_LIMITS[name].unit}" for name, value in self.ends)
        return (
            *(f"{one.label}: {', '.join(f'{k} {v:.6g}' for k, v in one.parameters)}" for one in self.effects),
            *ends,
        )

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
            if name == "model_form" and q.value == 0.0:
                continue  # absent means zero, as in the logs of others
            out[name] = {"value": q.value, "std": q.std, "unit": q.unit}
        return out

    def to_yaml(self, saved: bool = False) -> str:
        """The text that /rig/config carries; ``saved``: that of a rig file, which names files beside itself."""
        document: dict[str, Any] = {"rig": self.to_dict()}
        if self.ends:
            document["ends"] = {name: {"value": value, "unit": END_LIMITS[name].unit} for name, value in self.ends}
        if self.effects:
            document["effects"] = [one.to_saved_dict() if saved else one.to_dict() for one in self.effects]
        return yaml.safe_dump(document, sort_keys=False)


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
    return parse_rig(text, str(source), source.parent)


def parse_rig(text: str, where: str = "rig", folder: Path | None = None) -> Rig:
    """Read a rig from YAML text; ``where`` names the text in errors.

    A key that the text leaves out keeps the nominal value, except that a text without ``rig:`` is refused.

    Parameters
    ----------
    folder : of the rig file that the user named, where files of effects may stand; without it (a log's rig) no path
        that the text names is taken, let alone opened
    """
    document = parse_yaml(text, where)
    if not isinstance(document, Mapping) or not isinstance(document.get("rig"), Mapping):
        raise InputError("no mapping 'rig:' found", where=where, remedy="start from config/rig.yaml")
    own = {key: document[key] for key in ("model_form",) if key in document}  # some write it beside the rig's numbers
    rig = _from_mapping({**own, **document["rig"]}, where)
    effects = _effects(document.get("effects"), where, folder)
    return replace(rig, ends=_ends(document.get("ends"), where), effects=effects)


def _ends(entries: object, where: str) -> tuple[tuple[str, float], ...]:
    if entries is None:
        return ()
    if not isinstance(entries, Mapping):
        raise InputError(
            "not a mapping", where=where, key="ends", value=entries, remedy="write ends: {name: {value: ...}}"
        )
    return tuple((str(name), _end(str(name), entry, where)) for name, entry in entries.items())


def _end(name: str, entry: object, where: str) -> float:
    limit = END_LIMITS.get(name)
    if limit is None:
        raise InputError("unknown value of an end", where=where, key=f"ends.{name}", allowed=", ".join(END_LIMITS))
    if not isinstance(entry, Mapping) or "value" not in entry or entry.get("unit", limit.unit) != limit.unit:
        raise InputError(
            "needs a mapping with value and unit", where=where, key=f"ends.{name}", value=entry,
            remedy=f"write {name}: {{value: ..., unit: {limit.unit}}}",
        )  # fmt: skip
    value = _number(f"ends.{name}", entry["value"], where)
    if not limit.low <= value <= limit.high:
        allowed = f"{limit.low:g} to {limit.high:g} {limit.unit}"
        raise InputError("value out of range", where=where, key=f"ends.{name}", value=value, allowed=allowed)
    return value


def _effects(entries: object, where: str, folder: Path | None) -> tuple[NamedEffect, ...]:
    if entries is None:
        return ()
    if not isinstance(entries, list):
        raise InputError("not a list", where=where, key="effects", value=entries, remedy="write it as --save-rig does")
    return tuple(_effect(k, entry, where, folder) for k, entry in enumerate(entries))


def _effect(number: int, entry: object, where: str, folder: Path | None) -> NamedEffect:
    key = f"effects[{number}]"
    parameters = entry.get("parameters") if isinstance(entry, Mapping) else None
    if not isinstance(entry, Mapping) or "effect" not in entry or not isinstance(parameters, Mapping):
        raise InputError(
            "needs effect, site and parameters", where=where, key=key, value=entry,
            remedy="write {effect: ID, site: front|rear|both|..., parameters: {name: value}}",
        )  # fmt: skip
    values = tuple((str(name), _number(f"{key}.parameters.{name}", v, where)) for name, v in parameters.items())
    file = _beside(str(entry.get("file") or ""), folder, f"{key}.file", where)
    return NamedEffect(str(entry["effect"]), str(entry.get("site") or ""), values, str(entry.get("source") or ""), file)


def _beside(name: str, folder: Path | None, key: str, where: str) -> str:
    """The path of a file beside the rig file."""
    if not name or folder is None:
        return ""
    if Path(name).name != name or (folder / name).resolve().parent != folder.resolve():
        raise InputError("not beside the rig file", where=where, key=key, value=name, allowed="a file's name alone",
                         remedy=f"put the file into {folder} and write its name")  # fmt: skip
    return str((folder / name).resolve())


def _from_mapping(entries: Mapping[str, Any], where: str) -> Rig:
    known = {"name", *LIMITS}
    for key in entries:
        if key not in known:
            _limit_of(str(key), where)
    base = {"model_form": {"value": 0.0, "unit": "1"}}
    base |= {} if known - set(base) <= set(entries) else _nominal_entries()
    quantities = {name: _quantity(name, entries.get(name, base.get(name)), where) for name in LIMITS}
    name = str(entries.get("name", base.get("name", "unnamed")))
    return Rig(name=name, **quantities)  # type: ignore[arg-type]  # ends and effects keep their defaults


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
    if isinstance(raw, bool) or not isinstance(raw, int | float) or not abs(raw) <= LARGEST:
        raise InputError(
            "not a finite number",
            where=where,
            key=key,
            value=raw,
            allowed="a finite number",
            remedy="write it like 1.4 or 1.0e-05",
        )
    return float(raw)
