# SPDX-License-Identifier: Apache-2.0
"""Shapes of an error in a tyre's force (stiffness, damping, lift-off, hysteresis)."""

from __future__ import annotations

from typing import Final

import numpy as np

from pneumo_ros.diagnosis.half_car.where.features import Features, lagged
from pneumo_ros.diagnosis.half_car.where.flexible.basis import Basis

STIFFNESS: Final = 1000.0  # N/m, size of an elastic shape [numerics]
DAMPING: Final = 20.0  # N s/m, size of a damping shape [numerics]
LAGS: Final = (0.005, 0.02, 0.1)  # s, of a force that relaxes [taste]


def tyre_bases(features: Features, i: int) -> list[Basis]:
    """Force of the tyre at end ``i`` (0 front, 1 rear), N, up on the axle."""
    end, dt = features.ends[i], features.period
    squeeze, rate = end.squeeze, end.squeeze_rate
    x = squeeze - features.yardstick.squeeze[i]
    shapes = {
        "stiffness": STIFFNESS * x,
        "damping": DAMPING * rate,
        "stiffness 2": 100.0 * STIFFNESS * x**2,
        "stiffness 3": 1e4 * STIFFNESS * x**3,
        "lift-off": STIFFNESS * np.maximum(-squeeze, 0.0),
        "constant": np.full_like(x, 10.0),
    }
    shapes |= {f"relaxation {t:g} s": STIFFNESS * (x - lagged(x, t, dt)) for t in LAGS}
    shapes |= {f"friction {s:g} m/s": 10.0 * np.tanh(rate / s) for s in (0.02, 0.2)}
    place = f"{('front', 'rear')[i]}_tyre"
    return [Basis(place, name, "axle", i, series) for name, series in shapes.items()]
