# SPDX-License-Identifier: Apache-2.0
"""The tyre's rubber damps: a viscous force beside its stiffness (the thesis neglects it).

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS, Effect
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.hooks import Tyre
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.laws.damping import linear


@njit(cache=True, error_model="numpy")
def tyre(tyre: Tyre, z: tuple[float, ...], p: tuple[float]) -> float:
    """Damping of the compression's rate."""
    return linear(tyre.rate, p[0])


EFFECT = Effect(
    id="tyre_damping",
    summary="viscous damping of the tyre",
    sites=ENDS,
    places=("{end}_tyre",),
    elsewhere=("body_heave", "body_pitch"),
    parameters=(
        EffectParameter(
            "tyre_damping", "N s/m", 0.0, 500.0, 20.0, size=True, meaning="force of the rubber for each m/s"
        ),
    ),
    term=PlantTerm(tyre=tyre),
    guide=Guide(
        meaning="The tyre takes energy by itself.",
        check=(
            "fix the body, push the axle down on the tyre, let go and log its LVDT: of two swings a and b that "
            "follow each other T apart, 2 m ln(a/b) / T is the strut's own damping (bushing_damping of the rig "
            "file) plus {tyre_damping}; m is the axle's mass"
        ),
        mistaken_for={
            "viscous_damping": "is gone when the body moves with the axle",
            "exciter_lag": "smooths the road under a stiff tyre too",
        },
    ),
)
