# SPDX-License-Identifier: Apache-2.0
"""Reason codes of everything the driver reports; they appear on /rig/events and in the log."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, IntEnum
from typing import NamedTuple


class Level(IntEnum):
    """As in diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


class Reason(Enum):
    """One code a cause; the text says what it means."""

    LINK_OPEN = "the port is open and the board has answered"
    LINK_LOST = "the port is gone"
    LINK_BUSY = "the port cannot be opened"
    LINK_SHARED = "frames of another session came: another host, or old ones played again"
    BOARD_REFUSED = "the board does not fit this driver or configuration"
    BOARD_RESET = "the board has restarted"
    SAMPLES_STALE = "the board is silent"
    FRAMES_LOST = "too many frames lost or damaged"
    CALIBRATION_DOUBTFUL = "the calibration has findings"
    CALIBRATION_CHANGED = "zero or span was set"
    CHANNEL_UNWATCHED = "the sensor's noise is too small against one count to tell a stuck sensor in time"
    DRIVER_FAILED = "the driver itself has failed"
    ARMED = "the valves follow the controller"
    ARM_REFUSED = "the board did not arm"
    DISARMED = "disarmed by the operator"
    COMMAND_STALE = "no fresh command from the controller"
    COMMAND_INVALID = "a command that is not finite or outside the valves' range was refused"
    COMMAND_FOREIGN = "somebody else than the controller publishes commands"
    LIMIT_WARN = "a quantity is outside its warning limits"
    LIMIT_CLEAR = "a quantity is back inside its warning limits"
    LIMIT_TRIP = "a quantity was outside its trip limits"
    SENSOR_RAIL = "a sensor is at the converter's rail"
    SENSOR_RANGE = "a sensor reads what the rig cannot reach"
    SENSOR_RATE = "a sensor jumps"
    SENSOR_STUCK = "a sensor repeats itself"
    SENSOR_DISAGREE = "displacement and pressure disagree about the load"
    CONVERTER = "the board's converter does not answer"
    BOARD_WATCHDOG = "the board's watchdog saw no command"
    BOARD_DISARMED = "the board left its armed state"
    ESTOP = "emergency stop"
    ESTOP_RESET = "emergency stop reset"

    @property
    def code(self) -> str:
        """Lower case, as published."""
        return self.name.lower()


class Event(NamedTuple):
    """Something that happened."""

    level: Level
    reason: Reason
    message: str
    values: Mapping[str, str]
    time_ns: int


class Finding(NamedTuple):
    """Something wrong with a channel or quantity, as a monitor sees it."""

    reason: Reason
    subject: str
    text: str
    level: Level = Level.ERROR
    estop: bool = False
