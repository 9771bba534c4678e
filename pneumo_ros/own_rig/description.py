# SPDX-License-Identifier: Apache-2.0
"""rig.yaml: what the channels, inputs and parameters of a rig are called, where a log holds them, and how well they
are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from keyword import iskeyword
from pathlib import Path
from typing import Any

from pneumo_ros.documents import parse_yaml
from pneumo_ros.effects.parameters import Active
from pneumo_ros.errors import InputError, not_one_of
from pneumo_ros.own_rig.fmu.names import FmuNames, fmu_names
from pneumo_ros.own_rig.quantities import Written, conversion, quantity

KEYS = ("rig", "time", "start", "end", "channels", "inputs", "states", "parameters", "model_form", "families",
        "effects", "scales", "fmu")  # fmt: skip
MODEL_FORM = 0.05  # a model on one page is seldom truer than this; state what yours is worth
SIGNAL_KEYS = ("field", "topic", "unit", "sign", "noise", "hold", "beside", "rate_of", "default", "drive")


@dataclass(frozen=True)
class SignalSpec:
    """Where a log holds a signal.

    Attributes
    ----------
    name : as the model calls it
    field : column of a table, path in a message (``position[rear_axle]``, ``data[3]``), variable of a .mat file
    topic : of a bag; "" for tables
    unit : as logged; ``scale`` and ``shift`` make SI of it
    noise : standard deviation of its white noise, SI; None: from the data
    hold : an input that is held from row to row
    beside : (ending, other ending): the file that holds it has the log's name with another ending
    rate_of : the signal whose rate of change it is; ""
    drive : an input that its owner can command, so that an experiment may be proposed with it
    """

    name: str
    field: str
    topic: str = ""
    unit: str = "1"
    scale: float = 1.0
    shift: float = 0.0
    noise: float | None = None
    hold: bool = False
    beside: tuple[str, str] | None = None
    rate_of: str = ""
    drive: bool = False


@dataclass(frozen=True)
class Start:
    """The state at a record's first row: of a channel, of its rate of change, or a value with its uncertainty."""

    channel: str = ""
    rate: bool = False
    value: float = 0.0
    std: float = 0.0


@dataclass(frozen=True)
class Description:
    """A rig file as it was read, SI.

    Attributes
    ----------
    name, path : of the rig and of its file
    time : where tables hold the time, or s between rows; None: bags, which stamp
    start, end : s that are left out of each log, before and after; ``start_when``: a channel whose first move starts
    channels, inputs, parameters, states : by name, in order
    model_form : share of each channel's std that the maker holds the model form to be worth; 5 % unless stated
    families : slot's place -> families that may sit there
    effects, scales : of a rig that a diagnosis has saved: effects that stand, and their slots' scales
    fmu : variables and slots of a model.fmu
    """

    name: str
    path: Path
    time: SignalSpec | float | None
    start: float
    end: float
    start_when: str
    channels: Mapping[str, SignalSpec]
    inputs: Mapping[str, SignalSpec]
    parameters: Mapping[str, Written]
    states: Mapping[str, Start]
    model_form: float = MODEL_FORM
    families: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    effects: tuple[Active, ...] = ()
    scales: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    fmu: FmuNames | None = None
    raw: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def form_assumed(self) -> bool:
        """Whether nobody has said what the model form is worth."""
        return "model_form" not in self.raw


def read_description(path: Path) -> Description:
    """Read a rig file.

    Raises
    ------
    InputError
        naming file and key, for what cannot be used.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("the rig file cannot be read", where=path, remedy="a YAML file beside rig.py") from error
    table = parse_yaml(text, path)
    if not isinstance(table, dict):
        raise InputError("the rig file is no table", where=path, allowed=", ".join(KEYS))
    for key in table:
        if key not in KEYS:
            raise not_one_of("unknown entry", str(key), KEYS, where=path, key=str(key))
    return _described(table, path)


def _described(table: Mapping[str, Any], path: Path) -> Description:
    channels = _signals(table, "channels", path)
    if not channels:
        raise InputError("no channel is named", where=path, key="channels", remedy="name what the log measured")
    inputs = _signals(table, "inputs", path)
    both = next((name for name in channels if name in inputs), None)
    if both is not None:
        raise InputError("a channel and an input of one name", where=path, key=both, remedy="name them apart")
    parameters = {str(k): quantity(v, path, f"parameters.{k}") for k, v in _table(table, "parameters", path).items()}
    start, when = _starts_at(table.get("start", 0.0), channels, path)
    _check_names(path, channels, inputs, parameters, _table(table, "states", path))
    return Description(
        name=str(table.get("rig", path.stem)),
        path=path,
        time=_time(table["time"], path) if "time" in table else None,
        start=start,
        end=_seconds(table.get("end", 0.0), path, "end"),
        start_when=when,
        channels=channels,
        inputs=inputs,
        parameters=parameters,
        states={
            str(k): _start(v, channels, inputs, path, f"states.{k}") for k, v in _table(table, "states", path).items()
        },
        model_form=_share(table.get("model_form", MODEL_FORM), path),
        families={str(k): _names(v, path, f"families.{k}") for k, v in _table(table, "families", path).items()},
        effects=tuple(_effect(one, path) for one in _list(table, "effects", path)),
        scales={str(k): tuple(float(x) for x in v) for k, v in _table(table, "scales", path).items()},
        fmu=fmu_names(table["fmu"], path) if "fmu" in table else None,
        raw=table,
    )


def _table(table: Mapping[str, Any], key: str, path: Path) -> Mapping[str, Any]:
    found = table.get(key) or {}
    if not isinstance(found, dict):
        raise InputError("not a table of names", where=path, key=key, value=found, allowed="name: value")
    return found


def _list(table: Mapping[str, Any], key: str, path: Path) -> list[Any]:
    found = table.get(key) or []
    if not isinstance(found, list):
        raise InputError("not a list", where=path, key=key, value=found, allowed="a list")
    return found


def _signals(table: Mapping[str, Any], key: str, path: Path) -> dict[str, SignalSpec]:
    return {str(k): _signal(str(k), v, path, f"{key}.{k}") for k, v in _table(table, key, path).items()}


def _time(entry: Any, path: Path) -> SignalSpec | float:
    """A column, or the time from row to row."""
    if isinstance(entry, str) and entry[:1].isdigit():
        found = _seconds(entry, path, "time")
        if not found > 0.0:
            raise InputError("not a time from row to row", where=path, key="time", value=entry, allowed="above 0 s")
        return found
    return _signal("time", {"unit": "s", **entry} if isinstance(entry, dict) else entry, path, "time")


def _signal(name: str, entry: Any, path: Path, key: str) -> SignalSpec:
    if entry is None or (isinstance(entry, (str, int)) and not isinstance(entry, bool)):
        entry = {"field": name if entry is None else entry}
    if not isinstance(entry, dict):
        raise InputError("not a signal", where=path, key=key, value=entry, allowed="{field: ..., unit: ...}")
    for one in entry:
        if one not in SIGNAL_KEYS:
            raise not_one_of("unknown entry", str(one), SIGNAL_KEYS, where=path, key=f"{key}.{one}")
    unit = str(entry.get("unit", "1"))
    factor, offset, _ = conversion(unit, path, f"{key}.unit")
    sign = entry.get("sign", 1)
    if sign not in (1, -1):
        raise InputError("not a sign", where=path, key=f"{key}.sign", value=sign, allowed="1 or -1")
    noise = None if "noise" not in entry else _noise(entry["noise"], factor, path, f"{key}.noise")
    beside, rate_of = entry.get("beside"), str(entry.get("rate_of", ""))
    if beside is not None and not (isinstance(beside, list) and len(beside) == 2):
        raise InputError("not a pair of endings", where=path, key=f"{key}.beside", value=beside,
                         allowed="[_x.mat, _y.mat]")  # fmt: skip
    pair = None if beside is None else (str(beside[0]), str(beside[1]))
    where = str(entry.get("field", name)), str(entry.get("topic", ""))
    flags = _flag(entry, "hold", path, key), _flag(entry, "drive", path, key)
    return SignalSpec(name, *where, unit, factor * sign, offset * sign, noise, flags[0], pair, rate_of, flags[1])


def _flag(entry: Mapping[str, Any], name: str, path: Path, key: str) -> bool:
    found = entry.get(name, False)
    if not isinstance(found, bool):
        raise InputError("neither true nor false", where=path, key=f"{key}.{name}", value=found, allowed="true, false")
    return found


def _noise(entry: Any, factor: float, path: Path, key: str) -> float:
    """In the signal's own unit where it is a bare number; never shifted."""
    if isinstance(entry, (int, float)) and not isinstance(entry, bool):
        found = float(entry) * factor
    else:
        number = quantity(entry, path, key, known=True)
        found = number.value
    if not found > 0.0:
        raise InputError("noise that is not above zero", where=path, key=key, value=entry, allowed="above 0")
    return found


def _start(entry: Any, channels: Mapping[str, Any], inputs: Mapping[str, Any], path: Path, key: str) -> Start:
    known = {**channels, **inputs}
    if isinstance(entry, str):
        name = entry.removeprefix("rate of ").strip()
        if name in known:
            return Start(name, rate=entry.startswith("rate of "))
        if entry[:1].isalpha():
            raise not_one_of("no channel of this name", name, known, where=path, key=key, also="rate of ..., 0 +- 1 m")
    number = quantity(entry, path, key)
    return Start(value=number.value, std=number.std)


def _starts_at(entry: Any, channels: Mapping[str, Any], path: Path) -> tuple[float, str]:
    if isinstance(entry, str) and entry.startswith("when "):
        words = entry.removeprefix("when ").removesuffix("moves").strip()
        if words not in channels:
            raise not_one_of("no channel of this name", words, channels, where=path, key="start", also="a time, 7 s")
        return 0.0, words
    return _seconds(entry, path, "start"), ""


def _seconds(entry: Any, path: Path, key: str) -> float:
    found = quantity(entry, path, key)
    if found.unit not in ("1", "s") or found.value < 0.0:
        raise InputError("not a time", where=path, key=key, value=entry, allowed="0 s or more")
    return found.value


def _share(entry: Any, path: Path) -> float:
    found = quantity(entry, path, "model_form").value
    if not 0.0 <= found < 1.0:
        raise InputError("not a share", where=path, key="model_form", value=entry, allowed="0 to 1, such as 2 %")
    return found


def _names(entry: Any, path: Path, key: str) -> tuple[str, ...]:
    if not isinstance(entry, list) or not all(isinstance(one, str) for one in entry):
        raise InputError("not a list of names", where=path, key=key, value=entry, allowed="[coulomb_friction, stop]")
    return tuple(entry)


def _effect(entry: Any, path: Path) -> Active:
    try:
        return Active(str(entry["effect"]), str(entry["site"]), tuple(float(v) for v in entry["values"]))
    except (TypeError, KeyError, ValueError) as error:
        raise InputError("not an effect", where=path, key="effects", value=entry,
                         allowed="{effect: ..., site: ..., values: [...]}") from error  # fmt: skip


def usable_name(name: str) -> bool:
    """Whether Python can call something that."""
    return name.isidentifier() and not name.startswith("_") and not iskeyword(name)


def _check_names(path: Path, *tables: Mapping[str, Any]) -> None:
    for table in tables:
        for name in table:
            if not usable_name(str(name)):
                raise InputError("not a name that Python can use", where=path, key=str(name),
                                 allowed="letters, digits and _, as in rear_axle")  # fmt: skip
