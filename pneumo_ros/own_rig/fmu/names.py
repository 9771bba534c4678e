# SPDX-License-Identifier: Apache-2.0
"""The entry ``fmu`` of rig.yaml: the FMU's names where they are others, and where its author lets one act."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pneumo_ros.errors import InputError, not_one_of
from pneumo_ros.slots.kinds import Contact, Flow, Force, Input, Sensor, Slot

KEYS = ("interface", "names", "slots")
INTERFACES = ("model exchange", "co-simulation")
KINDS: dict[str, type[Slot]] = {"force": Force, "contact": Contact, "flow": Flow}
SIGNALS: dict[str, type[Slot]] = {"input": Input, "sensor": Sensor}
ALONG, ACROSS = ("travel", "rate", "load"), ("up", "down", "nominal")  # coordinates in the kinds' own order
NEEDED = {"force": ("rate",), "contact": ("travel", "rate"), "flow": ("up", "down")}
Terms = tuple[tuple[str, float], ...]  # variables with their signs; their sum is a coordinate


@dataclass(frozen=True)
class FmuSlot:
    """A slot inside the equations.

    Attributes
    ----------
    slot : of its kind; what it would compute its coordinates from is the FMU's
    variable : the input of the FMU that is added where the slot is
    coordinates : three, in the order of the kind; none where the slot does without
    """

    slot: Slot
    variable: str
    coordinates: tuple[Terms, Terms, Terms]


@dataclass(frozen=True)
class FmuNames:
    """The entry as it was read.

    Attributes
    ----------
    interface : one of :data:`INTERFACES`; "" takes model exchange where the FMU has it
    names : as in rig.yaml -> as in the FMU, where they differ
    inside, signals : slots in the equations, and of inputs and sensors
    """

    interface: str
    names: Mapping[str, str]
    inside: tuple[FmuSlot, ...]
    signals: tuple[Slot, ...]

    def of(self, name: str) -> str:
        """What the FMU calls it."""
        return self.names.get(name, name)


def fmu_names(entry: Any, path: Path) -> FmuNames:
    """Read the entry.

    Raises
    ------
    InputError
        naming file and key.
    """
    table = _table(entry, path, "fmu")
    _known(table, KEYS, path, "fmu")
    interface = str(table.get("interface", ""))
    if interface and interface not in INTERFACES:
        raise not_one_of("no such interface", interface, INTERFACES, where=path, key="fmu.interface")
    names = {str(k): str(v) for k, v in _table(table.get("names"), path, "fmu.names").items()}
    slots = {str(k): v for k, v in _table(table.get("slots"), path, "fmu.slots").items()}
    inside = tuple(_inside(k, v, path) for k, v in slots.items() if not isinstance(v, str))
    return FmuNames(
        interface, names, inside, tuple(_signal(k, v, path) for k, v in slots.items() if isinstance(v, str))
    )


def _table(entry: Any, path: Path, key: str) -> Mapping[str, Any]:
    if entry is None:
        return {}
    if not isinstance(entry, dict):
        raise InputError("not a table of names", where=path, key=key, value=entry, allowed="name: value")
    return entry


def _known(table: Mapping[str, Any], keys: tuple[str, ...], path: Path, key: str) -> None:
    for one in table:
        if one not in keys:
            raise not_one_of("unknown entry", str(one), keys, where=path, key=f"{key}.{one}")


def _signal(name: str, kind: str, path: Path) -> Slot:
    if kind not in SIGNALS:
        raise not_one_of("no such kind of slot", kind, SIGNALS, where=path, key=f"fmu.slots.{name}",
                         also="{force: variable, travel: ..., rate: ...}")  # fmt: skip
    return SIGNALS[kind](name)


def _inside(name: str, entry: Any, path: Path) -> FmuSlot:
    key = f"fmu.slots.{name}"
    table = _table(entry, path, key)
    kind = next((one for one in KINDS if one in table), "")
    if not kind:
        raise InputError("a slot without the input that acts there", where=path, key=key,
                         allowed="{force: variable, travel: ..., rate: ...}, contact: or flow: likewise")  # fmt: skip
    order = ACROSS if kind == "flow" else ALONG
    units = ("unit", "pressure_unit", "gas") if kind == "flow" else ("unit", "travel_unit")
    _known(table, (kind, *order, *units), path, key)
    for one in NEEDED[kind]:
        if one not in table:
            raise InputError(f"a {kind} without its {one}", where=path, key=key,
                             remedy=f"name the variable of the FMU that is its {one}")  # fmt: skip
    said = {unit: bool(table[unit]) if unit == "gas" else str(table[unit]) for unit in units if unit in table}
    travel, rate, load = (_terms(table.get(one), path, f"{key}.{one}") for one in order)
    return FmuSlot(KINDS[kind](name, **said), str(table[kind]), (travel, rate, load))


def _terms(entry: Any, path: Path, key: str) -> Terms:
    """One variable, or the difference of two."""
    if entry is None:
        return ()
    words = [word.strip() for word in str(entry).split(" - ")]
    if not isinstance(entry, str) or len(words) > 2 or not all(words):
        raise InputError(
            "not a coordinate", where=path, key=key, value=entry, allowed="variable, or variable - variable"
        )
    return tuple((word, sign) for word, sign in zip(words, (1.0, -1.0), strict=False))
