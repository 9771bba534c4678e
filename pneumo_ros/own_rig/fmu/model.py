# SPDX-License-Identifier: Apache-2.0
"""model.fmu as the physics of a rig: the same kernel as rig.py's, its equations called by address."""

from __future__ import annotations

import hashlib
import inspect
from dataclasses import replace
from pathlib import Path
from threading import Lock
from types import ModuleType
from typing import Any

import numpy as np

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.errors import InputError
from pneumo_ros.own_rig import loop
from pneumo_ros.own_rig.description import Description, Start
from pneumo_ros.own_rig.fmu import calls, exchange, stepping
from pneumo_ros.own_rig.fmu.instance import MESSAGE, Instance, load
from pneumo_ros.own_rig.kernel import SCALES, VALUES, Kernel, Names, kept_module, returning
from pneumo_ros.own_rig.physics import Physics, check_slots
from pneumo_ros.slots import flow as fl
from pneumo_ros.slots import force as fo

COMPILED = 'compiled = njit(error_model="numpy", nogil=True, cache=True)'


def load_fmu(path: Path, rig: Description) -> tuple[Physics, Description]:
    """Load an FMU as the physics of a rig.

    Returns
    -------
    The physics, and the description with every state of the FMU: one that rig.yaml does not name starts where the FMU
    starts it.

    Raises
    ------
    InputError
        for what cannot be used, in one line.
    """
    if rig.fmu is None:
        raise InputError("the rig file does not say what acts where in an FMU", where=rig.path, key="fmu",
                         allowed="fmu: {names: {...}, slots: {...}}")  # fmt: skip
    slots = (*(one.slot for one in rig.fmu.inside), *rig.fmu.signals)
    check_slots(slots, rig, rig.path, "fmu.slots")
    instance, _ = load(path, rig)
    inside = tuple(one.slot for one in rig.fmu.inside)
    names = Names(instance.variables.states, tuple(rig.inputs), tuple(rig.parameters), tuple(rig.channels),
                  tuple(slot.name for slot in inside))  # fmt: skip
    module = _module(instance)
    nominal = np.array([q.value for q in rig.parameters.values()])
    whole = _started(instance, rig, nominal) if instance.variables.exchange else rig
    runner = _Runner(instance, module, len(names.channels), len(inside))
    mobility = None if instance.variables.exchange else runner.mobility
    kernel = Kernel(runner.run, runner.derivative, runner.coordinates, True, alone=True, mobility=mobility)
    _check(runner, instance, names, nominal)
    return Physics(path, slots, inside, names, kernel), whole


def _started(instance: Instance, rig: Description, nominal: Array) -> Description:
    """The description with the states that only the FMU names, exact where it starts them."""
    instance.begin(nominal, np.zeros(len(instance.variables.states)), np.zeros(len(rig.inputs)))
    starts = {name: rig.states.get(name, Start(value=float(v))) for name, v in
              zip(instance.variables.states, instance.started(), strict=True)}  # fmt: skip
    return replace(rig, states=starts)


def _check(runner: _Runner, instance: Instance, names: Names, nominal: Array) -> None:
    """Two rows at rest; what fails there fails always."""
    slots = len(names.slots)
    x, u = np.zeros(len(names.states)), np.zeros((2, len(names.inputs)))
    runner.run(x, u, np.zeros(len(names.inputs), bool), 1e-3, 1, nominal, np.zeros(slots, np.int64),
               np.zeros(slots, bool), np.zeros((slots, VALUES)), np.ones((slots, SCALES)), 0.0)  # fmt: skip
    if instance.handle.state[0]:
        said = instance.said[-1][:MESSAGE] if instance.said else None
        raise InputError("the FMU fails in its first step", where=instance.path, value=said,
                         remedy="check the parameters of the rig file, and that it runs elsewhere")  # fmt: skip


def _module(instance: Instance) -> ModuleType:
    """Loop and calls as one file of the cache, named by all that they are made of."""
    rooms = (exchange, loop) if instance.variables.exchange else (stepping,)
    sources = [inspect.getsource(one) for one in rooms]
    made_of = hashlib.sha256("".join([*sources, *(inspect.getsource(one) for one in (calls, fo, fl))]).encode())
    lines = ["from __future__ import annotations", "from numba import njit", f"# made of {made_of.hexdigest()}",
             COMPILED]  # fmt: skip
    lines += [line for source in sources for line in source.splitlines()
              if not line.startswith(("from __future__", "from pneumo_ros.own_rig.bridge"))]  # fmt: skip
    text = "\n".join(lines) + "\n"
    if instance.version == 3:
        for call in ("set", "get", "step"):
            text = text.replace(f"import {call}2", f"import {call}3")
    return kept_module("own_fmu", text)


class _Runner:
    """Runs of one instance, one at a time."""

    def __init__(self, instance: Instance, module: ModuleType, channels: int, slots: int) -> None:
        self.instance, self.module, self.slots, self.lock = instance, module, slots, Lock()
        self._run = returning(module.run, channels)
        self._set: Array | None = None  # parameters that the instance has, outside a run

    def run(
        self, x0: Array, u: Array, held: Mask, period: float, substeps: int, p: Array, terms: Any, on: Any, P: Array,
        S: Array, since: float,
    ) -> tuple[Array, Array, Array]:  # fmt: skip
        """As :attr:`pneumo_ros.own_rig.kernel.Kernel.run`, from a fresh start of the instance."""
        x0 = np.ascontiguousarray(x0, dtype=float)
        with self.lock:
            self._set = None
            handle = self.instance.begin(p, x0, u[0])
            if self.instance.variables.exchange:
                u, held = np.column_stack([u, period * np.arange(len(u))]), np.append(held, False)
            return self._run(x0, np.ascontiguousarray(u), held, period, substeps, handle, terms, on, P, S, since)

    def derivative(self, x: Array, u: Array, p: Array, f: Array, out: Array) -> None:
        """Rates of the states; 0 of a co-simulation, which keeps its own."""
        out[:] = 0.0
        if self.instance.variables.exchange:
            with self.lock:
                self.module.derivative(x, np.append(u, 0.0), self._at(p, x, u), f, out)

    def coordinates(self, x: Array, u: Array, p: Array, out: Array) -> None:
        """Coordinates of the slots."""
        with self.lock:
            self.module.coordinates(x, np.append(u, 0.0), self._at(p, x, u), out)

    def _at(self, p: Array, x: Array, u: Array) -> Any:
        """The handle, its instance begun with these parameters."""
        if self._set is None or self.instance.handle.state[0] or not np.array_equal(self._set, p):
            self.instance.begin(p, x, u)
            self._set = p.copy()
        return self.instance.handle

    def mobility(self, k: int, x0: Array, u: Array, held: Mask, period: float, p: Array) -> float:
        """Change of a slot's rate in a second for a unit of its force, over the first step."""
        on, P = np.zeros(self.slots, bool), np.zeros((self.slots, VALUES))
        rates = []
        for size in (0.0, 1.0):
            on[k], P[k, fo.STEADY], P[k, fo.ATOMS_AT_WORK] = size > 0.0, size, size
            terms, S = np.zeros(self.slots, np.int64), np.ones((self.slots, SCALES))
            rates.append(float(self.run(x0, u[:2], held, period, 1, p, terms, on, P, S, 0.0)[1][1, k, 1]))
        return (rates[1] - rates[0]) / period
