# SPDX-License-Identifier: Apache-2.0
"""Shapes of an error in what drives the rig: the road under the tyres, the air supply."""

from __future__ import annotations

from typing import Final

import numpy as np

from pneumo_ros.diagnosis.half_car.where.features import Features, lagged
from pneumo_ros.diagnosis.half_car.where.flexible.basis import Basis

ROAD_LAGS: Final = (0.005, 0.02, 0.06)  # s, of the exciter [taste]
SUPPLY_LAGS: Final = (0.05, 0.3, 2.0)  # s, of the supply [taste]
DROOP: Final = 2e4  # Pa, size of a shape of the supply [numerics]


def road_bases(features: Features) -> list[Basis]:
    """Road heights under both axles, m: one exciter, so lag and scale may differ by axle but belong to one place."""
    out = []
    for i in (0, 1):
        road, rate = features.road[:, i], features.road_rate[:, i]
        spread = features.yardstick.road[i]
        shapes = {
            "scale": 0.1 * road,
            "rate": 0.01 * rate,
            "constant": np.full_like(road, 1e-3),
            "cube": 0.1 * road**3 / spread**2,
            "even": 0.1 * np.abs(road),
        }
        shapes |= {f"lag {t:g} s": lagged(road, t, features.period) - road for t in ROAD_LAGS}
        side = ("front", "rear")[i]
        out += [Basis("road_input", f"{side} {name}", "road", i, series) for name, series in shapes.items()]
    return out


def supply_bases(features: Features) -> list[Basis]:
    """Supply pressure, Pa, as it may sag with the flow drawn from it."""
    front, rear = features.ends
    flow = front.inlet * front.per_inlet + rear.inlet * rear.per_inlet
    drawn = flow / features.yardstick.flow.sum() - 1.0
    shapes = {"constant": np.full_like(drawn, DROOP), "flow": DROOP * drawn}
    shapes |= {f"flow {t:g} s": DROOP * lagged(drawn, t, features.period) for t in SUPPLY_LAGS}
    shapes["drift"] = DROOP * features.time / 10.0
    return [Basis("supply", name, "supply", 0, series) for name, series in shapes.items()]
