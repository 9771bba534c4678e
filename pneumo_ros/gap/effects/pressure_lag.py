"""A pressure sensor at the end of a tube, or slow in itself: first order lag."""

from __future__ import annotations

from pneumo_ros.gap.effects.base import PRESSURES_OR_BOTH, Array, Effect, Values
from pneumo_ros.gap.effects.filters import first_order_line
from pneumo_ros.gap.model import EffectParameter


def outputs(outputs: Array, period: float, channels: tuple[int, ...], values: Values) -> Array:
    """What the sensor reports."""
    for channel in channels:
        outputs[:, channel] = first_order_line(outputs[:, channel], period, values[0])
    return outputs


EFFECT = Effect(
    id="pressure_lag",
    summary="a pressure sensor reports late",
    sites=PRESSURES_OR_BOTH,
    places=(),
    parameters=(EffectParameter("sensor_lag", "s", 0.0, 0.2, 0.008, size=True, starts=(0.03,)),),
    outputs=outputs,
)
