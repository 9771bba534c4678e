# SPDX-License-Identifier: Apache-2.0
"""Atoms of a force between axle and ground, positive up on the axle: losses, lost contact, another stiffness.

A contact that only pushes has a force that is convex over the compression: ramps below several compressions, and a
progressive part that agrees with the linear tyre without load and at rest. A carcass that lets go smoothly touches
early and is softer about its rest than the line through both: a ramp that begins beyond the rest, and is nothing at it,
so that the rig's trim stays. All are in proportion to the compression at rest, so that both ends may share them.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS
from pneumo_ros.effects.hooks import Air, Strut, Tyre
from pneumo_ros.effects.shapes.atoms import Atom, Term
from pneumo_ros.laws.damping import linear
from pneumo_ros.laws.friction import clipped, slid

RATES = (0.03, 0.15)  # m/s
SLACKS = (3e-4, 1.5e-3)  # m
LOADED = 0.02  # m of compression at which a loss over load is stated
PER_RATE, PER_SLACK, PER_LOADED = tuple(1.0 / r for r in RATES), tuple(1.0 / s for s in SLACKS), 1.0 / LOADED
# Shares of the compression at rest below which force is taken away; the one beyond the rest is nothing at it
LIFTS = (0.0, 0.05, 0.15, 0.35, 0.7, 1.0, 1.4)

ATOMS = (
    Atom("loss", "N s/m", 20.0),
    *(Atom(f"loss {r:g} m/s", "N", 3.0) for r in RATES),
    Atom("loss over load", "N s/m", 20.0),
    *(Atom(f"loss slider {s:g} m", "N", 3.0) for s in SLACKS),
    *(Atom(f"lift below {100.0 * c:g} %", "N/m", 500.0) for c in LIFTS),
    Atom("progressive", "N/m", 500.0),
    Atom("constant", "N/m", 100.0, signed=True),
    *(Atom(f"loss over load to the {power}", "N s/m", 20.0) for power in (2, 3)),
)
State = tuple[float, float]
Values = tuple[float, ...]


@njit(cache=True, error_model="numpy", inline="always")
def advance(z: State, strut: Strut, air: Air, tyre: Tyre, dt: float, p: Values) -> State:
    """Sliders one step later."""
    move = tyre.rate * dt
    return (slid(z[0], move * PER_SLACK[0]), slid(z[1], move * PER_SLACK[1]))


@njit(cache=True, error_model="numpy", inline="always")
def tyre(tyre: Tyre, z: State, p: Values) -> float:
    """Sum of the atoms."""
    v, c, rest, r = tyre.rate, tyre.compression, tyre.rest, PER_RATE
    loaded = max(0.0, c) * PER_LOADED
    out = linear(v, p[0]) + p[1] * clipped(v * r[0], 1.0) + p[2] * clipped(v * r[1], 1.0)
    out += v * loaded * (p[3] + loaded * (p[15] + loaded * p[16])) + p[4] * z[0] + p[5] * z[1]
    out += p[6] * max(0.0, -c) + p[7] * max(0.0, 0.05 * rest - c) + p[8] * max(0.0, 0.15 * rest - c)
    out += p[9] * max(0.0, 0.35 * rest - c) + p[10] * max(0.0, 0.7 * rest - c)
    out += p[11] * max(0.0, rest - c) + p[12] * (max(0.0, 1.4 * rest - c) - 0.4 * rest)
    return out + p[13] * c * (c / rest - 1.0) + p[14] * rest


TYRE = Term("tyre", PlantTerm(states=2, advance=advance, tyre=tyre), ATOMS, ENDS, ("{end}_tyre",))
EFFECTS = (
    TYRE.shape("tyre_damping", ["loss"], "losses of the tyre of any law"),
    TYRE.shape(
        "tyre_liftoff",
        ["lift", "progressive", "constant"],
        "a tyre that stops pulling, of any law: its force is convex over the compression",
        alone=("lift below 5 %", "lift below 35 %", "lift below 140 %", "progressive"),
    ),
    TYRE.anything(),
)
