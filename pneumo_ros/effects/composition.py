"""One compiled kernel for a whole library of plant terms: its source is generated, written to a cache and compiled
once.

Numba cannot cache a function made inside a factory, and a call through a function pointer would cost more than the term
itself. So the terms' names are written into the source of one module under its content hash; each term is guarded by a
flag that is read once, so that a kernel holding the whole library runs the nominal rig at nearly the nominal speed.

Scheme: the ten states of the half car by RK4; a term's own states are staggered by half a step (advanced once per step
with the signals at its start, which is second order), each by its own exact or stable update, so that a stiff bristle
does not shorten the step.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numba

from pneumo_ros.effects import hooks as kernel_parts
from pneumo_ros.effects.cache import kept
from pneumo_ros.plant import air_spring, half_car, orifice

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

    ``z`` is the tuple of the term's own states, ``p`` of its parameter values; the signals are those of
    :mod:`pneumo_ros.effects.hooks`.

    Attributes
    ----------
    states : number of own states at each end
    start : (strut, air, tyre, p) -> z at the first instant; zeros without it
    advance : (z, strut, air, tyre, dt, p) -> z one step later, signals held
    force : (strut, z, p) -> N, added to the spring's force (positive upwards on the body)
    tyre : (tyre, z, p) -> N, added to the tyre's force (positive upwards on the axle)
    air : (air, z, p) -> Pa/s, added to dP/dt
    supply : (z, p) -> Pa by which the supply has sagged; only for a term of the whole rig
    shared : the term belongs to the rig, not to one end: advance is (z, air_front, air_rear, dt, p), start (air_front,
        air_rear, p)
    """

    states: int = 0
    start: Compiled | None = None
    advance: Compiled | None = None
    force: Compiled | None = None
    tyre: Compiled | None = None
    air: Compiled | None = None
    supply: Compiled | None = None
    shared: bool = False

    @property
    def functions(self) -> dict[str, Compiled]:
        """Hook name -> function, of those it has."""
        names = ("start", "advance", "force", "tyre", "air", "supply")
        return {name: getattr(self, name) for name in names if getattr(self, name) is not None}


@dataclass(frozen=True)
class Slot:
    """A term's place in the composed kernel: its index in ``on`` and ``values``, and how many parameters it reads."""

    name: str
    term: PlantTerm
    parameters: int


def compose(slots: Sequence[Slot]) -> Compiled:
    """The kernel of these terms, compiled at its first call (and from disk ever after).

    Signature: (x0 (10,), commands (N, 4), road (N + 1, 2), correction (0 or N, 9), period, steps, body, front, rear,
    surface, on (K, 2) bool, values (K, 2, M), inner (K, 2, S), resume) -> states (N + 1, 10); rows after a divergence
    are NaN. ``inner`` is where the terms' own states end; with ``resume`` they begin there instead of at rest, so that
    one period after the other gives what all of them in one call give.
    """
    kernel: Compiled = _load(_source(slots), tuple(_files(slots))).simulate
    return kernel


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
    modules = [kernel_parts, air_spring, half_car, orifice]
    functions = [f for slot in slots for f in slot.term.functions.values()]
    return sorted({str(m.__file__) for m in modules} | {inspect.getsourcefile(f.py_func) or "" for f in functions})


def _source(slots: Sequence[Slot]) -> str:
    return "\n".join([_imports(slots), _HEAD, *_unpack(slots), _FIRST, *_start(slots), *_resume(slots), _LOOP,
                      *_advance(slots), *_supply(slots), _SAG.format(indent=" " * 12), _STAGES, *_hooks(slots), _TAIL,
                      *_store(slots), ""])  # fmt: skip


def _imports(slots: Sequence[Slot]) -> str:
    lines = ['"""Generated by pneumo_ros.effects.composition; do not edit."""', _IMPORTS]
    for k, slot in enumerate(slots):
        for hook, function in slot.term.functions.items():
            file = inspect.getsourcefile(function.py_func)
            target = f'"{function.__module__}", {str(file)!r}, "{function.__name__}"'
            lines.append(f"{hook}_{k} = function_at({target})")
    return "\n".join(lines)


def _sides(slot: Slot) -> tuple[str, ...]:
    return ("f",) if slot.term.shared else ("f", "r")


def _unpack(slots: Sequence[Slot]) -> list[str]:
    lines = []
    for k, slot in enumerate(slots):
        for s, side in enumerate(_sides(slot)):
            values = "".join(f"values[{k}, {s}, {m}], " for m in range(slot.parameters))
            zeros = "0.0, " * slot.term.states
            lines += [f"    on{k}{side} = on[{k}, {s}]", f"    p{k}{side} = ({values})", f"    z{k}{side} = ({zeros})"]
    own = [f"on{k}{side}" for k, slot in enumerate(slots) if slot.term.advance for side in _sides(slot)]
    lines.append(f"    own = {' or '.join(own) or 'False'}")
    return lines


def _resume(slots: Sequence[Slot]) -> list[str]:
    """The terms' states, and the sag they make of the supply, as the call before left them."""
    lines = ["    if resume:", "        drop = 0.0"]
    for k, slot in enumerate(slots):
        for s, side in enumerate(_sides(slot) if slot.term.states else ()):
            kept = "".join(f"inner[{k}, {s}, {m}], " for m in range(slot.term.states))
            lines.append(f"        z{k}{side} = ({kept})")
        if slot.term.supply is not None:
            lines += [f"        if on{k}f:", f"            drop += supply_{k}(z{k}f, p{k}f)"]
    return [*lines, _SAG.format(indent=" " * 8)]


def _store(slots: Sequence[Slot]) -> list[str]:
    return [
        f"    inner[{k}, {s}, {m}] = z{k}{side}[{m}]"
        for k, slot in enumerate(slots)
        for s, side in enumerate(_sides(slot))
        for m in range(slot.term.states)
    ] + ["    return out"]


def _start(slots: Sequence[Slot]) -> list[str]:
    lines = []
    for k, slot in enumerate(slots):
        if slot.term.start is None:
            continue
        for side in _sides(slot):
            args = "air_f, air_r" if slot.term.shared else f"strut_{side}, air_{side}, tyre_{side}"
            lines += [f"    if on{k}{side} and not resume:", f"        z{k}{side} = start_{k}({args}, p{k}{side})"]
    return lines


def _advance(slots: Sequence[Slot]) -> list[str]:
    lines = []
    for k, slot in enumerate(slots):
        if slot.term.advance is None:
            continue
        for side in _sides(slot):
            args = "air_f, air_r" if slot.term.shared else f"strut_{side}, air_{side}, tyre_{side}"
            call = f"advance_{k}(z{k}{side}, {args}, dt, p{k}{side})"
            lines += [f"                if on{k}{side}:", f"                    z{k}{side} = {call}"]
    return lines


def _supply(slots: Sequence[Slot]) -> list[str]:
    lines = ["            drop = held"]
    for k, slot in enumerate(slots):
        if slot.term.supply is not None:
            lines += [f"            if on{k}f:", f"                drop += supply_{k}(z{k}f, p{k}f)"]
    return lines


def _hooks(slots: Sequence[Slot]) -> list[str]:
    targets = {"force": ("strut", "ff", "fr"), "tyre": ("tyre", "tf", "tr"), "air": ("air", "gf", "gr")}
    lines = []
    for k, slot in enumerate(slots):
        for hook, (signal, *sums) in targets.items():
            if hook not in slot.term.functions:
                continue
            for side, total in zip(("f", "r"), sums, strict=True):
                call = f"{hook}_{k}({signal}_{side}, z{k}{side}, p{k}{side})"
                lines += [f"                if on{k}{side}:", f"                    {total} += {call}"]
    return lines


_IMPORTS = """
import numpy as np
from numba import njit

from pneumo_ros.effects.loading import function_at
from pneumo_ros.effects.hooks import Tyre, air_of, air_rate, strut_of
from pneumo_ros.plant.half_car import _moved
from pneumo_ros.units import GRAVITY
"""

_HEAD = '''

@njit(cache=True, error_model="numpy", inline="always")
def ends(x, u0, u1, u2, u3, rf, rr, rf_rate, rr_rate, sf, sr, qf, qr, body, front, rear, surface):
    """Strut, air and tyre of both ends."""
    z, q, zuf, zur, v, w, vuf, vur, pf, pr = x
    hf = z + body.front_arm * q - zuf
    hr = z - body.rear_arm * q - zur
    hfv = v + body.front_arm * w - vuf
    hrv = v - body.rear_arm * w - vur
    strut_f = strut_of(hf, hfv, pf - front.ambient_pressure, body.area_scale_front, body.damping_front, body, surface)
    strut_r = strut_of(hr, hrv, pr - rear.ambient_pressure, body.area_scale_rear, body.damping_rear, body, surface)
    air_f = air_of(pf, hf, hfv, u0, u2, sf, qf, front)
    air_r = air_of(pr, hr, hrv, u1, u3, sr, qr, rear)
    tyre_f = Tyre(rf - zuf, rf_rate - vuf, body.tyre_stiffness_front * (rf - zuf))
    tyre_r = Tyre(rr - zur, rr_rate - vur, body.tyre_stiffness_rear * (rr - zur))
    return strut_f, strut_r, air_f, air_r, tyre_f, tyre_r


@njit(cache=True, error_model="numpy")
def simulate(x0, commands, road, correction, period, steps, body, front, rear, surface, on, values,
             inner, resume):
    """RK4 over N periods with the active terms."""
    count = commands.shape[0]
    out = np.empty((count + 1, 10))
    out[0] = x0
    x = (x0[0], x0[1], x0[2], x0[3], x0[4], x0[5], x0[6], x0[7], x0[8], x0[9])
    dt = period / steps
    corrected = correction.shape[0] > 0
    cff = cfr = cgf = cgr = ctf = ctr = ch = cp = held = 0.0
    sf, sr, qf, qr = front.supply_pressure, rear.supply_pressure, front.supply_power, rear.supply_power
    was = 0.0'''

_FIRST = """
    sag = (front.supply_pressure, rear.supply_pressure)
    strut_f, strut_r, air_f, air_r, tyre_f, tyre_r = ends(
        x, commands[0, 0], commands[0, 1], commands[0, 2], commands[0, 3], road[0, 0], road[0, 1], 0.0, 0.0,
        sf, sr, qf, qr, body, front, rear, surface)"""

_LOOP = """
    for i in range(count):
        u0, u1, u2, u3 = commands[i, 0], commands[i, 1], commands[i, 2], commands[i, 3]
        rf, rr = road[i, 0], road[i, 1]
        df, dr = (road[i + 1, 0] - rf) / steps, (road[i + 1, 1] - rr) / steps
        vf, vr = df / dt, dr / dt
        if corrected:
            cff, cfr, cgf, cgr = correction[i, 0], correction[i, 1], correction[i, 2], correction[i, 3]
            ctf, ctr, ch, cp = correction[i, 4], correction[i, 5], correction[i, 6], correction[i, 7]
            held = correction[i, 8]
        for j in range(steps):
            f0, r0 = rf + j * df, rr + j * dr
            if own:
                strut_f, strut_r, air_f, air_r, tyre_f, tyre_r = ends(
                    x, u0, u1, u2, u3, f0, r0, vf, vr, sf, sr, qf, qr, body, front, rear, surface)"""

_SAG = """\
{indent}if drop != was:
{indent}    sf, sr = sag[0] - drop, sag[1] - drop
{indent}    qf = (front.reference_pressure / sf) ** front.k
{indent}    qr = (rear.reference_pressure / sr) ** rear.k
{indent}    was = drop"""

_STAGES = """\
            y = x
            a0 = a1 = a2 = a3 = a4 = a5 = a6 = a7 = a8 = a9 = 0.0
            for stage in range(4):
                at = 0.5 if stage == 1 or stage == 2 else (0.0 if stage == 0 else 1.0)
                strut_f, strut_r, air_f, air_r, tyre_f, tyre_r = ends(
                    y, u0, u1, u2, u3, f0 + at * df, r0 + at * dr, vf, vr, sf, sr, qf, qr, body, front, rear, surface)
                ff, fr = strut_f.force + cff, strut_r.force + cfr
                tf, tr = tyre_f.force + ctf, tyre_r.force + ctr
                gf, gr = air_rate(air_f, front.mean_area) + cgf, air_rate(air_r, rear.mean_area) + cgr"""

_TAIL = """
                k = (
                    y[4], y[5], y[6], y[7],
                    (ff + fr + ch) / body.sprung_mass - GRAVITY,
                    (body.front_arm * ff - body.rear_arm * fr + cp) / body.pitch_inertia,
                    (tf - ff) / body.unsprung_mass_front - GRAVITY,
                    (tr - fr) / body.unsprung_mass_rear - GRAVITY,
                    gf, gr,
                )
                b = dt / 3.0 if stage == 1 or stage == 2 else dt / 6.0
                a0 += b * k[0]
                a1 += b * k[1]
                a2 += b * k[2]
                a3 += b * k[3]
                a4 += b * k[4]
                a5 += b * k[5]
                a6 += b * k[6]
                a7 += b * k[7]
                a8 += b * k[8]
                a9 += b * k[9]
                if stage < 3:
                    y = _moved(x, k, (dt if stage == 2 else 0.5 * dt))
            x = (x[0] + a0, x[1] + a1, x[2] + a2, x[3] + a3, x[4] + a4,
                 x[5] + a5, x[6] + a6, x[7] + a7, x[8] + a8, x[9] + a9)
        # A candidate that runs away loses; it must not cost the time of the whole log, nor raise.
        if not (abs(x[0]) < 1.0 and abs(x[1]) < 2.0 and x[8] > 1e3 and x[9] > 1e3):
            out[i + 1 :] = np.nan
            return out
        for m in range(10):
            out[i + 1, m] = x[m]"""
