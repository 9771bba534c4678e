"""A bump stop that meets the strut earlier, or pushes harder, than the nominal one."""

from __future__ import annotations

from numba import njit

from pneumo_ros.gap.compose import PlantTerm
from pneumo_ros.gap.effects.base import ENDS, Effect
from pneumo_ros.gap.kernel_parts import Strut
from pneumo_ros.gap.model import EffectParameter
from pneumo_ros.plant.half_car import BUMP_STOP_HEIGHT

Values = tuple[float, float]


@njit(cache=True, error_model="numpy")
def force(strut: Strut, z: tuple[float, ...], p: Values) -> float:
    """Stiffness below the height of contact, upwards on the body."""
    return p[0] * max(0.0, BUMP_STOP_HEIGHT + p[1] - strut.height)


EFFECT = Effect(
    id="bump_stop",
    summary="the bump stop acts earlier or harder than modelled",
    sites=ENDS,
    places=("{end}_force",),
    parameters=(
        EffectParameter("stop_stiffness", "N/m", 0.0, 1e6, 2e4, size=True, starts=(1e5,)),
        EffectParameter("stop_lead", "m", 0.0, 0.014, 0.004, starts=(0.008, 0.001)),
    ),
    term=PlantTerm(force=force),
)
