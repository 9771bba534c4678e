# SPDX-License-Identifier: Apache-2.0
"""What compiled code needs of an instance: its functions by address, its variables by number, and room to work in.

It travels through the loop in the place of the parameters, which the instance holds itself. Arrays are few: each is
counted whenever a function is given the handle, which costs more than the calls do.
"""

from __future__ import annotations

from collections.abc import Callable
from ctypes import CFUNCTYPE, c_bool, c_double, c_int, c_size_t, c_void_p
from typing import Any, NamedTuple

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.own_rig.fmu.variables import References, Variables

FAILED, EVENTS = 0, 1  # entries of ``state``: the instance must be reset; it may change abruptly
NEXT, STATES = 0, 2  # entries of ``after``
FAILURE = 3  # a status of FMI
EVENT = CFUNCTYPE(c_int)  # lets the instance settle after a change; 0 if it did


class Handle(NamedTuple):
    """Functions take the instance first and return a status, above 1 where they failed."""

    instance: Any  # address
    set_time: Any
    set_states: Any
    rates: Any
    set_values: Any
    get_values: Any
    completed: Any
    indicators: Any
    step: Any
    event: Any
    driven: Any  # address of the references of ``values``
    read: Any  # address of those of the channels
    seen: Any  # address of those of ``numbers``
    values: Array  # inputs, then what acts at the slots
    numbers: Array  # that the coordinates are made of
    weights: Array  # (3 K, len(numbers)) that make them
    state: Any  # (6,) integers: failed, may change abruptly, and four flags that the instance writes
    after: Array  # s the next change that is known beforehand, s how far a step came, states after a change
    signs: Array  # (2, Z) event indicators before and now


def handle_of(fmu: Any, version: int, variables: Variables, indicators: int, event: Callable[[], int]) -> Handle:
    """Handle of an instance of fmpy's.

    Raises
    ------
    AttributeError
        if the library lacks a function.
    """
    names, types = _functions(version, variables.exchange)
    found = {key: _function(fmu.dll, names.get(key), types[key]) for key in types}
    return Handle(
        instance=np.uint64(_address(fmu.component)),
        **found,
        event=EVENT(event),
        driven=_start(variables.driven),
        read=_start(variables.read),
        seen=_start(variables.seen),
        values=np.zeros(len(variables.driven)),
        numbers=np.zeros(len(variables.seen)),
        weights=np.ascontiguousarray(variables.weights),
        state=np.zeros(6, dtype=np.int64),
        after=np.concatenate([[np.inf, 0.0], np.zeros(len(variables.states))]),
        signs=np.zeros((2, indicators)),
    )


def _address(component: Any) -> int:
    return int(getattr(component, "value", component))


def _start(references: References) -> np.uint64:
    """Where an array begins; the variables keep it."""
    return np.uint64(references.ctypes.data)


def _function(library: Any, name: str | None, types: tuple[Any, ...]) -> Any:
    """A function of the library; one that is never called where the interface has none."""
    prototype = CFUNCTYPE(c_int, c_void_p, *types)
    return prototype((name, library)) if name else prototype(lambda *_: FAILURE)


def _functions(version: int, exchange: bool) -> tuple[dict[str, str], dict[str, tuple[Any, ...]]]:
    """Names and arguments of the functions of a version of FMI."""
    array, truth = (c_void_p, c_size_t), c_int if version == 2 else c_bool
    values = (c_void_p, c_size_t, c_void_p) if version == 2 else (c_void_p, c_size_t, c_void_p, c_size_t)
    step = (c_double, c_double, truth) if version == 2 else (c_double, c_double, truth, *(c_void_p,) * 4)
    types = {"set_time": (c_double,), "set_states": array, "rates": array, "set_values": values, "get_values": values,
             "completed": (truth, c_void_p, c_void_p), "indicators": array, "step": step}  # fmt: skip
    number, rates = ("Real", "Derivatives") if version == 2 else ("Float64", "ContinuousStateDerivatives")
    names = {"set_values": f"Set{number}", "get_values": f"Get{number}"}
    if exchange:
        names |= {"set_time": "SetTime", "set_states": "SetContinuousStates", "rates": f"Get{rates}",
                  "completed": "CompletedIntegratorStep", "indicators": "GetEventIndicators"}  # fmt: skip
    else:
        names |= {"step": "DoStep"}
    return {key: f"fmi{version}{name}" for key, name in names.items()}, types
