# SPDX-License-Identifier: Apache-2.0
"""Shapes of an error in a spring's air balance (valve, orifices, leak, heat, volume), as mass flow into the spring."""

from __future__ import annotations

from typing import Final

import numpy as np

from pneumo_ros.diagnosis.half_car.where.features import Features, lagged, resonated
from pneumo_ros.diagnosis.half_car.where.flexible.basis import Basis

LAGS: Final = (0.004, 0.012, 0.03, 0.1)  # s, of the valve [taste]
VALVES: Final = (150.0, 50.0)  # rad/s, natural frequency of the valve [taste]
MEMORIES: Final = (0.1, 0.5, 2.0)  # s of heat exchange [taste]
SHARE: Final = 0.1  # share of the flow that a shape of size one stands for [numerics]


def air_bases(features: Features, i: int) -> list[Basis]:
    """Air let into the spring at end ``i`` (0 front, 1 rear), kg/s."""
    end, dt = features.ends[i], features.period
    opening, flow, size = end.inlet, end.per_inlet, features.yardstick
    usual, pressure = size.flow[i], size.pressure[i]
    low, middle, high = size.openings[i]
    swing = max(high - low, 1e-9)
    shapes = {
        "inlet": SHARE * flow * opening,
        "leak": SHARE * usual * end.per_outlet / size.per_outlet[i],
        "closed inlet": SHARE * usual * flow / size.per_inlet[i],
        "volume": SHARE * end.mass * end.travel_rate / 0.05,
        "compression": SHARE * end.mass * end.pressure_rate / end.pressure,
        "warmth": usual * end.warmth,
        "constant": np.full_like(flow, SHARE * usual),
        "pressure": usual * (end.pressure / pressure - 1.0),
        "height": usual * end.travel / 5e-3 * SHARE,
        "other valve": SHARE * flow * (features.ends[1 - i].inlet - size.openings[1 - i][1]),
        "cross flow": usual * (end.other_pressure - end.pressure) / pressure,
        "drift": SHARE * usual * features.time / 10.0,
    }
    shapes |= {f"valve lag {t:g} s": flow * (lagged(opening, t, dt) - opening) for t in LAGS}
    shapes |= {f"valve mode {w:g} rad/s": flow * (resonated(opening, w, 0.8, dt) - opening) for w in VALVES}
    shapes |= {f"corner {k}": flow * np.minimum(opening, corner) for k, corner in enumerate((low, middle, high))}
    shapes["opening 2"] = SHARE * flow * (opening - middle) ** 2 / swing
    shapes["outlet"] = SHARE * end.per_outlet * end.outlet
    shapes |= {f"heat {m:g} s": usual * (end.pressure - lagged(end.pressure, m, dt)) / pressure
               for m in MEMORIES}  # fmt: skip
    place = f"{('front', 'rear')[i]}_air"
    return [Basis(place, name, "air", i, series) for name, series in shapes.items()]
