# SPDX-License-Identifier: Apache-2.0
"""The free run of a user's model with what acts at its slots: RK4 with fixed sub-steps, compiled where it can be.

The user's functions take named tuples; a few generated lines stand between them and the arrays of the loop. Where
numba cannot compile them the same loop runs as plain Python, a hundred times slower.
"""

from __future__ import annotations

import linecache
from collections import namedtuple
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numba.core.errors import NumbaError

from pneumo_ros.arrays import Array
from pneumo_ros.slots import flow as fl
from pneumo_ros.slots import force as fo

FORCE, FLOW = 0, 1  # how a slot's term is evaluated
LARGEST = 1e100  # of a state: beyond it a run has diverged
MEMORIES = max(fo.MEMORIES, fl.MEMORIES)
VALUES = max(fo.VALUES, fl.VALUES)
SCALES = max(fo.SCALES, fl.SCALES)


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
    run : (x0, u, held, period, substeps, p, terms, on, P, S, since) -> channels (N, C), coordinates (N, K, 3), what
        acts (N, K); NaN after a divergence
    derivative, coordinates : the user's own, of arrays, written into their last argument
    compiled : whether numba compiled it
    why_not : numba's first line where it did not
    """

    run: Callable[..., tuple[Array, Array, Array]]
    derivative: Callable[..., None]
    coordinates: Callable[..., None]
    compiled: bool
    why_not: str = ""


def build(
    names: Names,
    rhs: Callable[..., Any] | None,
    outputs: Callable[..., Any],
    coordinates: Sequence[Sequence[Callable[..., Any]]],
    jit: bool = True,
) -> Kernel:
    """The kernel of a model.

    Parameters
    ----------
    rhs : None for a model without states
    coordinates : of each slot that acts inside the equations
    jit : try numba
    """
    compiler: Callable[[Any], Any] = njit(error_model="numpy") if jit else (lambda f: f)
    bridge = _bridge(names, rhs, outputs, coordinates, compiler)
    kernel = Kernel(_loop(bridge, len(names.channels), compiler), bridge[0], bridge[2], jit)
    if not jit:
        return kernel
    try:
        tried(kernel, names, len(coordinates))
    except NumbaError as error:
        reason = next((line.strip() for line in str(error).splitlines() if line.strip()), "no reason given")
        plain = build(names, _plain(rhs), _plain(outputs), [[_plain(c) for c in row] for row in coordinates], False)
        return Kernel(plain.run, plain.derivative, plain.coordinates, False, reason)
    return kernel


def tried(kernel: Kernel, names: Names, slots: int) -> tuple[Array, Array, Array]:
    """Two rows at ones: compiles, and raises what the user's functions raise."""
    x, u, p = np.ones(len(names.states)), np.ones((2, len(names.inputs))), np.ones(len(names.parameters))
    held, terms, on = (np.zeros(len(names.inputs), bool), np.zeros(slots, np.int64), np.zeros(slots, bool))
    return kernel.run(x, u, held, 1e-3, 1, p, terms, on, np.zeros((slots, VALUES)), np.ones((slots, SCALES)), 0.0)


def _plain(function: Any) -> Any:
    return getattr(function, "py_func", function)


def _bridge(
    names: Names, rhs: Any, outputs: Any, coordinates: Sequence[Sequence[Any]], compiler: Callable[[Any], Any]
) -> tuple[Any, Any, Any]:
    """derivative, reading and coordinates of arrays, around the user's functions of named tuples."""
    kinds = {"State": names.states, "Inputs": names.inputs, "Parameters": names.parameters, "Acting": names.slots}
    space: dict[str, Any] = {kind: namedtuple(kind, fields) for kind, fields in kinds.items()}
    space |= {"rhs": rhs and compiler(_plain(rhs)), "outputs": compiler(_plain(outputs))}
    x, u, p = (_packed(kind, kinds[kind], arg) for kind, arg in (("State", "x"), ("Inputs", "u"), ("Parameters", "p")))
    f = _packed("Acting", names.slots, "f")
    lines = ["def derivative(x, u, p, f, out):"]
    lines += _assigned(f"rhs({x}, {u}, {p}, {f})", len(names.states)) if rhs else [" pass"]
    lines += ["def reading(x, u, p, f, out):", *_assigned(f"outputs({x}, {u}, {p}, {f})", len(names.channels))]
    lines += ["def coordinates(x, u, p, out):", f" x = {x}", f" u = {u}", f" p = {p}"]
    for k, row in enumerate(coordinates):
        for j, one in enumerate(row):
            space[f"c{k}_{j}"] = compiler(_plain(one))
            lines.append(f" out[{k}, {j}] = c{k}_{j}(x, u, p)")
    source, name = "\n".join(lines) + "\n", f"<bridge of {id(space):x}>"
    linecache.cache[name] = (len(source), None, source.splitlines(True), name)  # for readable errors
    exec(compile(source, name, "exec"), space)  # generated above from checked identifiers
    return tuple(compiler(space[one]) for one in ("derivative", "reading", "coordinates"))


def _packed(kind: str, fields: Sequence[str], array: str) -> str:
    return f"{kind}({', '.join(f'{array}[{k}]' for k in range(len(fields)))})"


def _assigned(call: str, count: int) -> list[str]:
    return [f" r = {call}", *(f" out[{k}] = r[{k}]" for k in range(count)), " return None"]


def _loop(bridge: tuple[Any, Any, Any], channels: int, compiler: Callable[[Any], Any]) -> Any:
    """The free run, closed over the user's functions."""
    derivative, reading, coordinates = bridge
    start_force, advance_force, force = fo.start, fo.advance, fo.force
    start_flow, advance_flow, flow = fl.start, fl.advance, fl.flow
    memories = MEMORIES

    def begin(
        x: Array, u: Array, p: Array, terms: Any, on: Any, P: Array, S: Array, since: float, c: Array, z: Array
    ) -> None:
        coordinates(x, u, p, c)
        for s in range(len(terms)):
            if on[s]:
                if terms[s] == 0:
                    start_force(c[s], z[s], S[s])
                else:
                    start_flow(c[s], z[s], since, P[s], S[s])

    def advance(
        x: Array, u: Array, p: Array, terms: Any, on: Any, P: Array, S: Array, h: float, c: Array, z: Array
    ) -> None:
        coordinates(x, u, p, c)
        for s in range(len(terms)):
            if on[s]:
                if terms[s] == 0:
                    advance_force(c[s], z[s], h, P[s], S[s])
                else:
                    advance_flow(c[s], z[s], h, P[s], S[s])

    def act(
        x: Array, u: Array, p: Array, terms: Any, on: Any, P: Array, S: Array, c: Array, z: Array, f: Array
    ) -> None:
        coordinates(x, u, p, c)
        for s in range(len(terms)):
            f[s] = 0.0
            if on[s]:
                if terms[s] == 0:
                    f[s] = force(c[s], z[s], P[s], S[s])
                else:
                    f[s] = flow(c[s], z[s], P[s], S[s])

    begin, advance, act = compiler(begin), compiler(advance), compiler(act)

    def slope(x: Array, u: Array, p: Array, terms: Any, on: Any, P: Array, S: Array, c: Array, z: Array, f: Array,
              out: Array) -> None:  # fmt: skip
        act(x, u, p, terms, on, P, S, c, z, f)
        derivative(x, u, p, f, out)

    slope = compiler(slope)

    def moved(x: Array, k: Array, h: float, out: Array) -> None:
        for j in range(len(x)):
            out[j] = x[j] + h * k[j]

    moved = compiler(moved)

    def step(x: Array, ends: Array, h: float, p: Array, terms: Any, on: Any, P: Array, S: Array, c: Array, z: Array, f: Array,
             K: Array, trial: Array) -> None:  # fmt: skip
        slope(x, ends[0], p, terms, on, P, S, c, z, f, K[0])
        moved(x, K[0], 0.5 * h, trial)
        slope(trial, ends[1], p, terms, on, P, S, c, z, f, K[1])
        moved(x, K[1], 0.5 * h, trial)
        slope(trial, ends[1], p, terms, on, P, S, c, z, f, K[2])
        moved(x, K[2], h, trial)
        slope(trial, ends[2], p, terms, on, P, S, c, z, f, K[3])
        for j in range(len(x)):
            x[j] += h / 6.0 * (K[0, j] + 2.0 * (K[1, j] + K[2, j]) + K[3, j])

    def between(u: Array, held: Any, i: int, substep: int, substeps: int, ends: Array) -> None:
        for j in range(len(held)):
            rise = 0.0 if held[j] else (u[i + 1, j] - u[i, j]) / substeps
            ends[0, j] = u[i, j] + rise * substep
            ends[1, j] = ends[0, j] + 0.5 * rise
            ends[2, j] = ends[0, j] + rise

    def finite(x: Array) -> bool:
        for j in range(len(x)):
            if not abs(x[j]) < LARGEST:
                return False
        return True

    step, between, finite = compiler(step), compiler(between), compiler(finite)

    def run(
        x0: Array, u: Array, held: Any, period: float, substeps: int, p: Array, terms: Any, on: Any, P: Array, S: Array,
        since: float,
    ) -> tuple[Array, Array, Array]:  # fmt: skip
        rows, slots = len(u), len(terms)
        out, where, acted = np.full((rows, channels), np.nan), np.zeros((rows, slots, 3)), np.zeros((rows, slots))
        c, z, f = np.zeros((slots, 3)), np.zeros((slots, memories)), np.zeros(slots)
        x, trial, K, ends = x0.copy(), x0.copy(), np.zeros((4, len(x0))), np.zeros((3, len(held)))
        h = period / substeps
        begin(x, u[0], p, terms, on, P, S, since, c, z)
        for i in range(rows):
            if not finite(x):
                break
            act(x, u[i], p, terms, on, P, S, c, z, f)
            where[i], acted[i] = c, f
            reading(x, u[i], p, f, out[i])
            if i < rows - 1:
                for k in range(substeps):
                    between(u, held, i, k, substeps, ends)
                    if len(x) > 0:
                        step(x, ends, h, p, terms, on, P, S, c, z, f, K, trial)
                    advance(x, ends[2], p, terms, on, P, S, h, c, z)
        return out, where, acted

    return compiler(run)
