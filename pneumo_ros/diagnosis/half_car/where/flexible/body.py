# SPDX-License-Identifier: Apache-2.0
"""Shapes of a force or moment on the body from outside the springs (mass, payload, guide friction)."""

from __future__ import annotations

import numpy as np

from pneumo_ros.diagnosis.half_car.where.features import Features
from pneumo_ros.diagnosis.half_car.where.flexible.basis import Basis


def body_bases(features: Features) -> list[Basis]:
    """Force, N upwards, and moment, N m nose up, on the body."""
    heave = {
        "weight": np.full_like(features.heave, 10.0),
        "inertia": features.heave_acceleration,
        "damping": 100.0 * features.heave_rate,
        "stiffness": 2000.0 * (features.heave - features.yardstick.heave),
        "friction": 10.0 * np.tanh(features.heave_rate / 0.02),
        "fast friction": 10.0 * np.tanh(features.heave_rate / 0.1),
        "coupling": features.pitch_acceleration,
    }
    pitch = {
        "weight": np.full_like(features.pitch, 3.0),
        "inertia": 0.1 * features.pitch_acceleration,
        "damping": 5.0 * features.pitch_rate,
        "stiffness": 100.0 * (features.pitch - features.yardstick.pitch),
        "friction": 3.0 * np.tanh(features.pitch_rate / 0.05),
        "fast friction": 3.0 * np.tanh(features.pitch_rate / 0.3),
        "coupling": 0.3 * features.heave_acceleration,
    }
    return [
        *(Basis("body_heave", name, "heave", 0, series) for name, series in heave.items()),
        *(Basis("body_pitch", name, "pitch", 0, series) for name, series in pitch.items()),
    ]
