# SPDX-License-Identifier: Apache-2.0
"""What comes with a load, or with a shifted centre of mass: inertia, and the other of the two.

A load lies somewhere: it brings m r^2 of pitch inertia with it and moves the centre of mass towards itself. A part that
was moved along the body changes both as well. What lies above the axis of pitch tips further the way the body pitches,
by m g h a radian, and so does a liquid's free surface, by rho g I of its waterplane a radian (Tupper 2013,
"Introduction to Naval Architecture"). Written as forces on the body above the axles, downwards where it is
the lower: k (z_f - z_r) with the heights z from the first instant on, which is k L^2 a radian for a wheelbase L.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import RIG, Effect, Ends, Plant, Values
from pneumo_ros.effects.hooks import Strut
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.effects.shapes.atoms import SPREAD
from pneumo_ros.effects.shapes.outside import kept

PLACES = ("body_pitch", "body_heave")
INERTIA = EffectParameter("added_inertia", "kg m2", -2.0, 4.0, 0.1, size=True, spread=SPREAD)
SHIFT = EffectParameter("shift_forward", "m", -0.05, 0.05, 0.004, size=True, spread=SPREAD)
# Tips only: what rights the body is held from outside or by a bar, and has ceilings of its own (shapes/outside.py).
TIPPING = EffectParameter("tipping", "N/m", 0.0, 5e3, 50.0, size=True, spread=SPREAD)


@njit(cache=True, error_model="numpy", inline="always")
def _raised(front: Strut, rear: Strut) -> float:
    """How much higher the body stands above the front axle than above the rear one, m."""
    return front.middle + 0.5 * front.height - rear.middle - 0.5 * rear.height


@njit(cache=True, error_model="numpy")
def start_level(front: Strut, rear: Strut, p: Values) -> tuple[float]:
    """The body as it stands at the first instant."""
    return (_raised(front, rear),)


@njit(cache=True, error_model="numpy")
def tip(front: Strut, rear: Strut, z: tuple[float], p: Values) -> tuple[float, float]:
    """Upwards on the body where it stands higher, downwards where lower."""
    push = p[2] * (_raised(front, rear) - z[0])
    return push, -push


TERM = PlantTerm(states=1, start=start_level, advance=kept, body=tip, shared=True)


def loaded(plant: Plant, ends: Ends, values: Values) -> Plant:
    """Adds the load's inertia, and shifts the centre of mass."""
    inertia, shift, *_ = values
    body = plant.body
    return plant._replace(
        body=body._replace(
            pitch_inertia=max(body.pitch_inertia + inertia, 0.1 * body.pitch_inertia),
            front_arm=body.front_arm - shift,
            rear_arm=body.rear_arm + shift,
        )
    )


def turned(plant: Plant, ends: Ends, values: Values) -> Plant:
    """Adds pitch inertia, kg m2, and no mass."""
    return loaded(plant, ends, (values[0], 0.0))


EFFECTS = (
    Effect(
        id="payload.shape",
        summary="a load of any shape anywhere on the body: inertia, a shift of the centre and tipping come with it",
        sites=RIG,
        places=PLACES,
        parameters=(INERTIA, SHIFT, TIPPING),
        plant=loaded,
        term=TERM,
        slot="load",
        columns=(0, 1, 2),
    ),
    Effect(
        id="cg_shift.shape",
        summary="a heavy part that was moved or moves: pitch inertia changes with the centre of mass, and it may tip",
        sites=RIG,
        places=PLACES,
        parameters=(INERTIA, TIPPING),
        plant=turned,
        term=TERM,
        slot="load",
        columns=(0, 2),
        screened=(1,),
    ),
)
