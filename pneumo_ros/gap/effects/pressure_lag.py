"""A pressure sensor at the end of a tube, or slow in itself: first order lag."""

from __future__ import annotations

from pneumo_ros.gap.effects.base import PRESSURES_OR_BOTH, Array, Effect, Memory, Values, by_column
from pneumo_ros.gap.effects.filters import first_order_line
from pneumo_ros.gap.model import EffectParameter


def outputs(
    outputs: Array, period: float, channels: tuple[int, ...], values: Values, memory: Memory
) -> tuple[Array, Memory]:
    """What the sensor reports."""
    return by_column(lambda u, kept: first_order_line(u, period, values[0], kept), outputs, channels, memory)


EFFECT = Effect(
    id="pressure_lag",
    summary="a pressure sensor reports late",
    sites=PRESSURES_OR_BOTH,
    places=(),
    parameters=(EffectParameter("sensor_lag", "s", 0.0, 0.2, 0.008, size=True, starts=(0.03,)),),
    outputs=outputs,
)
