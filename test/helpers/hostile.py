"""What a log from elsewhere may carry: effects that would run, texts that would be taken for something else."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from helpers.small_logs import Message, joint, pressure, text, write
from pneumo_ros.log.reading import FLUID_PRESSURE, JOINT_STATE, STRING
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig

RIG = load_rig()
VALVES = ("front_inlet", "rear_inlet", "front_outlet", "rear_outlet")


def rest_log(path: Path, config: str, count: int = 1100, extra: Sequence[Message] = ()) -> Path:
    """A log of the rig nearly at rest, with this text on /rig/config."""
    rng = np.random.default_rng(1)
    state, command = trim(RIG).state, trim(RIG).command
    heights = np.array(
        [state[0] + RIG.front_arm.value * state[1], state[0] - RIG.rear_arm.value * state[1], *state[2:4]]
    )
    messages: list[Message] = [("/rig/config", STRING, 0, text(config)), *extra]
    for i in range(count):
        time = 10**9 + i * 2_000_000
        shown = heights + rng.normal(size=4) * 1e-4
        messages += [
            ("/road/profile", JOINT_STATE, time, joint(time, (0.0, 0.0), ("front", "rear"))),
            ("/rig/displacement", JOINT_STATE, time, joint(time, shown.tolist())),
            ("/rig/front/pressure", FLUID_PRESSURE, time, pressure(time, float(state[8]) + rng.normal() * 100.0)),
            ("/rig/rear/pressure", FLUID_PRESSURE, time, pressure(time, float(state[9]) + rng.normal() * 100.0)),
            ("/valve/command", JOINT_STATE, time, joint(time, command.tolist(), VALVES)),
        ]
    return write(path, messages)
