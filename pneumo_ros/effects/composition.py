# SPDX-License-Identifier: Apache-2.0
"""One compiled kernel for a whole library of plant terms: its source is generated, written to a cache and compiled
once.

Numba cannot cache a function made inside a factory, and a call through a function pointer would cost more than the term
itself. So the terms' names are written into the source of one module under its content hash; each term is guarded by a
flag that is read once, so that a kernel holding the whole library runs the nominal rig at nearly the nominal speed.

The generated module composes only: its equations, and the integration, stand in :mod:`pneumo_ros.effects.kernel`.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numba

from pneumo_ros import laws
from pneumo_ros.effects import hooks, kernel
from pneumo_ros.effects.cache import kept
from pneumo_ros.plant import air_spring, equations, integrator, orifice
from pneumo_ros.rig import channels

Compiled = Any  # numba ships no types; a dispatcher of module level

CORRECTIONS = (
    "front_force",
    "rear_force",
    "front_air",
    "rear_air",
    "front_tyre",
    "rear_tyre",
    "body_heave",
    "body_pitch",
    "supply",
)


@dataclass(frozen=True)
class PlantTerm:
    """What an effect adds inside the compiled kernel: compiled functions of module level, each optional.

    Of their arguments, ``strut``, ``air`` and ``tyre`` are the signals of :mod:`pneumo_ros.effects.hooks` at the term's
    end (``front``, ``rear``: the air of both, for a term that they share), ``z`` is the tuple of the term's own states,
    ``p`` its parameters in the order of ``EFFECT.parameters``, SI, and ``dt`` a step of the integration, s.

    Attributes
    ----------
    states : number of own states at each end
    start : (strut, air, tyre, p) -> z at the first instant; zeros without it
    advance : (z, strut, air, tyre, dt, p) -> z one step later, signals held
    force : (strut, z, p) -> N, added to the spring's force (positive upwards on the body)
    tyre : (tyre, z, p) -> N, added to the tyre's force (positive upwards on the axle)
    air : (air, z, p) -> Pa/s, added to dP/dt
    supply : (z, p) -> Pa by which the supply has sagged; only for a term of the whole rig
    body : (strut_front, strut_rear, z, p) -> N upwards on the body alone above each axle; only for the whole rig
    struts : (strut_front, strut_rear, z, p) -> N added to each spring's force; only for the whole rig
    ground : (tyre_front, tyre_rear, z, p) -> N upwards on each axle, as a tyre's; only for the whole rig
    airs : (air_front, air_rear, z, p) -> Pa/s, added to each spring's dP/dt; only for the whole rig
    shared : the term belongs to the rig, not to one end: advance is (z, front, rear, dt, p), start (front, rear, p),
        of the struts for a term with ``body`` or ``struts``, the tyres with ``ground``, else the air
    """

    states: int = 0
    start: Compiled | None = None
    advance: Compiled | None = None
    force: Compiled | None = None
    tyre: Compiled | None = None
    air: Compiled | None = None
    supply: Compiled | None = None
    body: Compiled | None = None
    struts: Compiled | None = None
    ground: Compiled | None = None
    airs: Compiled | None = None
    shared: bool = False

    @property
    def functions(self) -> dict[str, Compiled]:
        """Hook name -> function, of those it has."""
        names = ("start", "advance", "force", "tyre", "air", "supply", "body", "struts", "ground", "airs")
        return {name: getattr(self, name) for name in names if getattr(self, name) is not None}

    @property
    def sees(self) -> tuple[str, ...]:
        """Signals that its states follow: of its own end, or the one of both ends that a term of the whole rig sees."""
        if not self.shared:
            return ("strut", "air", "tyre")
        if self.body is not None or self.struts is not None:
            return ("strut",)
        return ("tyre",) if self.ground is not None else ("air",)


@dataclass(frozen=True)
class Slot:
    """A term's place in the composed kernel: its index in ``on`` and ``values``, and how many parameters it reads."""

    name: str
    term: PlantTerm
    parameters: int


def compose(slots: Sequence[Slot]) -> Compiled:
    """The kernel of these terms, compiled at its first call (and from disk ever after).

    Called as :func:`pneumo_ros.effects.kernel.simulate`: one period after the other with ``resume`` gives what all of
    them in one call give.
    """
    compiled: Compiled = _load(_source(slots), tuple(_files(slots))).simulate
    return compiled


@lru_cache(maxsize=32)
def _load(source: str, files: tuple[str, ...]) -> ModuleType:
    # Numba's own cache looks at the caller's file alone: a callee edited later would go unnoticed, hence all sources.
    digest = hashlib.sha256(f"{numba.__version__} {sys.version}\n{source}".encode())
    for file in files:
        digest.update(Path(file).read_bytes())
    name = f"kernel_{digest.hexdigest()[:20]}"
    path = kept(f"{name}.py", source.encode())
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def _files(slots: Sequence[Slot]) -> list[str]:
    modules = [hooks, kernel, channels, air_spring, equations, integrator, orifice]
    functions = [f for slot in slots for f in slot.term.functions.values()]
    called = {*laws.sources(), *(str(m.__file__) for m in modules)}
    return sorted(called | {inspect.getsourcefile(f.py_func) or "" for f in functions})


def _source(slots: Sequence[Slot]) -> str:
    """Imports, the terms of this library under the names of :mod:`pneumo_ros.effects.terms`, and the kernel over them.

    Nothing is computed here: every line hands named values to a named function.
    """
    terms = [_switches(slots), _tuples(slots), _stored(slots), _changed(slots, "start"), _changed(slots, "advance"),
             _sagged(slots), _added(slots)]  # fmt: skip
    return "\n\n".join([_imports(slots), *terms, inspect.getsource(kernel.simulate.py_func)])


def _imports(slots: Sequence[Slot]) -> str:
    lines = [_HEAD]
    for k, slot in enumerate(slots):
        for hook, function in slot.term.functions.items():
            file = inspect.getsourcefile(function.py_func)
            target = f'"{function.__module__}", {str(file)!r}, "{function.__name__}"'
            lines.append(f"{hook}_{k} = function_at({target})")
    return "\n".join(lines)


_HEAD = '''"""Generated by pneumo_ros.effects.composition; do not edit."""

from __future__ import annotations

import numpy as np
from numba import njit

from pneumo_ros.effects.kernel import Feed, Loads, diverged, ends, fed, moved, nominal_loads, rates
from pneumo_ros.effects.loading import function_at'''


class _Place(NamedTuple):
    """A term at an end: its number, the end's, its letter, and its place in the tuples."""

    k: int
    end: int
    side: str
    number: int
    slot: Slot

    @property
    def z(self) -> str:
        """Name of its states."""
        return f"z{self.number}"

    def call(self, hook: str, *arguments: str) -> str:
        """A call of one of its functions."""
        return f"{hook}_{self.k}({', '.join(arguments)})"

    def signals(self, *kinds: str) -> tuple[str, ...]:
        """The signals of its end, or of both for a term of the whole rig."""
        sides = "fr" if self.slot.term.shared else self.side
        return tuple(f"s.{kind}_{side}" for kind in kinds for side in sides)


def _places(slots: Sequence[Slot]) -> list[_Place]:
    pairs = [(k, end) for k, slot in enumerate(slots) for end in range(1 if slot.term.shared else 2)]
    return [_Place(k, end, "fr"[end], number, slots[k]) for number, (k, end) in enumerate(pairs)]


def _function(head: str, lines: Sequence[str], inline: bool = True) -> str:
    decorator = '@njit(error_model="numpy", inline="always")' if inline else '@njit(error_model="numpy")'
    return "\n".join([decorator, f"def {head}:", *(f"    {line}" for line in lines)])


def _tuple(items: Iterable[str]) -> str:
    return "(" + "".join(f"{item}, " for item in items) + ")"


def _switches(slots: Sequence[Slot]) -> str:
    places = _places(slots)
    own = " or ".join(f"on[{p.k}, {p.end}]" for p in places if p.slot.term.advance) or "False"
    return _function("switches(on)", [f"return {own}, {_tuple(f'on[{p.k}, {p.end}]' for p in places)}"])


def _tuples(slots: Sequence[Slot]) -> str:
    """Source lines of the helpers that make tuples of a term's parameters and states."""
    places = _places(slots)

    def nested(name: str, count: Callable[[_Place], int]) -> str:
        return _tuple(_tuple(f"{name}[{p.k}, {p.end}, {m}]" for m in range(count(p))) for p in places)

    zeros = _tuple(_tuple("0.0" for _ in range(p.slot.term.states)) for p in places)
    return "\n\n".join((
        _function("parameters(values)", [f"return {nested('values', lambda p: p.slot.parameters)}"]),
        _function("at_rest()", [f"return {zeros}"]),
        _function("restored(inner)", [f"return {nested('inner', lambda p: p.slot.term.states)}"]),
    ))  # fmt: skip


def _stored(slots: Sequence[Slot]) -> str:
    lines = [
        f"inner[{p.k}, {p.end}, {m}] = z[{p.number}][{m}]" for p in _places(slots) for m in range(p.slot.term.states)
    ]
    return _function("stored(z, inner)", lines or ["pass"])


def _changed(slots: Sequence[Slot], hook: str) -> str:
    """started or advanced: new states of the terms that act, the others' as they are."""
    dt = ("dt",) if hook == "advance" else ()
    places = _places(slots)
    lines = [f"{_tuple(p.z for p in places)} = z"] if places else []
    for p in places:
        if hook in p.slot.term.functions:
            before = (p.z,) if hook == "advance" else ()
            call = p.call(hook, *before, *p.signals(*p.slot.term.sees), *dt, f"p[{p.number}]")
            lines += [f"if flags[{p.number}]:", f"    {p.z} = {call}"]
    name = {"start": "started(z, flags, p, s)", "advance": "advanced(z, flags, p, s, dt)"}[hook]
    return _function(name, [*lines, f"return {_tuple(p.z for p in places)}"])


def _sagged(slots: Sequence[Slot]) -> str:
    lines = []
    for p in _places(slots):
        if p.slot.term.supply is not None:
            call = p.call("supply", f"z[{p.number}]", f"p[{p.number}]")
            lines += [f"if flags[{p.number}]:", f"    drop += {call}"]
    return _function("sagged(z, flags, p, drop)", [*lines, "return drop"])


def _added(slots: Sequence[Slot]) -> str:
    """What terms add, by the hook's name: the signal it reads and the sum it enters."""
    targets = {"force": ("strut", "spring"), "tyre": ("tyre", "tyre"), "air": ("air", "air")}
    # A spring's force acts on the body and back on the axle; what acts on the body alone is given to the axle again.
    whole = {
        "body": ("strut", ("spring", "tyre")),
        "struts": ("strut", ("spring",)),
        "ground": ("tyre", ("tyre",)),
        "airs": ("air", ("air",)),
    }
    sums = [f"{name}_{side}" for name in ("spring", "air", "tyre") for side in "fr"]
    lines = [f"{', '.join(sums)}, heave, pitch = loads"]
    for p in _places(slots):
        for hook, (signal, total) in targets.items():
            if hook in p.slot.term.functions:
                call = p.call(hook, *p.signals(signal), f"z[{p.number}]", f"p[{p.number}]")
                lines += [f"if flags[{p.number}]:", f"    {total}_{p.side} += {call}"]
        for hook, (signal, totals) in whole.items():
            if hook in p.slot.term.functions:
                call = p.call(hook, *p.signals(signal), f"z[{p.number}]", f"p[{p.number}]")
                lines += [f"if flags[{p.number}]:", f"    at_f, at_r = {call}"]
                lines += [f"    {total}_{side} += at_{side}" for total in totals for side in "fr"]
    return _function("added(z, flags, p, s, loads)", [*lines, f"return Loads({', '.join(sums)}, heave, pitch)"])
