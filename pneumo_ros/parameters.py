"""One declaration of a settable parameter, from which nodes, command line, checks and docs are made."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Union

from pneumo_ros.errors import InputError

Value = Union[bool, int, float, str]  # noqa: UP007 - evaluated at run time
ParameterValues = dict[str, Value]


@dataclass(frozen=True)
class Parameter:
    """A parameter of a node, an estimator or a controller.

    Attributes
    ----------
    name : as it is set, lower case with dots or underscores; carries the unit where that is not SI
    default : also fixes the type (bool, int, float or str)
    unit : SI unit, '1' for a ratio, '' for text and switches
    description : one sentence
    low, high : inclusive range of a number
    choices : allowed texts; empty for any
    read_only : True if it cannot change while the node runs
    """

    name: str
    default: Value
    unit: str
    description: str
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    read_only: bool = True

    @property
    def allowed(self) -> str:
        """The range in words, with its unit."""
        if self.choices:
            return ", ".join(self.choices)
        if isinstance(self.default, bool):
            return "true, false"
        if isinstance(self.default, str):
            return "a text"
        low = "-inf" if self.low is None else f"{self.low:g}"
        high = "inf" if self.high is None else f"{self.high:g}"
        return f"{low} to {high} {self.unit}".strip()

    def check(self, raw: object, where: object = None) -> Value:
        """The value in the declared type.

        Raises
        ------
        InputError
            naming where, key, value, allowed range and remedy.
        """
        value = self._typed(raw)
        if value is None:
            raise InputError(
                f"not a {type(self.default).__name__}", where=where, key=self.name, value=raw,
                allowed=self.allowed, remedy="correct the type",
            )  # fmt: skip
        inside = not self.choices or value in self.choices
        if isinstance(value, int | float) and not isinstance(value, bool):
            inside = (self.low is None or value >= self.low) and (self.high is None or value <= self.high)
        if not inside:
            raise InputError(
                "value out of range", where=where, key=self.name, value=raw, allowed=self.allowed,
                remedy="choose a value inside",
            )  # fmt: skip
        return value

    def _typed(self, raw: object) -> Value | None:
        if isinstance(self.default, bool) or isinstance(raw, bool):
            return raw if isinstance(self.default, bool) and isinstance(raw, bool) else None
        if isinstance(self.default, float) and isinstance(raw, int | float):
            return float(raw) if math.isfinite(raw) else None
        if isinstance(self.default, int) and isinstance(raw, int):
            return raw
        return raw if isinstance(self.default, str) and isinstance(raw, str) else None


def defaults(table: Iterable[Parameter]) -> ParameterValues:
    """Name -> default of a table."""
    return {p.name: p.default for p in table}


def check_all(table: Iterable[Parameter], values: Mapping[str, object], where: object = None) -> ParameterValues:
    """Defaults overridden by checked ``values``.

    Raises
    ------
    InputError
        for an unknown key or a value that is not allowed.
    """
    known = {p.name: p for p in table}
    out = defaults(known.values())
    for key, raw in values.items():
        if key not in known:
            raise InputError("unknown parameter", where=where, key=key, value=raw, allowed=", ".join(sorted(known)),
                             remedy="correct the name or remove it")  # fmt: skip
        out[key] = known[key].check(raw, where)
    return out
