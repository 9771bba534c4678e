# SPDX-License-Identifier: Apache-2.0
"""The half car as a mechanism: joints from displacements, and where its frames are.

Frames by REP 103: x forwards, y left, z up; ``ground`` is the root. The body heaves and pitches at its centre of mass,
each axle moves up and down by itself: the four degrees of freedom of the model, so a joint is a state of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.rig.parameters import Rig

JOINTS = ("heave", "pitch_nose_up", "unsprung_front", "unsprung_rear")
"""m, rad, m, m; heights upwards from the ground datum. Nose up is a turn about -y."""
MOUNTS = ("front_air_spring", "rear_air_spring", "manifold")
"""Frames fixed to the body: what pressures and valve commands are stamped with."""
LINK_OF = {"heave": "centre_of_mass", "pitch_nose_up": "body", "unsprung_front": "front_axle",
           "unsprung_rear": "rear_axle"}  # fmt: skip
"""Joint -> the link it moves."""


@dataclass(frozen=True)
class Frame:
    """Where a link is in its parent: ``position`` (3,) m, ``pitch_nose_up`` rad."""

    parent: str
    child: str
    position: tuple[float, float, float]
    pitch_nose_up: float = 0.0

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """(x, y, z, w) of the turn about -y."""
        return 0.0, -float(np.sin(self.pitch_nose_up / 2)), 0.0, float(np.cos(self.pitch_nose_up / 2))


def joint_positions(displacement: NDArray[np.float64], rig: Rig) -> NDArray[np.float64]:
    """Positions of :data:`JOINTS` (..., 4) from the four displacements (..., 4), m, in the order of /rig/displacement.

    Small angles, as in the model's own geometry (Eqs. 4.63-4.72).
    """
    front, rear, axles = displacement[..., 0], displacement[..., 1], displacement[..., 2:4]
    heave = (rig.rear_arm.value * front + rig.front_arm.value * rear) / rig.wheelbase
    pitch = (front - rear) / rig.wheelbase
    return np.concatenate([np.stack([heave, pitch], axis=-1), axles], axis=-1)


def frames(positions: NDArray[np.float64], rig: Rig) -> tuple[Frame, ...]:
    """Every frame below ``ground`` for joint positions (4,)."""
    heave, pitch, front, rear = positions.tolist()
    a, b = rig.front_arm.value, rig.rear_arm.value
    return (
        Frame("ground", LINK_OF["heave"], (0.0, 0.0, heave)),
        Frame(LINK_OF["heave"], LINK_OF["pitch_nose_up"], (0.0, 0.0, 0.0), pitch),
        Frame("ground", LINK_OF["unsprung_front"], (a, 0.0, front)),
        Frame("ground", LINK_OF["unsprung_rear"], (-b, 0.0, rear)),
        Frame("body", "front_air_spring", (a, 0.0, 0.0)),
        Frame("body", "rear_air_spring", (-b, 0.0, 0.0)),
        Frame("body", "manifold", (0.0, 0.0, 0.0)),
    )
