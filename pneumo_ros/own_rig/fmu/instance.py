# SPDX-License-Identifier: Apache-2.0
"""One instance of an FMU, loaded by fmpy, reused for every run and reset before each."""

from __future__ import annotations

import os
import re
import weakref
from collections.abc import Callable
from contextlib import suppress
from ctypes import POINTER, byref, c_double
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.errors import InputError
from pneumo_ros.own_rig.description import Description
from pneumo_ros.own_rig.fmu.archive import DESCRIPTION, unpack
from pneumo_ros.own_rig.fmu.handle import EVENTS, FAILED, NEXT, STATES, Handle, handle_of
from pneumo_ros.own_rig.fmu.variables import Variables, matched

ROUNDS = 100  # of settling after a change
VERSION = re.compile(rb"""fmiVersion\s*=\s*["']([^"']*)""")
MESSAGE = 80  # characters of what an FMU says that an error repeats


def library() -> Any:
    """fmpy.

    Raises
    ------
    InputError
        if it is not installed.
    """
    try:
        import fmpy
    except ImportError as error:
        raise InputError("an FMU needs fmpy", key="--rig-model", remedy="pip install 'pneumo_ros[fmu]'") from error
    return fmpy


@dataclass(eq=False)
class Instance:
    """The instance and what it is told before a run.

    Attributes
    ----------
    fmu : fmpy's model or slave
    version : of FMI, 2 or 3
    said : messages of the FMU
    needs_completed : whether it must be told of every step
    used : whether it must be reset before it begins
    """

    path: Path
    fmu: Any
    version: int
    variables: Variables
    said: list[str]
    needs_completed: bool = True
    used: bool = False
    handle: Handle = None  # type: ignore[assignment]

    def begin(self, parameters: Array, x: Array, u: Array) -> Handle:
        """Reset, set and initialise; a failure is in the handle's state, and a run that begins with it is NaN.

        Parameters
        ----------
        x : states of the first row
        u : inputs of the first row, without the time
        """
        handle = self.handle
        handle.state[:], handle.after[NEXT] = 0, np.inf
        handle.values[:] = 0.0
        handle.values[: len(u)] = u
        try:
            self._initialised(parameters, x)
            if self.variables.exchange:
                self._exchanged(x)
        except Exception:  # fmpy raises what a status above 1 means; the next run resets
            handle.state[FAILED] = 1
        return handle

    def _initialised(self, parameters: Array, x: Array) -> None:
        if self.used:
            self.fmu.reset()
        self.used = True
        if self.version == 2:
            self.fmu.setupExperiment(startTime=0.0)
        self._set(self.variables.parameters, parameters)
        if not self.variables.exchange:
            self._set(self.variables.starts, x)
        self.fmu.enterInitializationMode()
        self._set(self.variables.driven, self.handle.values)
        self.fmu.exitInitializationMode()

    def _exchanged(self, x: Array) -> None:
        """From the events of the initialisation to continuous time, at the states of the first row."""
        self._settled()
        if self.needs_completed or self.handle.signs.size or self.handle.after[NEXT] < np.inf:
            self.fmu.setTime(0.0)
            self._states(self.fmu.setContinuousStates, x)
            self.fmu.enterEventMode()
            self._settled()
            self.handle.state[EVENTS] = 1

    def event(self) -> int:
        """Settle after a change: 0 if the instance did."""
        try:
            self.fmu.enterEventMode()
            self._settled()
        except Exception:  # it is called from compiled code, which has no other way to know
            return 1
        return 0

    def _settled(self) -> None:
        """Discrete states until none changes; then continuous time, its states and indicators as they are there."""
        again = self.fmu.newDiscreteStates if self.version == 2 else self.fmu.updateDiscreteStates
        for _ in range(ROUNDS):
            more, ended, _, _, planned, when = again()
            if ended:
                raise RuntimeError("the FMU ends the run")
            if not more:
                break
        self.handle.after[NEXT] = when if planned else np.inf
        self.fmu.enterContinuousTimeMode()
        if len(self.handle.after) > STATES:
            self._states(self.fmu.getContinuousStates, self.handle.after[STATES:])
        if self.handle.signs.size:
            self._states(self.fmu.getEventIndicators, self.handle.signs[0])

    def started(self) -> Array:
        """States as the FMU starts them, after :meth:`begin`."""
        return self.handle.after[STATES:].copy()

    def _states(self, call: Callable[..., object], values: Array) -> None:
        values = np.ascontiguousarray(values)
        call(values.ctypes.data_as(POINTER(c_double)), len(values))

    def _set(self, references: Any, values: Array) -> None:
        if len(references):
            put = self.fmu.setReal if self.version == 2 else self.fmu.setFloat64
            put([int(r) for r in references], [float(v) for v in values])


def load(path: Path, rig: Description) -> tuple[Instance, Any]:
    """Load an FMU and match the names of a rig file.

    Returns
    -------
    The instance, and fmpy's model description.

    Raises
    ------
    InputError
        for what cannot be used, in one line.
    """
    fmpy = library()
    folder = TemporaryDirectory(prefix="pneumo_fmu_")
    unpack(path, Path(folder.name), (fmpy.platform, fmpy.platform_tuple))
    model = _described(fmpy, path, Path(folder.name))
    variables = matched(model, rig, path)
    said: list[str] = []
    fmu, version = _loaded(path, Path(folder.name), model, variables.exchange, said), int(model.fmiVersion[0])
    instance = Instance(path, fmu, version, variables, said)
    if variables.exchange:
        instance.needs_completed = _needs_completed(model, version)
    try:
        indicators = _indicators(fmu, model, version) if variables.exchange else 0
        instance.handle = handle_of(fmu, version, variables, indicators, instance.event)
    except AttributeError as error:
        raise InputError("the FMU's library lacks a function", where=path, value=str(error)[-MESSAGE:],
                         remedy="export it again") from error  # fmt: skip
    weakref.finalize(instance, _freed, fmu, folder)
    return instance, model


def _described(fmpy: Any, path: Path, folder: Path) -> Any:
    version = VERSION.search((folder / DESCRIPTION).read_bytes())
    if version is not None and version[1][:2] not in (b"2.", b"3."):
        raise InputError("a version of FMI that is not supported", where=path, value=_text(version[1]),
                         allowed="2.0, 3.0", remedy="export it as one of those")  # fmt: skip
    try:
        return fmpy.read_model_description(str(folder), validate=False)
    except Exception as error:  # whatever a broken description makes fmpy and lxml raise
        raise InputError("modelDescription.xml cannot be read", where=path, value=_first(error),
                         remedy="export it again as FMI 2 or 3") from error  # fmt: skip


def _first(error: BaseException) -> str:
    return next(iter(str(error).splitlines()), "")[:MESSAGE]


def _loaded(path: Path, folder: Path, model: Any, exchange: bool, said: list[str]) -> Any:
    """The library of this platform, with an instance in it."""
    from fmpy import fmi2, fmi3

    version, interface = int(model.fmiVersion[0]), model.modelExchange if exchange else model.coSimulation
    kinds = {
        (2, True): fmi2.FMU2Model,
        (2, False): fmi2.FMU2Slave,
        (3, True): fmi3.FMU3Model,
        (3, False): fmi3.FMU3Slave,
    }
    asked = {"guid": model.guid, "unzipDirectory": str(folder), "modelIdentifier": interface.modelIdentifier,
             "requireFunctions": False}  # fmt: skip
    has = sorted(one.name for one in (folder / "binaries").glob("*")) if (folder / "binaries").is_dir() else []
    if not has:
        raise InputError("the FMU has no binary for this platform", where=path, value=library().platform_tuple,
                         remedy="export it for this platform, or with its sources and build them")  # fmt: skip
    here = Path.cwd()  # fmpy goes to the library, and stays there when it cannot load it
    try:
        fmu = kinds[version, exchange](**asked)
        fmu.instantiate(**_told(version, said))
    except Exception as error:  # fmpy raises bare exceptions
        told = said[-1] if said else _first(error)
        raise InputError("the FMU cannot be loaded", where=path, value=told[:MESSAGE],
                         remedy="export it for this platform") from error  # fmt: skip
    finally:
        os.chdir(here)
    return fmu


def _told(version: int, said: list[str]) -> dict[str, Any]:
    """Where the FMU's messages go: none to the terminal."""
    from fmpy import calloc, fmi2, free

    if version == 3:
        return {"logMessage": lambda environment, status, category, message: said.append(_text(message))}
    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(
        lambda environment, name, status, category, message: said.append(_text(message))
    )
    callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(calloc)
    callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(free)
    with suppress(Exception):  # it writes the numbers into the message's format; without it the format is kept
        from fmpy.logging import addLoggerProxy

        addLoggerProxy(byref(callbacks))
    return {"callbacks": callbacks}


def _text(message: bytes | None) -> str:
    return (message or b"").decode("utf-8", "replace")


def _needs_completed(model: Any, version: int) -> bool:
    if version == 2:
        return not model.modelExchange.completedIntegratorStepNotNeeded
    return bool(model.modelExchange.needsCompletedIntegratorStep)


def _indicators(fmu: Any, model: Any, version: int) -> int:
    return int(model.numberOfEventIndicators) if version == 2 else int(fmu.getNumberOfEventIndicators())


def _freed(fmu: Any, folder: TemporaryDirectory[str]) -> None:
    with suppress(Exception):
        fmu.freeInstance()
    folder.cleanup()
