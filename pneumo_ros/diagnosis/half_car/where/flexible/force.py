# SPDX-License-Identifier: Apache-2.0
"""Shapes of an error in a spring's force (area, friction, damping, hysteresis, stops)."""

from __future__ import annotations

from typing import Final

import numpy as np

from pneumo_ros.diagnosis.half_car.where.features import Features, dragged, lagged, resonated
from pneumo_ros.diagnosis.half_car.where.flexible.basis import Basis

FRICTION: Final = 10.0  # N, size of a friction shape [numerics]
STIFFNESS: Final = 2000.0  # N/m, size of an elastic shape [numerics]
DAMPING: Final = 100.0  # N s/m, size of a damping shape [numerics]
SPEEDS: Final = (0.005, 0.02, 0.06, 0.2)  # m/s at which friction saturates [taste]
SLACKS: Final = (5e-5, 3e-4, 1.5e-3)  # m of creep before slip [taste]
MEMORIES: Final = (0.02, 0.1, 0.5)  # s, of a force that relaxes [taste]
# rad/s of a bellows mode: between the body's frequency and what a window passes [physics]
MODES: Final = (40.0, 60.0, 80.0, 100.0, 130.0, 170.0)


def force_bases(features: Features, i: int) -> list[Basis]:
    """Spring force at end ``i`` (0 front, 1 rear), N, up on the body."""
    end, dt = features.ends[i], features.period
    x, v = end.travel, end.travel_rate
    load = end.gauge / features.yardstick.gauge[i]
    shapes = {f"friction {s:g} m/s": FRICTION * np.tanh(v / s) for s in SPEEDS}
    shapes |= {
        "damping": DAMPING * v,
        "quadratic damping": 5.0 * DAMPING * v * np.abs(v),
        "rebound damping": DAMPING * np.maximum(v, 0.0),
        "stiffness": STIFFNESS * x,
        "stiffness 2": 100.0 * STIFFNESS * x**2,
        "stiffness 3": 1e4 * STIFFNESS * x**3,
        "constant": np.full_like(x, FRICTION),
        "load friction": FRICTION * load * np.tanh(v / 0.02),
        "load damping": DAMPING * load * v,
        "load": 2.0 * FRICTION * (load - 1.0),
        "load 2": 10.0 * FRICTION * (load - 1.0) ** 2,
        "load stiffness": STIFFNESS * (load - 1.0) * x,
    }
    shapes |= {f"relaxation {m:g} s": STIFFNESS * (x - lagged(x, m, dt)) for m in MEMORIES}
    shapes |= {f"creep {s:g} m": FRICTION * dragged(x, s) for s in SLACKS}
    shapes |= {f"mode {w:g} rad/s": 0.25 * STIFFNESS * (resonated(x, w, 0.1, dt) - x) for w in MODES}
    place = f"{('front', 'rear')[i]}_force"
    return [Basis(place, name, "force", i, series) for name, series in shapes.items()]
