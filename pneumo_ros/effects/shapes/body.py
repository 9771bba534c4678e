# SPDX-License-Identifier: Apache-2.0
"""What comes with a load, or with a shifted centre of mass: inertia, and the other of the two.

A load lies somewhere: it brings m r^2 of pitch inertia with it and moves the centre of mass towards itself. A part that
was moved along the body changes both as well.
"""

from __future__ import annotations

from pneumo_ros.effects.contract import RIG, Effect, Ends, Plant, Values
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.effects.shapes.atoms import SPREAD

PLACES = ("body_pitch", "body_heave")
INERTIA = EffectParameter("added_inertia", "kg m2", -2.0, 4.0, 0.1, size=True, spread=SPREAD)


def loaded(plant: Plant, ends: Ends, values: Values) -> Plant:
    """Adds the load's inertia, and shifts the centre of mass."""
    inertia, shift = values
    body = plant.body
    return plant._replace(
        body=body._replace(
            pitch_inertia=max(body.pitch_inertia + inertia, 0.1 * body.pitch_inertia),
            front_arm=body.front_arm - shift,
            rear_arm=body.rear_arm + shift,
        )
    )


def turned(plant: Plant, ends: Ends, values: Values) -> Plant:
    """Adds pitch inertia only, kg m2, and no mass."""
    return loaded(plant, ends, (values[0], 0.0))


EFFECTS = (
    Effect(
        id="payload.shape",
        summary="a load of any shape anywhere on the body: inertia and a shift of the centre come with it",
        sites=RIG,
        places=PLACES,
        parameters=(INERTIA, EffectParameter("shift_forward", "m", -0.05, 0.05, 0.004, size=True, spread=SPREAD)),
        plant=loaded,
    ),
    Effect(
        id="cg_shift.shape",
        summary="a heavy part that was moved: pitch inertia changes with the centre of mass",
        sites=RIG,
        places=PLACES,
        parameters=(INERTIA,),
        plant=turned,
    ),
)
