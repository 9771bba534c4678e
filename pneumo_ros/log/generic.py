# SPDX-License-Identifier: Apache-2.0
"""The generic way of decoding: message by message, for those that no fixed layout fits. Same paths, same values."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.log.layouts import Text, UnfitError

JOINT_FIELDS = ("position", "velocity", "effort")


def columns_of(messages: Iterable[Any]) -> tuple[dict[str, NDArray[Any]], dict[str, Text]]:
    """(arrays, constant texts) by field path, of deserialised messages of one type.

    Arrays have length N; where lengths differ from message to message, or texts change, they are object arrays.
    """
    values: dict[str, list[Any]] = {}
    for i, message in enumerate(messages):
        for path, value in flatten("", message):
            column = values.setdefault(path, [])
            column += [None] * (i - len(column))
            column.append(value)
    count = max(map(len, values.values()), default=0)
    for column in values.values():
        column += [None] * (count - len(column))
    # A text that never changes belongs to the topic, as in the bulk way.
    texts: dict[str, Any] = {p: v[0] for p, v in values.items() if _is_text(v[0]) and all(x == v[0] for x in v)}
    return {p: _stacked(v) for p, v in values.items() if p not in texts}, texts


def joints_of(messages: Sequence[Any]) -> tuple[tuple[str, ...], dict[str, NDArray[np.float64] | None]]:
    """(names, values by field) of JointState messages whose names change order or number.

    Each value is put where its name belongs, (N, K), NaN where a message lacks the name; a field that no message
    fills is None.

    Raises
    ------
    UnfitError
        saying which message has another number of values than names.
    """
    names = tuple(dict.fromkeys(name for message in messages for name in message.name))
    column = {name: i for i, name in enumerate(names)}
    fields = {key: np.full((len(messages), len(names)), np.nan) for key in JOINT_FIELDS}
    for row, message in enumerate(messages):
        order = [column[name] for name in message.name]
        for key, into in fields.items():
            values = getattr(message, key)
            if len(values) == len(order):
                into[row, order] = values
            elif len(values) or key == "position":
                raise UnfitError(f"message {row} has {len(order)} names but {len(values)} values of {key}")
    return names, {key: None if key != "position" and np.isnan(v).all() else v for key, v in fields.items()}


def flatten(path: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Leaves of a deserialised message, named as the bulk way names them."""
    if hasattr(value, "__msgtype__"):
        for name in value.__dataclass_fields__:
            if name != "__msgtype__":
                yield from flatten(f"{path}.{name}" if path else name, getattr(value, name))
    elif isinstance(value, list) and value and hasattr(value[0], "__msgtype__"):
        for i, entry in enumerate(value):
            yield from flatten(f"{path}[{i}]", entry)
    elif isinstance(value, list):
        yield path, tuple(value)
    else:
        yield path, value


def _is_text(value: Any) -> bool:
    return isinstance(value, str) or (isinstance(value, tuple) and all(isinstance(v, str) for v in value))


def _stacked(values: list[Any]) -> NDArray[Any]:
    shapes = {np.shape(v) for v in values if v is not None}
    if len(shapes) == 1 and not any(v is None or _is_text(v) for v in values):
        return np.array(values)
    out = np.empty(len(values), object)
    for i, value in enumerate(values):  # one by one: numpy would spread equally long values over a second axis
        out[i] = value
    return out
