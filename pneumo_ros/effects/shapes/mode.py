# SPDX-License-Identifier: Apache-2.0
"""What a moving part of the bellows may do beside the library's law: swing against the ground, and weigh.

A part of mass m that hangs between both plates by springs: q'' = w^2 (h - q) + 2 zeta w ((1 - g) h' - q'), with h
half-way between body and axle; each plate gets half of -m (w^2 (h - q) + 2 zeta w (1 - g) (h' - q')) and of what it
weighs beyond the nominal masses. The share g of the damping is against the ground, the rest acts between part and
plates. The law of :mod:`pneumo_ros.effects.library.bellows_mode` holds the part inside the strut, where its inertia
pushes the plates apart; the real ones are anything between the two. No cone: frequency and damping are fitted as well.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

import math

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS, Effect
from pneumo_ros.effects.hooks import Air, Strut, Tyre
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.effects.shapes.atoms import SPREAD
from pneumo_ros.laws.ringing import pulled, swung

State = tuple[float, float]
Values = tuple[float, float, float, float, float]


@njit(cache=True, error_model="numpy")
def start(strut: Strut, air: Air, tyre: Tyre, p: Values) -> State:
    """Where the part is and how fast: with its plates."""
    return (strut.middle, strut.middle_rate)


@njit(cache=True, error_model="numpy")
def advance(z: State, strut: Strut, air: Air, tyre: Tyre, dt: float, p: Values) -> State:
    """Exact damped oscillation about plates that move at held speed; half a step behind them, as every term."""
    return swung(z[0], z[1], strut.middle, strut.middle_rate, 2.0 * math.pi * p[1], p[2], p[4], dt)


@njit(cache=True, error_model="numpy", inline="always")
def _on_each(middle: float, rate: float, z: State, p: Values) -> float:
    """N upwards on each plate; ``middle`` between the plates, m, and its ``rate``, m/s."""
    w = 2.0 * math.pi * p[1]
    return 0.5 * (p[0] * pulled(z[0] - middle, z[1] - rate, w, p[2], 1.0 - p[4]) - p[3])


@njit(cache=True, error_model="numpy")
def force(strut: Strut, z: State, p: Values) -> float:
    """On the body, and as a spring's its opposite on the axle."""
    return _on_each(strut.middle, strut.middle_rate, z, p)


@njit(cache=True, error_model="numpy")
def tyre(tyre: Tyre, z: State, p: Values) -> float:
    """On the axle: its own share, and what :func:`force` has taken from it."""
    return 2.0 * _on_each(tyre.middle, tyre.middle_rate, z, p)


EFFECTS = (
    Effect(
        id="bellows_mode.shape",
        summary="a moving part of the bellows of any law: it may swing against the ground, and weigh",
        sites=ENDS,
        places=("{end}_force", "{end}_tyre"),
        parameters=(
            EffectParameter("hanging_mass", "kg", 0.0, 2.0, 0.15, size=True, spread=SPREAD),
            EffectParameter("mode_frequency", "Hz", 3.0, 40.0, 15.0, starts=(6.0, 9.0, 12.0, 20.0, 28.0)),
            EffectParameter("mode_damping_ratio", "1", 0.01, 0.25, 0.08),
            EffectParameter("weight", "N", -20.0, 20.0, 2.0, size=True, spread=SPREAD),
            EffectParameter("ground_share", "1", 0.0, 1.0, 0.5, ends=(0.0, 1.0)),
        ),
        term=PlantTerm(states=2, start=start, advance=advance, force=force, tyre=tyre),
        screened=(0,),
    ),
)
