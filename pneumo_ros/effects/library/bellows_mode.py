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

State = tuple[float, float]
Values = tuple[float, float, float, float]


@njit(cache=True, error_model="numpy")
def start(strut: Strut, air: Air, tyre: Tyre, p: Values) -> State:
    """The mode at rest on the strut."""
    return (strut.height, strut.rate)


@njit(cache=True, error_model="numpy")
def advance(z: State, strut: Strut, air: Air, tyre: Tyre, dt: float, p: Values) -> State:
    """Exact damped oscillation about the strut that moves at held speed."""
    w, zeta = 2.0 * math.pi * p[1], p[2]
    decay, wd = zeta * w, w * math.sqrt(1.0 - zeta * zeta)
    behind = -2.0 * zeta * p[3] * strut.rate / w  # of the strut, at constant speed
    # The strut's position at the state's instant, half a step back: the staggered scheme's second order.
    e0 = z[0] - (strut.height - 0.5 * dt * strut.rate) - behind
    v0 = z[1] - strut.rate
    c, s, fade = math.cos(wd * dt), math.sin(wd * dt), math.exp(-decay * dt)
    e1 = fade * (e0 * c + (v0 + decay * e0) / wd * s)
    v1 = fade * (v0 * c - (decay * v0 + w * w * e0) / wd * s)
    return (e1 + behind + strut.height + 0.5 * dt * strut.rate, v1 + strut.rate)


@njit(cache=True, error_model="numpy")
def force(strut: Strut, z: State, p: Values) -> float:
    """Inertia force of the mode on the strut."""
    w = 2.0 * math.pi * p[1]
    return -p[0] * (w * w * (strut.height - z[0]) + 2.0 * p[2] * w * (1.0 - p[3]) * (strut.rate - z[1]))


EFFECT = Effect(
    id="bellows_mode",
    summary="a resonance of the bellows' own mass inside the strut",
    sites=ENDS,
    places=("{end}_force",),
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
            "tap the bellows with the rig at rest and the LVDTs logged: a ring of about {mode_frequency} that "
            "dies within some periods; a clamp on the bellows moves it"
        ),
        mistaken_for={"tyre_damping": "changes wheel hop's height but rings at no frequency of its own"},
    ),
)
