# SPDX-License-Identifier: Apache-2.0
"""The discharge coefficient of an end's orifices differs from the nominal by more than its tolerance (Eq. 4.7).

A sharp-edged orifice's coefficient falls as the flow unchokes, from 0.84 at a deep vacuum downstream to 0.6 for a small
pressure drop (Perry, Trans. ASME 71, 1949; Eq. 4.7 has a constant), so that an error has a slope over the ratio of the
pressures. The outlet may share the inlet's error or have none of it: they are two valves.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS, Effect
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.hooks import Air
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.laws.flow import in_excess
from pneumo_ros.units import ATMOSPHERE, GAS_CONSTANT

MIDDLE = 0.5  # ratio of downstream to upstream pressure at which the error is stated

Values = tuple[float, float, float]


@njit(cache=True, error_model="numpy")
def air(air: Air, z: tuple[float, ...], p: Values) -> float:
    """Pressure rate of the flow in excess."""
    inlet = in_excess(air.inflow, p[0], p[1], air.pressure / air.supply - MIDDLE)
    flow = inlet - in_excess(air.outflow, p[0] * p[2], p[1], ATMOSPHERE / air.pressure - MIDDLE)
    return air.exponent * GAS_CONSTANT * air.temperature * flow / air.volume


EFFECT = Effect(
    id="orifice_coefficient",
    summary="discharge coefficient of inlet and outlet off by a factor",
    sites=ENDS,
    places=("{end}_air",),
    elsewhere=("front_air-rear_air", "{end}_air-later"),
    parameters=(
        EffectParameter(
            "coefficient_error",
            "1",
            -0.7,
            1.0,
            0.08,
            size=True,
            starts=(-0.08,),
            meaning="error of the inlet's flow at a pressure ratio of 0.5",
        ),
        EffectParameter(
            "ratio_slope", "1", -2.0, 2.0, 0.5, starts=(-0.5,), meaning="how that error grows with the pressure ratio"
        ),
        EffectParameter(
            "outlet_share", "1", -0.2, 1.2, 0.5, starts=(0.0,), meaning="share of the error that the outlet has as well"
        ),
    ),
    term=PlantTerm(air=air),
    guide=Guide(
        meaning="Inlet and outlet pass more or less air than their opening says: another discharge coefficient.",
        check=(
            "hold one inlet open by a known command with the outlet closed and time the fill from 1.5 to 3 bar: "
            "the time is off by {coefficient_error}"
        ),
        mistaken_for={
            "leak": "empties the spring with all valves closed",
            "dead_volume": "makes filling and emptying slow by the same factor, with the valves' flow unchanged",
        },
    ),
)
