# SPDX-License-Identifier: Apache-2.0
"""The rig from YAML: config/rig.yaml is the nominal one, a session log carries its own under ``/rig/config``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml

from pneumo_ros.documents import parse_yaml
from pneumo_ros.errors import InputError
from pneumo_ros.paths import share_file
from pneumo_ros.rig.limits import END_LIMITS, LIMITS, OPTIONAL, checked, limit_of, number
from pneumo_ros.rig.parameters import NamedEffect, Quantity, Rig


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
    value = number(f"ends.{name}", entry["value"], where)
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


def _effect(place: int, entry: object, where: str, folder: Path | None) -> NamedEffect:
    key = f"effects[{place}]"
    parameters = entry.get("parameters") if isinstance(entry, Mapping) else None
    if not isinstance(entry, Mapping) or "effect" not in entry or not isinstance(parameters, Mapping):
        raise InputError(
            "needs effect, site and parameters", where=where, key=key, value=entry,
            remedy="write {effect: ID, site: front|rear|both|..., parameters: {name: value}}",
        )  # fmt: skip
    values = tuple((str(name), number(f"{key}.parameters.{name}", v, where)) for name, v in parameters.items())
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
            limit_of(str(key), where)
    base: dict[str, Any] = {name: {"value": value, "unit": "1"} for name, value in OPTIONAL.items()}
    base |= {} if known - set(base) <= set(entries) else _nominal_entries()
    quantities = {name: _quantity(name, entries.get(name, base.get(name)), where) for name in LIMITS}
    name = str(entries.get("name", base.get("name", "unnamed")))
    left_out = tuple(key for key in LIMITS if key not in entries and key not in OPTIONAL)
    return Rig(name=name, assumed=left_out, **quantities)  # type: ignore[arg-type]  # ends, effects: their defaults


def _nominal_entries() -> dict[str, Any]:
    text = share_file("config", "rig.yaml").read_text(encoding="utf-8")
    return dict(yaml.safe_load(text)["rig"])


def _quantity(name: str, entry: object, where: str) -> Quantity:
    limit = limit_of(name, where)
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
    std = number(f"{name}.std", entry.get("std", 0.0), where)
    if std < 0.0:
        raise InputError(
            "negative tolerance",
            where=where,
            key=f"{name}.std",
            value=std,
            allowed=">= 0",
            remedy="give one standard deviation",
        )
    return Quantity(checked(name, entry["value"], where), std, unit)
