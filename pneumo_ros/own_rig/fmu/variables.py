# SPDX-License-Identifier: Apache-2.0
"""The names of rig.yaml among the variables of an FMU: which number each has, and whether it may be used as that."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.arrays import Array
from pneumo_ros.errors import InputError, not_one_of
from pneumo_ros.own_rig.description import Description
from pneumo_ros.own_rig.fmu.names import INTERFACES, FmuNames

References = NDArray[np.uint32]
NUMBERS = ("Real", "Float64")  # of FMI 2 and 3
SHOWN = 12  # names of the FMU that an error lists


@dataclass(frozen=True)
class Variables:
    """Value references, in the order of rig.yaml.

    Attributes
    ----------
    exchange : whether our loop integrates the states; else the FMU steps itself
    states : names as in rig.yaml where it has them, else as in the FMU; the FMU's order
    starts : references of the values that set them: of a co-simulation
    parameters, driven, read : references; ``driven`` are inputs, then what acts at the slots
    seen, weights : what the coordinates are made of; (3 K, len(seen))
    """

    exchange: bool
    states: tuple[str, ...]
    starts: References
    parameters: References
    driven: References
    read: References
    seen: References
    weights: Array


def matched(model: Any, rig: Description, path: Path) -> Variables:
    """Match the names.

    Parameters
    ----------
    model : fmpy's model description

    Raises
    ------
    InputError
        naming the entry of rig.yaml whose variable is not there or not of its kind.
    """
    names = rig.fmu
    assert names is not None
    exchange = _exchange(model, names, path)
    table = {v.name: v for v in model.modelVariables}
    table |= {alias.name: v for v in model.modelVariables for alias in getattr(v, "aliases", ())}
    find = _Finder(table, _foreign(model), names, rig.path)
    states, starts = find.states(model, rig) if exchange else (tuple(rig.states), find.settable(rig.states, "states"))
    inputs = [find(name, f"inputs.{name}", ("input",)) for name in rig.inputs]
    acting = [find.named(one.variable, f"fmu.slots.{one.slot.name}", ("input",)) for one in names.inside]
    seen, weights = find.coordinates(names)
    read = [find(name, f"channels.{name}") for name in rig.channels]
    return Variables(exchange, states, _references(starts), _references(find.settable(rig.parameters, "parameters")),
                     _references([*inputs, *acting]), _references(read), _references(seen), weights)  # fmt: skip


def _references(values: Iterable[int]) -> References:
    return np.array(list(values), dtype=np.uint32)


def _exchange(model: Any, names: FmuNames, path: Path) -> bool:
    has = [name for name, one in zip(INTERFACES, (model.modelExchange, model.coSimulation), strict=True) if one]
    if not has or (names.interface and names.interface not in has):
        raise InputError("the FMU has no such interface", where=path, value=names.interface or None,
                         allowed=", ".join(has) or "none here: export model exchange or co-simulation")  # fmt: skip
    return (names.interface or has[0]) == INTERFACES[0]


def _foreign(model: Any) -> frozenset[str]:
    """Units that are not SI: logs are converted to SI, so the FMU's numbers must be."""
    bases = {unit.name: unit.baseUnit for unit in model.unitDefinitions if unit.baseUnit is not None}
    return frozenset(name for name, base in bases.items() if base.factor != 1.0 or base.offset != 0.0)


class _Finder:
    """Variables by name, each looked at for what it is to be."""

    def __init__(self, table: Mapping[str, Any], foreign: frozenset[str], names: FmuNames, path: Path) -> None:
        self.table, self.foreign, self.names, self.path = table, foreign, names, path

    def __call__(self, name: str, key: str, causalities: tuple[str, ...] = ()) -> int:
        return self.named(self.names.of(name), key, causalities)

    def named(self, variable: str, key: str, causalities: tuple[str, ...] = ()) -> int:
        """The reference of a variable that is a number in SI."""
        found = self.table.get(variable)
        if found is None:
            likely = [name for name, one in self.table.items() if not causalities or one.causality in causalities]
            listed = likely if len(likely) <= SHOWN else [*likely[:SHOWN], f"... {len(likely)} in all"]
            raise not_one_of("the FMU has no such variable", variable, listed, where=self.path, key=key)
        if found.type not in NUMBERS or found.dimensions:
            raise self._not("a number of double precision", found.type, variable, key)
        if causalities and found.causality not in causalities:
            raise self._not(" or ".join(causalities), found.causality, variable, key)
        unit = found.unit or getattr(found.declaredType, "unit", None)
        if unit in self.foreign:
            raise self._not("in SI", unit, variable, key)
        return int(found.valueReference)

    def _not(self, allowed: str, value: object, variable: str, key: str) -> InputError:
        return InputError(
            f"the FMU's {variable} cannot be that", where=self.path, key=key, value=value, allowed=allowed
        )

    def settable(self, names: Iterable[str], table: str) -> list[int]:
        """References of what may be set before a run begins."""
        found = []
        for name in names:
            key, variable = f"{table}.{name}", self.names.of(name)
            found.append(self.named(variable, key))
            one = self.table[variable]
            if one.variability == "constant" or (
                one.causality != "parameter" and one.initial not in ("exact", "approx")
            ):
                raise self._not("a parameter, or a start value that is exact", one.initial or one.variability,
                                variable, key)  # fmt: skip
        return found

    def states(self, model: Any, rig: Description) -> tuple[tuple[str, ...], list[int]]:
        """Continuous states in the FMU's order, by the names that rig.yaml has for them."""
        owned = [unknown.variable.derivative for unknown in model.derivatives]
        if any(one is None or one.dimensions for one in owned):
            raise InputError("a continuous state that is an array, or that is not named", where=self.path,
                             remedy="export the FMU with scalar states, or as co-simulation")  # fmt: skip
        given = {self(name, f"states.{name}"): name for name in rig.states}
        order = [int(one.valueReference) for one in owned]
        for reference, name in given.items():
            if reference not in order:
                raise not_one_of("no continuous state of the FMU", self.names.of(name),
                                 [one.name for one in owned], where=self.path, key=f"states.{name}")  # fmt: skip
        return tuple(given.get(r, one.name) for r, one in zip(order, owned, strict=True)), order

    def coordinates(self, names: FmuNames) -> tuple[list[int], Array]:
        """Variables of the slots' coordinates, and what sums them up."""
        seen: list[int] = []
        rows = [(f"fmu.slots.{one.slot.name}", terms) for one in names.inside for terms in one.coordinates]
        entries = [
            (k, self.named(variable, key), sign) for k, (key, terms) in enumerate(rows) for variable, sign in terms
        ]
        for _, reference, _ in entries:
            if reference not in seen:
                seen.append(reference)
        weights = np.zeros((len(rows), len(seen)))
        for k, reference, sign in entries:
            weights[k, seen.index(reference)] += sign
        return seen, weights
