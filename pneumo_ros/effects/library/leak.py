# SPDX-License-Identifier: Apache-2.0
"""Air leaks from a spring to the atmosphere through an opening that no valve commands.

Law 0 is a hole (Eq. 4.11), law 1 a long narrow gap (the laminar mass flow of a gas grows with (P^2 - Pa^2)/T); between
them a blend.
The area is that of the hole with the same flow at a reference pressure. No tolerance of the outlet valve scales it.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

import math

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS, Effect
from pneumo_ros.effects.expected import FALL
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.hooks import Air
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.laws.flow import alike_at, gap_over_hole
from pneumo_ros.units import ATMOSPHERE, GAS_CONSTANT

REFERENCE = 3e5  # Pa absolute
LAMINAR = alike_at(REFERENCE, ATMOSPHERE)

Values = tuple[float, float]


@njit(cache=True, error_model="numpy")
def air(air: Air, z: tuple[float, ...], p: Values) -> float:
    """Pressure rate of the air lost."""
    # The hole's flow holds P and 1/sqrt(T).
    cold = math.sqrt(air.supply_temperature / air.temperature)
    gap = gap_over_hole(air.pressure, ATMOSPHERE, LAMINAR) * cold
    flow = p[0] * air.escape * (1.0 + p[1] * (gap - 1.0))
    return -air.exponent * GAS_CONSTANT * air.temperature * flow / air.volume


EFFECT = Effect(
    id="leak",
    summary="the spring or its fittings leak to the atmosphere",
    sites=ENDS,
    places=("{end}_air",),
    elsewhere=("front_air-rear_air", "{end}_air-later"),
    parameters=(
        EffectParameter(
            "leak_area", "m2", 0.0, 5e-6, 2e-7, size=True, meaning="area of the hole with the same flow at 3 bar"
        ),
        EffectParameter("leak_law", "1", 0.0, 1.2, 0.6, meaning="0 a hole, 1 a long narrow gap"),
    ),
    term=PlantTerm(air=air),
    guide=Guide(
        meaning="The spring, a fitting or the closed outlet lets air out.",
        check=(
            "block the body at design height, fill the spring to 3 bar absolute, close all valves and log the "
            "pressure: it falls by {fall} at first; soap water shows the place, a hole of {leak_area}"
        ),
        expects={"fall": FALL},
        mistaken_for={
            "supply_droop": "happens only while air is drawn",
            "orifice_coefficient": "acts only through open valves",
        },
    ),
)
