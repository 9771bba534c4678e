# SPDX-License-Identifier: Apache-2.0
"""A pressure sensor at the end of a tube, or slow in itself: second order lag, 1/((lag s)^2 + 2 damping lag s + 1).

A short tube rings (damping below one), a long or throttled one creeps like a first order lag (damping well above it).
"""

from __future__ import annotations

from pneumo_ros.arrays import Array
from pneumo_ros.effects.contract import PRESSURES_OR_BOTH, Effect, Memory, Values, by_column
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import Derived, EffectParameter
from pneumo_ros.laws.filters import lagged_line


def outputs(
    outputs: Array, period: float, channels: tuple[int, ...], values: Values, memory: Memory
) -> tuple[Array, Memory]:
    """What the sensor reports."""
    return by_column(lambda u, kept: lagged_line(u, period, values[0], values[1], kept), outputs, channels, memory)


EFFECT = Effect(
    id="pressure_lag",
    summary="a pressure sensor reports late",
    sites=PRESSURES_OR_BOTH,
    places=(),
    elsewhere=("{end}_air",),
    parameters=(
        EffectParameter(
            "sensor_lag", "s", 0.0, 0.2, 0.005, size=True, starts=(0.02,), meaning="time constant of sensor and tube"
        ),
        EffectParameter(
            "sensor_damping_ratio",
            "1",
            0.3,
            5.0,
            0.8,
            starts=(2.0,),
            meaning="below 1 the tube rings, above 2 it creeps",
        ),
    ),
    derived=(Derived("sensor_total_lag", "s", lambda p: 2.0 * p[1] * p[0]),),  # of a slow signal
    outputs=outputs,
    guide=Guide(
        meaning="A pressure sensor reports late: a long thin gauge line, or a filter.",
        check=(
            "open the spring to the atmosphere at one stroke: the body falls at once, the sensor has gone two "
            "thirds of the way after {sensor_lag}; a shorter line cures it"
        ),
        mistaken_for={"valve_lag": "the body is late as well"},
    ),
)
