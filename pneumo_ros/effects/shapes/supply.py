# SPDX-License-Identifier: Apache-2.0
"""Atoms of a supply that sags with the flow drawn from it: memories of flow and of its square (a hose, an orifice).

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import RIG
from pneumo_ros.effects.hooks import Air
from pneumo_ros.effects.shapes.atoms import Atom, Term
from pneumo_ros.laws.memory import relaxed

TIMES = (0.01, 0.05, 0.25, 1.2, 6.0)  # s
SQUARE_TIMES = (0.02, 0.5, 4.0)  # s
USUAL = 2e-3  # kg/s, usual flow of both springs
DEEPEST = 4e5  # Pa: keeps a wild trial of the fit from a negative supply

ATOMS = (
    *(Atom(f"droop {t:g} s", "Pa s/kg", 5e6) for t in TIMES),
    *(Atom(f"droop squared {t:g} s", "Pa s/kg", 5e6) for t in SQUARE_TIMES),
    Atom("offset", "Pa", 5e3, signed=True),
)
State = tuple[float, float, float, float, float, float, float, float]
Values = tuple[float, ...]


@njit(cache=True, error_model="numpy")
def start(front: Air, rear: Air, p: Values) -> State:
    """Steady at the first flow."""
    w = front.inflow + rear.inflow
    return (w, w, w, w, w, w * w, w * w, w * w)


@njit(cache=True, error_model="numpy")
def advance(z: State, front: Air, rear: Air, dt: float, p: Values) -> State:
    """Memories at held flow, exact."""
    w = front.inflow + rear.inflow
    s = w * w
    return (
        relaxed(z[0], w, dt, 0.01), relaxed(z[1], w, dt, 0.05),
        relaxed(z[2], w, dt, 0.25), relaxed(z[3], w, dt, 1.2),
        relaxed(z[4], w, dt, 6.0), relaxed(z[5], s, dt, 0.02),
        relaxed(z[6], s, dt, 0.5), relaxed(z[7], s, dt, 4.0),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def supply(z: State, p: Values) -> float:
    """Pa below the regulated supply."""
    out = p[8] + p[0] * z[0] + p[1] * z[1] + p[2] * z[2] + p[3] * z[3] + p[4] * z[4]
    out += (p[5] * z[5] + p[6] * z[6] + p[7] * z[7]) / USUAL
    return min(max(out, -DEEPEST), DEEPEST)


SUPPLY = Term(
    "supply", PlantTerm(states=8, start=start, advance=advance, supply=supply, shared=True), ATOMS, RIG, ("supply",)
)
EFFECTS = (SUPPLY.shape("supply_droop", ["droop", "offset"], "a supply that sags by any law"), SUPPLY.anything())
