# SPDX-License-Identifier: Apache-2.0
"""rig.py: the user's right-hand side, outputs and slots, loaded and checked before anything is run."""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
from numba import njit

from pneumo_ros.errors import InputError, not_one_of
from pneumo_ros.own_rig.description import Description, usable_name
from pneumo_ros.own_rig.kernel import Kernel, Names, build, tried
from pneumo_ros.own_rig.quantities import UNITS
from pneumo_ros.slots.kinds import IN_EQUATIONS, Flow, Force, Slot, zero
from pneumo_ros.slots.library import families_of

ARGUMENTS = 4  # x, u, p, f
COORDINATE = 3  # x, u, p


@dataclass(frozen=True)
class Physics:
    """A user's model.

    Attributes
    ----------
    path : of rig.py
    slots : as they were listed
    inside : those that act inside the equations, in the kernel's order
    names : what the functions call things
    kernel : the free run
    """

    path: Path
    slots: tuple[Slot, ...]
    inside: tuple[Slot, ...]
    names: Names
    kernel: Kernel


def load_physics(path: Path, rig: Description) -> Physics:
    """Load rig.py.

    Raises
    ------
    InputError
        if it cannot be run, or its functions and slots do not fit the rig file.
    """
    module = _module(path)
    outputs = _function(module, path, "outputs", ARGUMENTS)
    rhs = _function(module, path, "rhs", ARGUMENTS) if rig.states or hasattr(module, "rhs") else None
    if rhs is not None and not rig.states:
        raise InputError("rhs without states", where=rig.path, key="states", remedy="name them: states: {x: floor}")
    slots = _slots(module, path, rig)
    inside = tuple(slot for slot in slots if slot.kind in IN_EQUATIONS)
    names = Names(tuple(rig.states), tuple(rig.inputs), tuple(rig.parameters), tuple(rig.channels),
                  tuple(slot.name for slot in inside))  # fmt: skip
    helpers = {k: v for k, v in vars(module).items() if isinstance(v, FunctionType) and v.__module__ == module.__name__}
    _compile_helpers(module, helpers, {"rhs", "outputs"})
    try:
        kernel = build(names, rhs, outputs, [slot.coordinates for slot in inside], path.read_text("utf-8"))
        if not kernel.compiled:
            vars(module).update(helpers)
            with warnings.catch_warnings():
                warnings.simplefilter("error", np.exceptions.ComplexWarning)
                tried(kernel, names, len(inside))
    except Exception as error:  # whatever the user's code raises is theirs to read, in one line
        raise InputError(f"the model fails: {type(error).__name__}: {_first(error)}", where=path,
                         remedy="check names, and that rhs and outputs return as many values as there are states and "
                         "channels") from error  # fmt: skip
    return Physics(path, slots, inside, names, kernel)


def _module(path: Path) -> ModuleType:
    if not path.is_file():
        raise InputError("no such file", where=path, key="--rig-model", remedy="check the name")
    # By content: what numba keeps of its functions names the module they came from.
    name = f"rig_model_{hashlib.sha256(path.read_bytes()).hexdigest()[:20]}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError("not a Python file", where=path, key="--rig-model", allowed="rig.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    kept, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # sys.exit() would end a diagnosis that has not begun, with any code
        raise InputError(f"the file fails: {type(error).__name__}: {_first(error)}", where=path,
                         remedy="python rig.py shows where") from error  # fmt: skip
    finally:
        sys.dont_write_bytecode = kept
    return module


def _first(error: BaseException) -> str:
    return next(iter(str(error).splitlines()), "") or "no reason given"


def _function(module: ModuleType, path: Path, name: str, arguments: int) -> Callable[..., Any]:
    found = getattr(module, name, None)
    if not callable(found):
        raise InputError(f"no function {name}", where=path, key=name, remedy=f"def {name}(x, u, p, f): ...")
    function = getattr(found, "py_func", found)
    count = len(inspect.signature(function).parameters)
    if count != arguments:
        raise InputError(f"{name} takes another number of arguments", where=path, key=name, value=count,
                         allowed="x, u, p, f: state, inputs, parameters, what acts at the slots")  # fmt: skip
    return function


def _slots(module: ModuleType, path: Path, rig: Description) -> tuple[Slot, ...]:
    slots = getattr(module, "SLOTS", None)
    if not isinstance(slots, (list, tuple)) or not slots or not all(isinstance(one, Slot) for one in slots):
        raise InputError("no slots", where=path, key="SLOTS",
                         allowed="a list of Force, Contact, Flow, Input, Sensor")  # fmt: skip
    check_slots(slots, rig, path, "SLOTS")
    for one in slots:
        _check_coordinates(one, path, "SLOTS")
    return tuple(slots)


def check_slots(slots: Sequence[Slot], rig: Description, path: Path, key: str) -> None:
    """Names apart and usable, signals that the rig file has, a gas under a pressure, families that fit.

    Raises
    ------
    InputError
        naming the entry.
    """
    places = [one.place for one in slots]
    for one in slots:
        if places.count(one.place) > 1:
            raise InputError("two slots of one name", where=path, key=key, value=one.name, remedy="name them apart")
        if not isinstance(one.name, str) or not usable_name(one.name):
            raise InputError("not a name that Python can use", where=path, key=key, value=one.name,
                             allowed="letters, digits and _")  # fmt: skip
        known = rig.channels if one.kind == "sensor" else rig.inputs
        if one.kind in ("input", "sensor") and one.name not in known:
            raise not_one_of(f"no such {one.kind}", one.name, known, where=path, key=key)
        # Of a unit that is not listed nothing is known; a ratio of pressures has none.
        if isinstance(one, Flow) and one.gas and UNITS.get(one.pressure_unit, UNITS["Pa"])[2] not in ("Pa", "1"):
            raise InputError("a gas that flows without a pressure", where=path, key=f"{key}.{one.name}.pressure_unit",
                             value=one.pressure_unit, allowed="a unit of pressure",
                             remedy="gas=False, where no gas flows (a liquid by its level, heat)")  # fmt: skip
    _check_families(rig, slots)


def _check_coordinates(one: Slot, path: Path, key: str) -> None:
    for function in one.coordinates:
        count = len(inspect.signature(function).parameters) if callable(function) else None
        if count != COORDINATE:
            raise InputError("a coordinate is no function of x, u, p", where=path, key=key, value=one.name,
                             allowed="travel=lambda x, u, p: x.position")  # fmt: skip
    if isinstance(one, Force) and one.rate is zero and one.travel is zero:
        raise InputError("a force without rate and travel", where=path, key=key, value=one.name,
                         allowed="rate=lambda x, u, p: x.speed, travel=lambda x, u, p: x.position")  # fmt: skip


def _check_families(rig: Description, slots: Sequence[Slot]) -> None:
    kinds = {one.place: one.kind for one in slots}
    for place, families in rig.families.items():
        if place not in kinds:
            raise not_one_of("no such slot", place, kinds, where=rig.path, key="families")
        for family in families:
            if family not in families_of(kinds[place]):
                raise not_one_of("no such family at this kind of slot", family, families_of(kinds[place]),
                                 where=rig.path, key=f"families.{place}")  # fmt: skip


def _compile_helpers(module: ModuleType, helpers: dict[str, FunctionType], own: set[str]) -> None:
    """Functions of rig.py that its functions call are compiled as well."""
    for name, function in helpers.items():
        if name not in own:
            setattr(module, name, njit(error_model="numpy")(function))
