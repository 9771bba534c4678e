# SPDX-License-Identifier: Apache-2.0
"""One step of what commands the valves, never a command that is not finite: for a session and its replay alike."""

from __future__ import annotations

import math
from typing import NamedTuple

from pneumo_ros.arrays import Array
from pneumo_ros.control.profile import Commander


class Guarded(NamedTuple):
    """State (8,), command (4,) m2, telemetry (4,), and whether the command had to be replaced."""

    state: Array
    command: Array
    telemetry: Array
    refused: bool


def guarded_step(commander: Commander, state: Array, estimate: Array) -> Guarded:
    """Step from a state (8,) and an estimate (16,); where the command is not finite the valves go to trim.

    The state stays then: what has become NaN once would never leave it again.
    """
    new, command, telemetry = commander.step(state, estimate)
    if math.isfinite(command[0] + command[1] + command[2] + command[3]):
        return Guarded(new, command, telemetry, False)
    return Guarded(state, commander.at_rest.command, telemetry, True)
