# SPDX-License-Identifier: Apache-2.0
"""Atoms of a force between body and axle: friction, damping, stops, hysteresis, errors of the spring.

Positive upwards on the body. Friction and damping are saturating ramps and powers of the strut's rate, each for
extension and compression; what sticks, and rate-independent hysteresis, are sliders in parallel (Iwan 1966, "A
distributed-element model for hysteresis and its steady-state dynamic response", J. Appl. Mech. 33): elastic up to their
slack, then slipping at constant force.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

import math
from dataclasses import replace

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS
from pneumo_ros.effects.hooks import Air, Strut, Tyre
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.effects.shapes.atoms import Atom, Term
from pneumo_ros.laws.friction import clipped, slid
from pneumo_ros.laws.memory import relaxed
from pneumo_ros.units import INCH

RATES = (0.012, 0.022, 0.04, 0.13, 0.4)  # m/s at which a ramp saturates; shorter ones stick, which sliders do
FRICTION, DAMPING = RATES[:2], RATES[1:]  # the ramp they share is a soft friction's and an early blow-off's alike
SLACKS = (6e-5, 3e-4, 1.2e-3, 4e-3, 1.2e-2)  # m of travel before a slider slips
STOPS = (0.0335, 0.036, 0.0385, 0.041, 0.043)  # m, heights below which a stop's ramps begin
STRAPS = (0.0485, 0.051, 0.0535)  # m, heights above which a strap's begin
TOUCHES = (0.041, 0.0365)  # m, heights below which a stop damps
LAGS = (0.02, 0.1, 0.5)  # s, memories of the rubber
MIDDLE = 1.8 * INCH  # m, design height
SWING = 5e-3  # m, travel of a session
GAUGE = 2.5e5  # Pa, between the two ends' static pressures
TOUCHING = 1e-3  # m over which a stop's damping sets in
WAVES = 120.0  # a metre, lobes of a convoluted bellows that the area follows
# Turned over, because a compiled division by a constant takes as long as five products: with the terms inlined, whose
# forty amplitudes a call would copy, the half of what these atoms cost a step.
PER_RATE, PER_SLACK = tuple(1.0 / r for r in RATES), tuple(1.0 / s for s in SLACKS)
PER_SWING, PER_GAUGE, PER_TOUCHING = 1.0 / SWING, 1.0 / GAUGE, 1.0 / TOUCHING

State = tuple[float, float, float, float, float, float, float, float]

ATOMS: tuple[Atom | EffectParameter, ...] = (
    *(Atom(f"friction_out {r:g} m/s", "N", 3.0) for r in RATES),
    Atom("damping_out", "N s/m", 20.0),
    Atom("damping_out squared", "N s2/m2", 60.0),
    *(Atom(f"friction_in {r:g} m/s", "N", 3.0) for r in RATES),
    Atom("damping_in", "N s/m", 20.0),
    Atom("damping_in squared", "N s2/m2", 60.0),
    Atom("load_friction", "N", 3.0),
    *(Atom(f"slider {s:g} m", "N", 3.0) for s in SLACKS),
    *(Atom(f"stop {h:g} m", "N/m", 1e4) for h in STOPS),
    *(Atom(f"strap {h:g} m", "N/m", 1e4) for h in STRAPS),
    *(Atom(f"touch {h:g} m", "N s/m", 100.0) for h in TOUCHES),
    Atom("touch_in", "N s/m", 100.0),
    Atom("area", "1", 0.02, signed=True),
    Atom("area slope", "1", 0.02, signed=True),
    Atom("area curvature", "1", 0.02, signed=True),
    Atom("area pressure", "1", 0.02, signed=True),
    Atom("stiffness", "N/m", 500.0, signed=True),
    Atom("stiffness odd", "N", 2.0, signed=True),
    *(Atom(f"memory {t:g} s", "N/m", 500.0) for t in LAGS),
    Atom("constant", "N", 2.0, signed=True),
    *(Atom(f"deep slider {s:g} m", "N", 3.0) for s in SLACKS[2:4]),
    Atom("area pressure squared", "1", 0.02, signed=True),
    Atom("area wave even", "1", 0.02, signed=True),
    Atom("area wave odd", "1", 0.02, signed=True),
    # Nothing where whatever may act there is fitted: its waves have the usual length.
    EffectParameter("area waves", "1/m", 70.0, 200.0, WAVES, spread=10.0),
)
Values = tuple[float, ...]


@njit(cache=True, error_model="numpy", inline="always")
def start(strut: Strut, air: Air, tyre: Tyre, p: Values) -> State:
    """Sliders free of force, memories at the strut's height."""
    return (0.0, 0.0, 0.0, 0.0, 0.0, strut.height, strut.height, strut.height)


@njit(cache=True, error_model="numpy", inline="always")
def advance(z: State, strut: Strut, air: Air, tyre: Tyre, dt: float, p: Values) -> State:
    """Sliders and memories one step later, at held rate and height."""
    move, h = strut.rate * dt, strut.height
    return (
        slid(z[0], move * PER_SLACK[0]), slid(z[1], move * PER_SLACK[1]), slid(z[2], move * PER_SLACK[2]),
        slid(z[3], move * PER_SLACK[3]), slid(z[4], move * PER_SLACK[4]),
        relaxed(z[5], h, dt, LAGS[0]), relaxed(z[6], h, dt, LAGS[1]), relaxed(z[7], h, dt, LAGS[2]),
    )  # fmt: skip


@njit(cache=True, error_model="numpy", inline="always")
def force(strut: Strut, z: State, p: Values) -> float:
    """Sum of the atoms."""
    v, h, load = strut.rate, strut.height, strut.gauge * PER_GAUGE
    out, r = p[40], PER_RATE
    if v > 0.0:
        out -= p[0] * min(v * r[0], 1.0) + p[1] * min(v * r[1], 1.0) + p[2] * min(v * r[2], 1.0)
        out -= p[3] * min(v * r[3], 1.0) + p[4] * min(v * r[4], 1.0) + p[5] * v + p[6] * v * v
    else:
        w = -v
        out += p[7] * min(w * r[0], 1.0) + p[8] * min(w * r[1], 1.0) + p[9] * min(w * r[2], 1.0)
        out += p[10] * min(w * r[3], 1.0) + p[11] * min(w * r[4], 1.0) + p[12] * w + p[13] * w * w
    out -= p[14] * load * clipped(v * r[0], 1.0)
    out -= p[15] * z[0] + p[16] * z[1] + p[17] * z[2] + p[18] * z[3] + p[19] * z[4]
    if h < STOPS[4]:
        out += p[20] * max(0.0, STOPS[0] - h) + p[21] * max(0.0, STOPS[1] - h) + p[22] * max(0.0, STOPS[2] - h)
        out += p[23] * max(0.0, STOPS[3] - h) + p[24] * (STOPS[4] - h)
        near = min(max((TOUCHES[0] - h) * PER_TOUCHING, 0.0), 1.0)
        far = min(max((TOUCHES[1] - h) * PER_TOUCHING, 0.0), 1.0)
        out -= (p[28] * v + p[30] * min(v, 0.0)) * near + p[29] * v * far
    if h > STRAPS[0]:
        out -= p[25] * (h - STRAPS[0]) + p[26] * max(0.0, h - STRAPS[1]) + p[27] * max(0.0, h - STRAPS[2])
    x, over = (h - MIDDLE) * PER_SWING, load - 1.0
    out += strut.gauge * strut.area * (p[31] + p[32] * x + p[33] * x * x + p[34] * over + p[43] * over * over)
    if p[44] != 0.0 or p[45] != 0.0:
        turn = 2.0 * math.pi * (p[46] if p[46] > 0.0 else WAVES) * (h - MIDDLE)
        out += strut.gauge * strut.area * (p[44] * math.cos(turn) + p[45] * math.sin(turn))
    out += p[35] * (h - MIDDLE) + p[36] * x * abs(x)
    out -= max(0.0, 1.0 - x) * (p[41] * z[2] + p[42] * z[3])
    return out - p[37] * (h - z[5]) - p[38] * (h - z[6]) - p[39] * (h - z[7])


FORCE = Term("force", PlantTerm(states=8, start=start, advance=advance, force=force), ATOMS, ENDS, ("{end}_force",))
EFFECTS = (
    FORCE.shape(
        "coulomb_friction",
        [f"friction_out {r:g} m/s" for r in FRICTION] + [f"friction_in {r:g} m/s" for r in FRICTION]
        + ["load_friction", *(f"slider {s:g} m" for s in SLACKS[:3])],
        "dry friction of any law: saturating in rate, with or without sticking",
    ),
    FORCE.shape(
        "viscous_damping",
        [f"friction_out {r:g} m/s" for r in DAMPING] + [f"friction_in {r:g} m/s" for r in DAMPING]
        + ["damping_out", "damping_in"],
        "damping of any law: grows with rate, unlike out and in",
    ),
    FORCE.shape(
        "bellows_hysteresis",
        [*(f"slider {s:g} m" for s in SLACKS[1:]), "deep"],
        "hysteresis of any law: sliders of every length, some of which hold the better the deeper the spring is",
    ),
    FORCE.shape("bump_stop", ["stop", "touch", "touch_in"], "a stop of any law: begins below a height and may damp"),
    replace(
        FORCE.shape("effective_area_error", ["area"], "an area error of any law over height and pressure, or in waves"),
        waves=(5, 6, 7),
    ),
    FORCE.anything(),
)  # fmt: skip
