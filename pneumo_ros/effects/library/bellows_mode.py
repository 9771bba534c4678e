# SPDX-License-Identifier: Apache-2.0
"""A mode of the bellows itself: part of its mass moves against the height and answers near its own frequency.

q'' = w^2 (h - q) + 2 zeta w ((1 - g) h' - q'); force on the strut -m (w^2 (h - q) + 2 zeta w (1 - g) (h' - q')). The
share g of the damping is the wall's own stretching, the rest acts between wall and strut: Lagrange's equations of the
dissipation m zeta w ((1 - g) (h' - q')^2 + g q'^2). Far below w the bellows follow the height.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

import math

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS, Effect
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.hooks import Air, Strut, Tyre
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.laws.ringing import pulled, swung

State = tuple[float, float]
Values = tuple[float, float, float, float]


@njit(cache=True, error_model="numpy")
def start(strut: Strut, air: Air, tyre: Tyre, p: Values) -> State:
    """The mode at rest on the strut."""
    return (strut.height, strut.rate)


@njit(cache=True, error_model="numpy")
def advance(z: State, strut: Strut, air: Air, tyre: Tyre, dt: float, p: Values) -> State:
    """Exact damped oscillation about the strut that moves at held speed."""
    return swung(z[0], z[1], strut.height, strut.rate, 2.0 * math.pi * p[1], p[2], p[3], dt)


@njit(cache=True, error_model="numpy")
def force(strut: Strut, z: State, p: Values) -> float:
    """Inertia force of the mode on the strut."""
    w = 2.0 * math.pi * p[1]
    return -p[0] * pulled(strut.height - z[0], strut.rate - z[1], w, p[2], 1.0 - p[3])


EFFECT = Effect(
    id="bellows_mode",
    summary="a resonance of the bellows' own mass inside the strut",
    sites=ENDS,
    places=("{end}_force",),
    elsewhere=("body_heave", "road_input"),
    always=True,
    parameters=(
        EffectParameter("mode_mass", "kg", 0.0, 2.0, 0.15, size=True, meaning="mass of the part that swings"),
        EffectParameter(
            "mode_frequency", "Hz", 3.0, 40.0, 15.0, starts=(8.0, 12.0, 28.0), meaning="frequency at which it rings"
        ),
        EffectParameter(
            "mode_damping_ratio", "1", 0.01, 0.25, 0.08, meaning="damping of the ringing, 1 would be critical"
        ),
        EffectParameter(
            "wall_share",
            "1",
            0.0,
            1.0,
            0.5,
            ends=(0.0, 1.0),
            meaning="share of that damping that is the wall's own stretching",
        ),
    ),
    term=PlantTerm(states=2, start=start, advance=advance, force=force),
    guide=Guide(
        meaning="The bellows' own mass swings inside the strut: force and motion have a narrow resonance.",
        check=(
            "log the LVDTs with the rig at rest and tap the bellows: they ring at about {mode_frequency}, each "
            "swing smaller than the last one; a clamp on the bellows changes that frequency"
        ),
        mistaken_for={"tyre_damping": "changes wheel hop's height but rings at no frequency of its own"},
    ),
)
