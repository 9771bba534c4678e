# SPDX-License-Identifier: Apache-2.0
"""The bellows' effective area differs from the table, in size and in its slope over height.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS, Effect
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.hooks import Strut
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.units import INCH

MIDDLE = 1.8 * INCH  # m, the design height of Table 4.2: where the slope turns about
Values = tuple[float, float]


@njit(cache=True, error_model="numpy")
def force(strut: Strut, z: tuple[float, ...], p: Values) -> float:
    """N upwards on the body: gauge pressure times the difference of the effective area from the table's."""
    return strut.gauge * strut.area * (p[0] + p[1] * (strut.height - MIDDLE) / MIDDLE)


EFFECT = Effect(
    id="effective_area_error",
    summary="the effective area surface is off by a factor, or leans over height",
    sites=ENDS,
    places=("{end}_force",),
    elsewhere=("body_heave", "body_pitch"),
    parameters=(
        EffectParameter(
            "area_error",
            "1",
            -0.4,
            0.4,
            0.04,
            size=True,
            starts=(-0.04,),
            meaning="error of the effective area at mid height, as a share",
        ),
        EffectParameter(
            "area_slope_error",
            "1",
            -1.5,
            1.5,
            0.1,
            size=True,
            starts=(-0.1,),
            meaning="how that error grows with the height, per mid height",
        ),
    ),
    term=PlantTerm(force=force),
    guide=Guide(
        meaning="The bellows' effective area is not the table's: by a factor, or leaning over height.",
        check=(
            "level the rig, read both gauges, weigh each axle: load over gauge pressure differs from the table by"
            " {area_error}; repeat 5 mm higher and lower for the slope"
        ),
        mistaken_for={
            "payload": "changes front and rear by the load's place, not by the spring",
            "pressure_scale": "compare the gauge with a second one first",
        },
    ),
)
