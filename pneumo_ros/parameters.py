# SPDX-License-Identifier: Apache-2.0
"""Declared parameters: one entry says all that a node, the command line and the docs need of a value."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from pneumo_ros.documents import LARGEST
from pneumo_ros.errors import InputError, did_you_mean

Value = float | int | str | bool


@dataclass(frozen=True)
class Parameter:
    """A value that can be set from outside.

    Attributes
    ----------
    name : with its unit as a suffix wherever the unit is not SI
    default : its type (float, int, str, bool) is the parameter's type
    unit : "" for words and flags, "1" for pure numbers
    description : one sentence, what it does and how to choose it
    low, high : inclusive range of a number
    choices : allowed words
    read_only : True if it cannot change while a session runs
    """

    name: str
    default: Value
    unit: str
    description: str
    low: float = -math.inf
    high: float = math.inf
    choices: tuple[str, ...] = ()
    read_only: bool = False

    @property
    def allowed(self) -> str:
        """The range in words, for errors and tables."""
        if self.choices:
            return ", ".join(self.choices)
        if isinstance(self.default, bool):
            return "true or false"
        if isinstance(self.default, str):
            return "text"
        return f"{self.low:g} to {self.high:g} {self.unit}".rstrip()

    def checked(self, raw: object, where: object = None) -> Value:
        """``raw`` as this parameter's type, or an :class:`InputError` that names range and remedy."""
        value = _as_type(raw, self.default)
        if value is None or not self._accepts(value):
            raise InputError(
                "parameter cannot take this value",
                where=where,
                key=self.name,
                value=raw,
                allowed=self.allowed,
                remedy=self._remedy(raw),
            )
        return value

    def _remedy(self, raw: object) -> str:
        near = did_you_mean(raw, self.choices) if isinstance(raw, str) else None
        return near or f"default is {self.default!r}"

    def _accepts(self, value: Value) -> bool:
        if self.choices:
            return value in self.choices
        return isinstance(value, str | bool) or self.low <= value <= self.high


def settings(
    table: Iterable[Parameter], given: Mapping[str, object] | None = None, where: object = None
) -> dict[str, Value]:
    """Complete, checked values: the defaults of ``table`` with ``given`` laid over them.

    Raises
    ------
    InputError
        if a name is not in the table or a value is out of range.
    """
    known = {parameter.name: parameter for parameter in table}
    for name in given or {}:
        if name not in known:
            raise InputError(
                "unknown parameter", where=where, key=name, allowed=", ".join(known), remedy="correct or remove it"
            )
    return {
        name: parameter.checked(given[name], where) if given and name in given else parameter.default
        for name, parameter in known.items()
    }


def _as_type(raw: object, like: Value) -> Value | None:
    if isinstance(like, bool) or isinstance(raw, bool):
        return raw if isinstance(raw, bool) and isinstance(like, bool) else None
    if isinstance(like, str):
        return raw if isinstance(raw, str) else None
    if not isinstance(raw, int | float) or not abs(raw) <= LARGEST:
        return None
    if isinstance(like, int):
        return int(raw) if float(raw).is_integer() else None
    return float(raw)
