# SPDX-License-Identifier: Apache-2.0
"""Shapes of an error in a measured channel (offset, scale, lag, curvature)."""

from __future__ import annotations

from typing import Final

import numpy as np

from pneumo_ros.diagnosis.half_car.signals import MEASURED
from pneumo_ros.diagnosis.half_car.where.features import Features, lagged
from pneumo_ros.diagnosis.half_car.where.flexible.basis import Basis

LAGS: Final = (0.005, 0.02, 0.08)  # s; the last one for gauge lines [taste]
SHARE: Final = 0.1  # share of a channel's swing that a shape of size one stands for [numerics]


def sensor_bases(features: Features) -> list[Basis]:
    """What to add to a measured channel to undo its error, in the channel's unit."""
    out = []
    for column, channel in enumerate(MEASURED):
        size = features.yardstick.channel_scale[column]
        swing = features.smooth[:, column] - features.yardstick.channel_mean[column]
        shapes = {
            "offset": np.full_like(swing, SHARE * size),
            "scale": SHARE * swing,
            "curvature": SHARE * (swing**2 / size - size),
            "drift": SHARE * size * features.time / 10.0,
        }
        shapes |= {f"lag {t:g} s": swing - lagged(swing, t, features.period) for t in LAGS}
        out += [Basis(f"sensor:{channel}", name, "sensor", column, series) for name, series in shapes.items()]
    return out
