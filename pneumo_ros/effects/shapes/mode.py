# SPDX-License-Identifier: Apache-2.0
"""What a moving part of the bellows may do beside the library's law: swing against the ground, weigh, and stiffen.

A part of mass m hangs by springs on r = (1 - o) h + o y, between the strut's height h and the point y half-way between
body and axle: q'' = w^2 e (1 + s e^2) + 2 zeta w ((1 - g) r' - q') with e = r - q. The body gets 1 - o/2 and the axle
3 o/2 - 1 of -m (w^2 e (1 + s e^2) + 2 zeta w (1 - g) (r' - q')), each half of what the part weighs beyond the
nominal masses; both are the force along r, by virtual work. The share g of the damping is against the ground, the rest
acts between part and plates. The law of :mod:`pneumo_ros.effects.library.bellows_mode` holds the part inside the strut
(o = 0), where its inertia pushes the plates apart, on a spring of constant stiffness (s = 0; Duffing 1918 for others).
No cone: frequency, damping, place and stiffening are fitted as well.

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
Values = tuple[float, float, float, float, float, float, float]


@njit(cache=True, error_model="numpy", inline="always")
def _hung(height: float, middle: float, outside: float) -> float:
    """What the part hangs on, m, from the strut's ``height`` and the ``middle`` between body and axle, of which it has
    the share ``outside``; or how fast, m/s, from their rates.
    """
    return (1.0 - outside) * height + outside * middle


@njit(cache=True, error_model="numpy")
def start(strut: Strut, air: Air, tyre: Tyre, p: Values) -> State:
    """Where the part is and how fast: with its plates."""
    return _hung(strut.height, strut.middle, p[5]), _hung(strut.rate, strut.middle_rate, p[5])


@njit(cache=True, error_model="numpy")
def advance(z: State, strut: Strut, air: Air, tyre: Tyre, dt: float, p: Values) -> State:
    """Exact damped oscillation about plates that move at held speed, half a step behind them as every term; what its
    spring stiffens by is an impulse at the end of the step.
    """
    w, to = 2.0 * math.pi * p[1], _hung(strut.height, strut.middle, p[5])
    rate = _hung(strut.rate, strut.middle_rate, p[5])
    q, v = swung(z[0], z[1], to, rate, w, p[2], p[4], dt)
    stretch = to + 0.5 * dt * rate - q
    return q, v + dt * w * w * p[6] * stretch * stretch * stretch


@njit(cache=True, error_model="numpy", inline="always")
def _pull(to: float, rate: float, z: State, p: Values) -> float:
    """N with which the part pulls towards itself what it hangs on, which is at ``to``, m, and has the ``rate``, m/s."""
    w, stretch = 2.0 * math.pi * p[1], to - z[0]
    stiffer = w * w * p[6] * stretch * stretch * stretch
    return p[0] * (pulled(stretch, rate - z[1], w, p[2], 1.0 - p[4]) + stiffer)


@njit(cache=True, error_model="numpy")
def force(strut: Strut, z: State, p: Values) -> float:
    """On the body, and as a spring's its opposite on the axle."""
    to, rate = _hung(strut.height, strut.middle, p[5]), _hung(strut.rate, strut.middle_rate, p[5])
    return -((1.0 - 0.5 * p[5]) * _pull(to, rate, z, p) + 0.5 * p[3])


@njit(cache=True, error_model="numpy")
def tyre(tyre: Tyre, z: State, p: Values) -> float:
    """On the axle: its own share, and what :func:`force` has taken from it."""
    to, rate = _hung(tyre.height, tyre.middle, p[5]), _hung(tyre.height_rate, tyre.middle_rate, p[5])
    return -(p[5] * _pull(to, rate, z, p) + p[3])


EFFECTS = (
    Effect(
        id="bellows_mode.shape",
        summary="a moving part of the bellows of any law: it may swing against the ground, weigh, and stiffen",
        sites=ENDS,
        places=("{end}_force", "{end}_tyre"),
        parameters=(
            EffectParameter("hanging_mass", "kg", 0.0, 2.0, 0.15, size=True, spread=SPREAD),
            EffectParameter("mode_frequency", "Hz", 3.0, 40.0, 15.0, starts=(6.0, 9.0, 12.0, 20.0, 28.0)),
            EffectParameter("mode_damping_ratio", "1", 0.01, 0.25, 0.08),
            EffectParameter("weight", "N", -20.0, 20.0, 2.0, size=True, spread=SPREAD),
            EffectParameter("ground_share", "1", 0.0, 1.0, 0.5, ends=(0.0, 1.0)),
            EffectParameter("outside", "1", 0.0, 1.0, 1.0, ends=(0.0, 1.0), starts=(0.0,)),
            EffectParameter("stiffening", "1/m2", 0.0, 1e6, 2e4),
        ),
        term=PlantTerm(states=2, start=start, advance=advance, force=force, tyre=tyre),
        screened=(0,),
    ),
)
