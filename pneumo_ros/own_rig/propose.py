# SPDX-License-Identifier: Apache-2.0
"""A rig file proposed from what is in a log: every number that moves, by topic and field, to be named and sorted."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.errors import InputError
from pneumo_ros.own_rig.tables import is_table, table_of

WIDEST = 32  # entries of an array that are listed
STAMPS = re.compile(r"(^|\.)(stamp|sec|nanosec)(\.|$)|covariance|variance$")
UNITS = {"sensor_msgs/msg/FluidPressure": "Pa", "sensor_msgs/msg/Temperature": "degC"}
TIMES = ("t", "time", "time_s", "seconds", "stamp")


@dataclass(frozen=True)
class Found:
    """A number in a log: where it is, at which rate, and between what it moves."""

    name: str
    topic: str
    field: str
    unit: str
    rate: float
    low: float
    high: float


def numbers_of(path: Path) -> list[Found]:
    """All numbers of a log that move.

    Raises
    ------
    InputError
        if the log cannot be read, or nothing in it moves.
    """
    found = [one for one in (_table(path) if is_table(path) else _bag(path)) if one.high > one.low]
    if not found:
        raise InputError("nothing moves in the log", where=path, remedy="give one in which the rig was driven")
    return found


def proposal(path: Path) -> str:
    """The text of a rig file with these numbers as channels; what drives the rig is for its owner to move to inputs."""
    found = numbers_of(path)
    lines = [f"rig: {path.stem}"]
    if is_table(path):
        time = next((one.field for one in found if one.name.lower() in TIMES), None)
        lines.append(f"time: {{field: {_quoted(time or 't')}, unit: s}}" + ("" if time else "   # which column is it?"))
        found = [one for one in found if one.field != time]
    lines += ["# Every number that moves. Move what drives the rig to inputs, delete what is neither, set the units.",
              "channels:"]  # fmt: skip
    lines += [_line(one) for one in _named_apart(found)]
    lines += ["inputs: {}", "states: {}", "parameters: {}"]
    return "\n".join(lines) + "\n"


def _line(one: Found) -> str:
    topic = f"topic: {one.topic}, " if one.topic else ""
    seen = f"{one.low:.4g} ... {one.high:.4g}" + (f", {one.rate:.4g} Hz" if np.isfinite(one.rate) else "")
    return f"  {one.name}: {{{topic}field: {_quoted(one.field)}, unit: {_quoted(one.unit)}}}   # {seen}"


def _quoted(text: str) -> str:
    return f'"{text}"' if re.search(r"[^A-Za-z0-9_./]|^\d", text) else text


def _named_apart(found: list[Found]) -> Iterator[Found]:
    """Short names where they are unlike, with topic and field in them where not."""
    names, used = [one.name for one in found], set[str]()
    for one in found:
        name = one.name
        if names.count(name) > 1:
            name = _word(f"{one.topic}_{one.name}")
        if name in used:
            name = _word(f"{one.topic}_{one.field}")
        used.add(name)
        yield replace(one, name=name)


def _word(text: str) -> str:
    """A name that Python can use."""
    word = re.sub(r"\W+", "_", text).strip("_")
    return f"column_{word}" if not word or word[0].isdigit() else word


def _table(path: Path) -> Iterator[Found]:
    for field, column in table_of(path).items():
        tables = [(field, column)] if column.ndim == 1 else [
            (f"{field}[{k}]", column[:, k]) for k in range(min(column.shape[1], WIDEST))]  # fmt: skip
        for where, values in tables:
            yield _found("", where, values, "1", float("nan"))


def _bag(path: Path) -> Iterator[Found]:
    from pneumo_ros.log.reading import read_log

    log = read_log(path)
    for topic, info in sorted(log.topics.items()):
        if info.encoding != "cdr" or info.count < 2:
            continue
        columns = log.columns(topic)
        steps = np.diff(columns.stamp_ns)
        rate = 1e9 / float(np.median(steps)) if len(steps) and np.median(steps) > 0 else float("nan")
        for field, values in _fields(columns.arrays, columns.texts):
            yield _found(topic, field, values, UNITS.get(info.type, "1"), rate)


def _fields(arrays: Mapping[str, Any], texts: Mapping[str, Any]) -> Iterator[tuple[str, Array]]:
    names = next((t for t in texts.values() if isinstance(t, tuple)), ())
    for field, values in arrays.items():
        if STAMPS.search(field) or values.dtype.kind not in "fiu":
            continue
        if values.ndim == 1:
            yield field, values.astype(float)
        elif values.ndim == 2 and values.shape[1] <= WIDEST:
            for k in range(values.shape[1]):
                which = names[k] if len(names) == values.shape[1] else str(k)
                yield f"{field}[{which}]", values[:, k].astype(float)


def _found(topic: str, field: str, values: Array, unit: str, rate: float) -> Found:
    own = values[np.isfinite(values)]
    low, high = (float(own.min()), float(own.max())) if len(own) else (0.0, 0.0)
    bracket = re.search(r"\[([A-Za-z_]\w*)\]$", field)
    return Found(_word(bracket[1] if bracket else field), topic, field, unit, rate, low, high)
