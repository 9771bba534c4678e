"""The tyre's rubber damps: a viscous force beside its stiffness (the thesis neglects it)."""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS, Effect
from pneumo_ros.effects.hooks import Tyre
from pneumo_ros.effects.parameters import EffectParameter


@njit(cache=True, error_model="numpy")
def tyre(tyre: Tyre, z: tuple[float, ...], p: tuple[float]) -> float:
    """Damping of the compression's rate."""
    return p[0] * tyre.rate


EFFECT = Effect(
    id="tyre_damping",
    summary="viscous damping of the tyre",
    sites=ENDS,
    places=("{end}_tyre",),
    parameters=(EffectParameter("tyre_damping", "N s/m", 0.0, 500.0, 20.0, size=True),),
    term=PlantTerm(tyre=tyre),
)
