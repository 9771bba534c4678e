# SPDX-License-Identifier: Apache-2.0
"""Calibrations as YAML: read with every mistake named, written so that the same numbers come back."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date
from pathlib import Path
from typing import Any

import yaml

from pneumo_ros.daq.calibration import (
    AREA_UNITS,
    DEFAULT,
    SENSORS,
    Calibration,
    SensorCalibration,
    ValveCalibration,
    units_of,
)
from pneumo_ros.documents import LARGEST, parse_yaml
from pneumo_ros.errors import InputError
from pneumo_ros.files import new_file
from pneumo_ros.paths import share_file
from pneumo_ros.rig.channels import VALVES

SENSOR_KEYS = ("gain", "offset", "unit", "zero", "date", "residual", "interval", "source")
VALVE_KEYS = ("gain", "offset", "unit", "source")


def find_calibration(name: str | Path | None) -> Path:
    """A path as it is, a bare name (``appendix_c``) from config/calibration; None is the default.

    Raises
    ------
    InputError
        if there is no such file.
    """
    path = Path(name or DEFAULT)
    if path.suffix or path.parent != Path():
        if not path.is_file():
            raise InputError("no such calibration file", where=path, remedy="give a readable YAML file")
        return path
    folder = share_file("config", "calibration")
    found = folder / f"{path}.yaml"
    if not found.exists():
        shipped = ", ".join(sorted(file.stem for file in folder.glob("*.yaml")))
        raise InputError("no such calibration", key="calibration", value=str(path), allowed=shipped,
                         remedy="or give a YAML file")  # fmt: skip
    return found


def load_calibration(name: str | Path | None = None) -> Calibration:
    """Read a calibration; see :func:`find_calibration` for ``name``.

    Raises
    ------
    InputError
        naming file, key, value, what is allowed and the remedy.
    """
    path = find_calibration(name)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the calibration ({error})", where=path, remedy="give a YAML file") from error
    return parse_calibration(text, str(path))


def parse_calibration(text: str, where: str) -> Calibration:
    """Read a calibration from YAML text; ``where`` names it in errors."""
    root = _mapping(parse_yaml(text, where), "calibration", where)
    sensors = _entries(root, "sensors", SENSORS, where)
    valves = _entries(root, "valves", VALVES, where)
    return Calibration(
        str(root.get("name", Path(where).stem)),
        {name: _sensor(name, entry, where) for name, entry in sensors.items()},
        {name: _valve(name, entry, where) for name, entry in valves.items()},
    )


def calibration_to_yaml(calibration: Calibration) -> str:
    """The text that :func:`parse_calibration` reads back to an equal calibration."""
    sensors = {name: {key: getattr(c, key) for key in SENSOR_KEYS} for name, c in calibration.sensors.items()}
    valves = {name: {key: getattr(c, key) for key in VALVE_KEYS} for name, c in calibration.valves.items()}
    document = {"calibration": {"name": calibration.name, "sensors": sensors, "valves": valves}}
    return yaml.safe_dump(document, sort_keys=False, width=120)


def save_calibration(calibration: Calibration, path: str | Path) -> None:
    """Write the YAML form; the name appears only when the file is complete."""
    with new_file(Path(path)) as part:
        part.write_text(calibration_to_yaml(calibration), encoding="utf-8")


def _mapping(entry: object, key: str, where: str) -> dict[str, Any]:
    if not isinstance(entry, Mapping) or not isinstance(entry.get(key), Mapping):
        raise InputError(
            f"no mapping '{key}:' found", where=where, remedy="start from config/calibration/appendix_c.yaml"
        )
    return dict(entry[key])


def _entries(root: dict[str, Any], key: str, names: tuple[str, ...], where: str) -> dict[str, Any]:
    entries = _mapping(root, key, where)
    for name in (*entries, *names):
        if name not in names:
            raise InputError("unknown channel", where=where, key=f"{key}.{name}", allowed=", ".join(names))
        if name not in entries:
            raise InputError("channel missing", where=where, key=f"{key}.{name}", remedy="add its line")
    return {name: entries[name] for name in names}


def _checked(name: str, entry: object, keys: tuple[str, ...], units: Mapping[str, float], where: str) -> dict[str, Any]:
    if not isinstance(entry, Mapping):
        raise InputError("needs a mapping", where=where, key=name, value=entry, allowed=", ".join(keys))
    for key in entry:
        if key not in keys:
            raise InputError("unknown key", where=where, key=f"{name}.{key}", allowed=", ".join(keys))
    for key in ("gain", "offset", "unit"):
        if key not in entry:
            raise InputError("key missing", where=where, key=f"{name}.{key}", remedy="add it")
    if str(entry["unit"]) not in units:
        raise InputError("unknown unit", where=where, key=f"{name}.unit", value=entry["unit"], allowed=", ".join(units))
    out = dict(entry)
    for key in ("gain", "offset", "zero", "residual", "interval"):
        if out.get(key) is not None:
            out[key] = _number(f"{name}.{key}", out[key], where)
    if out["gain"] == 0.0:
        raise InputError("a gain of zero measures nothing", where=where, key=f"{name}.gain", value=0.0)
    out["source"] = str(out.get("source") or "")
    return out


def _sensor(name: str, entry: object, where: str) -> SensorCalibration:
    values = _checked(name, entry, SENSOR_KEYS, units_of(name), where)
    when = values.get("date")
    values["date"] = when.isoformat() if isinstance(when, date) else when
    values["zero"] = values.get("zero") or 0.0
    return SensorCalibration(**values)


def _valve(name: str, entry: object, where: str) -> ValveCalibration:
    return ValveCalibration(**_checked(name, entry, VALVE_KEYS, AREA_UNITS, where))


def _number(key: str, raw: object, where: str) -> float:
    if isinstance(raw, bool) or not isinstance(raw, int | float) or not abs(raw) <= LARGEST:
        raise InputError("not a finite number", where=where, key=key, value=raw, allowed="a finite number")
    return float(raw)
