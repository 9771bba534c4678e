# SPDX-License-Identifier: Apache-2.0
"""The supply's pressure sags with the flow drawn: a tank refilled through a regulator of finite stiffness.

d(drop)/dt = (resistance W - drop)/tau, W the inflow of both springs; the tank is steady at the first instant.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import RIG, Effect
from pneumo_ros.effects.expected import SAG
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.hooks import Air
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.laws.memory import relaxed

State = tuple[float]
Values = tuple[float, float]
DEEPEST = 4e5  # Pa: keeps a wild trial of the fit from a negative supply


@njit(cache=True, error_model="numpy")
def start(front: Air, rear: Air, p: Values) -> State:
    """Steady sag at the first flow."""
    return (min(p[0] * (front.inflow + rear.inflow), DEEPEST),)


@njit(cache=True, error_model="numpy")
def advance(z: State, front: Air, rear: Air, dt: float, p: Values) -> State:
    """Exact first order at held flow."""
    return (min(relaxed(z[0], p[0] * (front.inflow + rear.inflow), dt, max(p[1], 1e-4)), DEEPEST),)


@njit(cache=True, error_model="numpy")
def supply(z: State, p: Values) -> float:
    """Pa below the regulated supply."""
    return z[0]


EFFECT = Effect(
    id="supply_droop",
    summary="the supply's pressure falls with the air drawn from it (tank, regulator, hose)",
    sites=RIG,
    places=("supply",),
    parameters=(
        EffectParameter(
            "supply_resistance",
            "Pa s/kg",
            0.0,
            3e8,
            1e7,
            size=True,
            starts=(4e7,),
            meaning="fall of the supply for each kg/s drawn",
        ),
        EffectParameter(
            "supply_time_constant",
            "s",
            0.002,
            20.0,
            0.3,
            starts=(0.03, 3.0),
            meaning="time in which it falls and recovers",
        ),
    ),
    term=PlantTerm(states=1, start=start, advance=advance, supply=supply, shared=True),
    guide=Guide(
        meaning="The supply's pressure falls while air is drawn: small tank, tired regulator, long hose.",
        check=(
            "put a gauge at the manifold, open both inlets to 1 mm2 until the gauge stands still, then close "
            "them: they drew 3.7 g/s together, so the gauge rises by {sag}, two thirds of that within "
            "{supply_time_constant}"
        ),
        expects={"sag": SAG},
        mistaken_for={"orifice_coefficient": "is there with small draws as well; droop grows with what both ends draw"},
    ),
)
