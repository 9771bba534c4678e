# SPDX-License-Identifier: Apache-2.0
"""The free run of a user's model, compiled where it can be: :mod:`pneumo_ros.own_rig.loop` around a generated bridge.

The user's functions take named tuples; a few generated lines stand between them and the arrays of the loop. Bridge and
loop are one file of the user's cache, named by the hash of all that they are made of, so that numba compiles a rig
once. Where it cannot compile it, the same loop runs as plain Python, a hundred times slower.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import inspect
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numba import njit
from numba.core.errors import NumbaError

from pneumo_ros import laws
from pneumo_ros.arrays import Array
from pneumo_ros.effects.cache import kept
from pneumo_ros.own_rig import loop
from pneumo_ros.slots import flow as fl
from pneumo_ros.slots import force as fo

FORCE, FLOW = 0, 1  # how a slot's term is evaluated
VALUES = max(fo.VALUES, fl.VALUES)
SCALES = max(fo.SCALES, fl.SCALES)
# A rig.py that imports nothing else is all that its functions depend on: what numba made of it may be kept.
SELF_CONTAINED = ("__future__", "collections", "dataclasses", "math", "numba", "numpy", "pneumo_ros", "typing")
READING = ("open", "load", "loadtxt", "genfromtxt", "fromfile", "exec", "eval", "__import__")


@dataclass(frozen=True)
class Names:
    """What the user's functions call things, in order."""

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    channels: tuple[str, ...]
    slots: tuple[str, ...]


@dataclass(frozen=True)
class Kernel:
    """The loop around a user's functions.

    Attributes
    ----------
    run : :func:`pneumo_ros.own_rig.loop.run`, which returns its arrays, see :func:`returning`
    derivative, coordinates : the user's own, of arrays, written into their last argument
    compiled : whether numba compiled it
    why_not : numba's first line where it did not
    alone : whether one run must end before the next begins
    mobility : (slot, state, inputs, held, period, parameters) -> change of its rate in a second for a unit of its
        force, of a model that has no derivative
    """

    run: Callable[..., tuple[Array, Array, Array]]
    derivative: Callable[..., None]
    coordinates: Callable[..., None]
    compiled: bool
    why_not: str = ""
    alone: bool = False
    mobility: Callable[..., float] | None = None


def build(
    names: Names,
    rhs: Callable[..., Any] | None,
    outputs: Callable[..., Any],
    coordinates: Sequence[Sequence[Callable[..., Any]]],
    source: str,
) -> Kernel:
    """The kernel of a model.

    Parameters
    ----------
    rhs : None for a model without states
    coordinates : of each slot that acts inside the equations
    source : of rig.py, all that the functions depend on
    """
    own = {"rhs": rhs, "outputs": outputs}
    own |= {f"c{k}_{j}": one for k, row in enumerate(coordinates) for j, one in enumerate(row)}
    shape = [len(row) for row in coordinates]
    try:
        module = _module(names, own, shape, source, compiled=True)
        run = returning(module.run, len(names.channels))
        kernel = Kernel(run, module.derivative, module.coordinates, True)
        tried(kernel, names, len(shape))
        return kernel
    except NumbaError as error:
        reason = next((line.strip() for line in str(error).splitlines() if line.strip()), "no reason given")
        module = _module(names, own, shape, source, compiled=False)
        run = returning(module.run, len(names.channels))
        return Kernel(run, module.derivative, module.coordinates, False, reason)


def returning(run: Callable[..., None], channels: int) -> Callable[..., tuple[Array, Array, Array]]:
    """A run into arrays as one that returns them: channels (N, C), NaN after a divergence, coordinates (N, K, 3) and
    what acts (N, K).

    Compiled code does not return them: Ctrl-C that came meanwhile is raised while numba makes Python's objects of
    several arrays, and it goes on with one that is not there.
    """

    def returned(
        x0: Array, u: Array, held: Any, period: float, substeps: int, p: Any, terms: Any, *others: Any
    ) -> tuple[Array, Array, Array]:
        rows, slots = len(u), len(terms)
        out, where, acted = np.full((rows, channels), np.nan), np.zeros((rows, slots, 3)), np.zeros((rows, slots))
        run(x0, u, held, period, substeps, p, terms, *others, out, where, acted)
        return out, where, acted

    return returned


def tried(kernel: Kernel, names: Names, slots: int) -> tuple[Array, Array, Array]:
    """Two rows at ones: compiles, and raises what the user's functions raise."""
    x, u, p = np.ones(len(names.states)), np.ones((2, len(names.inputs))), np.ones(len(names.parameters))
    held, terms, on = (np.zeros(len(names.inputs), bool), np.zeros(slots, np.int64), np.zeros(slots, bool))
    return kernel.run(x, u, held, 1e-3, 1, p, terms, on, np.zeros((slots, VALUES)), np.ones((slots, SCALES)), 0.0)


def _module(names: Names, own: dict[str, Any], shape: Sequence[int], source: str, compiled: bool) -> ModuleType:
    """The generated module with the user's functions put where it calls them."""
    text = _text(names, own["rhs"] is not None, shape, compiled and self_contained(source), compiled, source)
    module = kept_module("own_rig", text)
    for key, function in own.items():
        plain = getattr(function, "py_func", function)
        setattr(module, key, njit(error_model="numpy")(plain) if compiled and function is not None else plain)
    return module


def kept_module(prefix: str, text: str) -> ModuleType:
    """A module of generated text, in the user's cache under a name that holds its hash."""
    name = f"{prefix}_{hashlib.sha256(text.encode()).hexdigest()[:20]}"
    path = kept(f"{name}.py", text.encode())
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = sys.modules[name] = importlib.util.module_from_spec(spec)  # numba finds what it kept by this name
    spec.loader.exec_module(module)
    return module


def self_contained(source: str) -> bool:
    """Whether a source depends on nothing that could change without its text."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import) and any(a.name.partition(".")[0] not in SELF_CONTAINED for a in node.names):
            return False
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] not in SELF_CONTAINED:
            return False
        if isinstance(node, (ast.Name, ast.Attribute)) and getattr(node, "id", getattr(node, "attr", "")) in READING:
            return False
    return True


def _text(names: Names, states: bool, shape: Sequence[int], cached: bool, compiled: bool, source: str) -> str:
    kernels = (Path(file).read_text(encoding="utf-8") for file in laws.sources())
    made_of = "".join([source, *(inspect.getsource(one) for one in (fo, fl)), *kernels])
    kinds = {"State": names.states, "Inputs": names.inputs, "Parameters": names.parameters, "Acting": names.slots}
    x, u, p, f = (_packed(kind, fields, arg) for (kind, fields), arg in zip(kinds.items(), "xupf", strict=True))
    lines = ["from __future__ import annotations", "from collections import namedtuple", "from numba import njit"]
    lines += [f"# made of {hashlib.sha256(made_of.encode()).hexdigest()}"]
    lines += [f"{kind} = namedtuple({kind!r}, {list(fields)!r})" for kind, fields in kinds.items()]
    lines += [
        f'compiled = njit(error_model="numpy", nogil=True, cache={cached})' if compiled else "compiled = lambda f: f"
    ]
    lines += ["@compiled", "def derivative(x, u, p, f, out):"]
    lines += _assigned(f"rhs({x}, {u}, {p}, {f})", len(names.states)) if states else [" pass"]
    lines += ["@compiled", "def reading(x, u, p, f, out):"]
    lines += _assigned(f"outputs({x}, {u}, {p}, {f})", len(names.channels))
    lines += ["@compiled", "def settle(x, u, p):", " pass"]
    lines += ["@compiled", "def coordinates(x, u, p, out):", f" x = {x}", f" u = {u}", f" p = {p}"]
    lines += [f" out[{k}, {j}] = c{k}_{j}(x, u, p)" for k, count in enumerate(shape) for j in range(count)]
    body = [line for line in inspect.getsource(loop).splitlines()
            if not line.startswith(("from __future__", "from pneumo_ros.own_rig.bridge"))]  # fmt: skip
    return "\n".join([*lines, *body]) + "\n"


def _packed(kind: str, fields: Sequence[str], array: str) -> str:
    return f"{kind}({', '.join(f'{array}[{k}]' for k in range(len(fields)))})"


def _assigned(call: str, count: int) -> list[str]:
    """Exactly as many values as there are names for them."""
    targets = ", ".join(f"r{k}" for k in range(count))
    return [f" ({targets},) = {call}", *(f" out[{k}] = r{k}" for k in range(count))]
