# SPDX-License-Identifier: Apache-2.0
"""config/safety.yaml as typed values: safe command, timeouts, arming, limits, plausibility."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from pneumo_ros.documents import LARGEST, parse_yaml
from pneumo_ros.errors import InputError
from pneumo_ros.paths import share_file
from pneumo_ros.rig.channels import VALVES

MEASURED = (
    "front_height",
    "rear_height",
    "front_height_rate",
    "rear_height_rate",
    "front_pressure",
    "rear_pressure",
    "supply_pressure",
)
QUANTITIES = (*MEASURED, "command_area")
ACTIONS = ("trip", "estop")
REACTION = 0.05  # s within which the valves must be safe


@dataclass(frozen=True)
class Limit:
    """Warning and trip range of one quantity, SI; infinite where there is none."""

    warn_low: float
    warn_high: float
    trip_low: float
    trip_high: float
    persistence: float
    estop: bool


@dataclass(frozen=True)
class Timeouts:
    """Longest silence of each link, s (monotonic time)."""

    estimate: float
    command: float
    samples: float
    firmware: float


@dataclass(frozen=True)
class Arming:
    """What arming asks for; see config/safety.yaml."""

    healthy_for: float
    supply_low: float
    first_command: float
    ramp: float


@dataclass(frozen=True)
class Plausibility:
    """Thresholds of the sensor checks, SI; see config/safety.yaml."""

    displacement_range: tuple[float, float]
    pressure_range: tuple[float, float]
    displacement_rate: float
    pressure_rate: float
    bad_samples: int
    stuck_probability: float
    stuck_at_most: float
    force_balance: float
    force_balance_window: float
    lost_frames: float
    lost_at_once: float


@dataclass(frozen=True)
class SafetyConfig:
    """Everything of config/safety.yaml; ``safe_command`` in the order of VALVES, m2."""

    safe_command: tuple[float, ...]
    timeouts: Timeouts
    arming: Arming
    limits: Mapping[str, Limit]
    plausibility: Plausibility


def load_safety(path: str | Path | None = None) -> SafetyConfig:
    """Read a safety file; without a path, the one that ships with the package.

    Raises
    ------
    InputError
        naming file, key, value, what is allowed and the remedy.
    """
    source = Path(path) if path else share_file("config", "safety.yaml")
    try:
        text = source.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the safety file ({error})", where=source, remedy="give readable YAML") from error
    return parse_safety(parse_yaml(text, source), str(source))


def parse_safety(document: object, where: str) -> SafetyConfig:
    """Safety values from a YAML document; ``where`` names it in errors."""
    root = _section(document, "safety", where)
    parts = ("safe_command", "timeouts", "arming", "limits", "plausibility")
    _same_keys(root, parts, "safety", where)
    safe = _numbers(root, "safe_command", VALVES, where)
    limits = _section(root, "limits", where)
    _same_keys(limits, QUANTITIES, "limits", where)
    config = SafetyConfig(
        tuple(safe[name] for name in VALVES),
        Timeouts(**_numbers(root, "timeouts", _names(Timeouts), where)),
        Arming(**_numbers(root, "arming", _names(Arming), where)),
        {name: _limit(name, limits[name], where) for name in QUANTITIES},
        _plausibility(root, where),
    )
    for name in _names(Timeouts):
        value = getattr(config.timeouts, name)
        if not 0.0 < value <= REACTION:
            raise InputError(
                "a timeout must leave the valves safe in time", where=where, key=f"timeouts.{name}", value=value,
                allowed=f"above 0, at most {REACTION} s",
            )  # fmt: skip
    return config


def _plausibility(root: Mapping[str, Any], where: str) -> Plausibility:
    entries = _section(root, "plausibility", where)
    _same_keys(entries, _names(Plausibility), "plausibility", where)
    out: dict[str, Any] = {}
    for name, raw in entries.items():
        key = f"plausibility.{name}"
        out[name] = _pair(key, raw, where) if name.endswith("_range") else _number(key, raw, where)
    out["bad_samples"] = int(out["bad_samples"])
    return Plausibility(**out)


def _limit(name: str, entry: object, where: str) -> Limit:
    key = f"limits.{name}"
    if not isinstance(entry, Mapping):
        raise InputError("needs a mapping", where=where, key=key, value=entry)
    _same_keys(entry, ("warn", "trip", "persistence", "action"), key, where)
    if entry["action"] not in ACTIONS:
        raise InputError(
            "unknown action", where=where, key=f"{key}.action", value=entry["action"], allowed=", ".join(ACTIONS)
        )
    warn, trip = _pair(f"{key}.warn", entry["warn"], where), _pair(f"{key}.trip", entry["trip"], where)
    persistence = _number(f"{key}.persistence", entry["persistence"], where)
    return Limit(*warn, *trip, persistence, entry["action"] == "estop")


def _pair(key: str, raw: object, where: str) -> tuple[float, float]:
    if not isinstance(raw, list) or len(raw) != 2:
        raise InputError("needs [low, high]", where=where, key=key, value=raw, allowed="two numbers or null")
    low = -math.inf if raw[0] is None else _number(key, raw[0], where)
    high = math.inf if raw[1] is None else _number(key, raw[1], where)
    if low >= high:
        raise InputError("low is not below high", where=where, key=key, value=raw)
    return low, high


def _names(kind: type) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))


def _section(entry: object, key: str, where: str) -> Mapping[str, Any]:
    if not isinstance(entry, Mapping) or not isinstance(entry.get(key), Mapping):
        raise InputError(f"no mapping '{key}:' found", where=where, remedy="start from config/safety.yaml")
    return dict(entry[key])


def _same_keys(entry: Mapping[str, Any], names: tuple[str, ...], key: str, where: str) -> None:
    for name in entry:
        if name not in names:
            raise InputError("unknown key", where=where, key=f"{key}.{name}", allowed=", ".join(names))
    for name in names:
        if name not in entry:
            raise InputError("key missing", where=where, key=f"{key}.{name}", remedy="see config/safety.yaml")


def _numbers(root: Mapping[str, Any], key: str, names: tuple[str, ...], where: str) -> dict[str, float]:
    entries = _section(root, key, where)
    _same_keys(entries, names, key, where)
    return {name: _number(f"{key}.{name}", entries[name], where) for name in names}


def _number(key: str, raw: object, where: str) -> float:
    if isinstance(raw, bool) or not isinstance(raw, int | float) or not abs(raw) <= LARGEST:
        raise InputError("not a finite number", where=where, key=key, value=raw, allowed="a finite number like 4.5e+5")
    return float(raw)
