# SPDX-License-Identifier: Apache-2.0
"""A bump stop that meets the strut earlier, or pushes harder, than the nominal one.

The law is :func:`pneumo_ros.laws.contact.stop` over the depth below the height of contact; its loss grows with the rate
of the height.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS, Effect
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.hooks import Strut
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.laws.contact import stop
from pneumo_ros.plant.half_car import BUMP_STOP_HEIGHT

Values = tuple[float, float, float, float]


@njit(cache=True, error_model="numpy")
def force(strut: Strut, z: tuple[float, ...], p: Values) -> float:
    """N upwards on the body, below the height of contact; never negative."""
    depth = max(0.0, BUMP_STOP_HEIGHT + p[1] - strut.height)
    return stop(depth, p[0], p[2], -p[3] * strut.rate)


EFFECT = Effect(
    id="bump_stop",
    summary="the bump stop acts earlier or harder than modelled",
    sites=ENDS,
    places=("{end}_force",),
    elsewhere=("body_heave", "body_pitch"),
    parameters=(
        EffectParameter(
            "stop_stiffness", "N/m", 0.0, 1e6, 2e4, size=True, starts=(1e5,), meaning="stiffness at the first touch"
        ),
        EffectParameter(
            "stop_lead",
            "m",
            0.0,
            0.014,
            0.004,
            starts=(0.008, 0.012, 0.001),
            meaning="how much earlier the strut meets it than the nominal stop",
        ),
        EffectParameter("stop_hardening", "1/m", 0.0, 1e4, 100.0, meaning="growth of the stiffness with the depth"),
        EffectParameter(
            "stop_damping", "s/m", 0.0, 2.0, 0.2, meaning="loss: growth of the push with the speed inwards"
        ),
    ),
    term=PlantTerm(force=force),
    guide=Guide(
        meaning="The bump stop is touched earlier, or is harder, than modelled.",
        check=(
            "push the body down slowly with a force gauge and a ruler at the strut: the stop is met earlier than "
            "the rig file has it, by {stop_lead}, and from there on the force rises by {stop_stiffness}"
        ),
        mistaken_for={"effective_area_error": "acts at all heights, a stop only below one"},
    ),
)
