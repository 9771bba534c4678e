"""The discharge coefficient of an end's orifices differs from the nominal by more than its tolerance (Eq. 4.7)."""

from __future__ import annotations

from pneumo_ros.gap.effects.base import ENDS, Effect, Ends, Plant, Values, with_gas
from pneumo_ros.gap.model import EffectParameter


def plant(plant: Plant, ends: Ends, values: Values) -> Plant:
    """Scales inlet and outlet alike."""
    f = 1.0 + values[0]
    return with_gas(plant, ends, lambda g: g._replace(inlet_scale=g.inlet_scale * f, outlet_scale=g.outlet_scale * f))


EFFECT = Effect(
    id="orifice_coefficient",
    summary="discharge coefficient of inlet and outlet off by a factor",
    sites=ENDS,
    places=("{end}_air",),
    parameters=(EffectParameter("coefficient_error", "1", -0.7, 1.0, 0.08, size=True, starts=(-0.08,)),),
    plant=plant,
)
