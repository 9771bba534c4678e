# SPDX-License-Identifier: Apache-2.0
"""Whether a board may drive this rig: its channel map, its watchdog, its safe state."""

from __future__ import annotations

from pneumo_ros.daq.calibration import Calibration
from pneumo_ros.daq.frames import Hello
from pneumo_ros.daq.safety_config import SafetyConfig
from pneumo_ros.daq.scaling import OutputScale, check_map, output_scale
from pneumo_ros.errors import InputError


def admit(hello: Hello, calibration: Calibration, safety: SafetyConfig) -> OutputScale:
    """The map of the board's valves, if it may be used.

    Raises
    ------
    InputError
        naming the board, what does not fit and the remedy.
    """
    check_map(hello)
    where, limit = f"board {hello.serial_number}", round(safety.timeouts.firmware * 1e6)
    slowest = hello.watchdog_us + hello.sample_period_us  # the watchdog is looked at once a sample
    if slowest > limit:
        raise InputError(
            "the board's watchdog is too slow", where=where, value=slowest,
            allowed=f"at most {limit} us with a sample period", remedy="build the firmware with a shorter one",
        )  # fmt: skip
    scale = output_scale(calibration, hello)
    theirs, ours = tuple(entry.safe for entry in hello.outputs), scale.counts(safety.safe_command)
    if theirs != ours:
        raise InputError(
            "the board has another safe state than config/safety.yaml", where=where, value=theirs,
            allowed=str(ours), remedy="make safe_command and the firmware agree",
        )  # fmt: skip
    return scale
