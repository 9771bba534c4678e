# SPDX-License-Identifier: Apache-2.0
"""The driver's commands alone: which leave, when and with what; no board, no controller."""

from __future__ import annotations

import pytest
from helpers.simulated_rig import MS, START

from pneumo_ros.daq.actuation import Actuation, Mode
from pneumo_ros.daq.calibration_file import load_calibration
from pneumo_ros.daq.emulator.board import board_identity
from pneumo_ros.daq.frames import Command, CommandFlag, decode
from pneumo_ros.daq.reasons import Reason
from pneumo_ros.daq.safety_config import load_safety
from pneumo_ros.daq.scaling import output_scale

SAFETY = load_safety()
SCALE = output_scale(load_calibration("appendix_c_corrected"), board_identity())
AREAS = (1e-6, 2e-6, 1e-6, 2e-6)


class Line:
    """What an Actuation sends, decoded, on a clock that the test sets."""

    def __init__(self) -> None:
        self.sent: list[Command] = []
        self.discarded = 0
        self.actuation = Actuation(SAFETY, self._take, self._discard)
        self.actuation.board(SCALE, 7)

    def _take(self, data: bytes) -> None:
        for frame in data.split(b"\0"):
            if frame:
                command = decode(frame)
                assert isinstance(command, Command)
                self.sent.append(command)

    def _discard(self) -> None:
        self.discarded += 1

    def armed(self) -> Line:
        self.actuation.arm(START)
        self.actuation.armed(START)
        self.sent.clear()
        return self


def times(line: Line, until: int) -> list[int]:
    """When a driver that looks every ms sends, ms after START."""
    sent = []
    for step in range(1, until + 1):
        count = len(line.sent)
        line.actuation.tick(START + step * MS)
        sent += [step] * (len(line.sent) - count)
    return sent


@pytest.mark.parametrize(("age", "passes"), [(0.9, True), (1.0, True), (1.1, False)])
def test_a_command_is_refused_by_its_samples_age_alone(age: float, passes: bool) -> None:
    """The first command of all: no older one that it could repeat."""
    line = Line().armed()
    limit = round(SAFETY.timeouts.command * 1e9)
    finding = line.actuation.command(AREAS, START, START + round(age * limit))
    assert bool(line.sent) is passes and (finding is None) is passes
    assert line.actuation.refused == (not passes)
    if finding is not None:
        assert finding.reason is Reason.COMMAND_STALE
        assert f"its sample is {age * limit * 1e-6:.1f} ms old" in finding.text


def test_keep_alives_are_quick_while_a_change_must_get_through() -> None:
    line = Line()
    assert times(line, 60) == [1, 21, 41]  # SAFE: every 20 ms
    line = Line()
    line.actuation.make_safe(START, estop=True)
    assert line.discarded == 1 and line.sent[0].flags == CommandFlag.ESTOP
    assert times(line, 160) == [*range(1, 100), 119, 139, 159]  # every ms for 100 ms after a trip
    line = Line()
    line.actuation.arm(START)
    assert [command.flags for command in line.sent] == [CommandFlag(0), CommandFlag.ARM]
    assert times(line, 30) == [*range(1, 31)]


def test_armed_the_driver_is_silent_once_the_controller_speaks() -> None:
    line = Line().armed()
    assert times(line, 3) == [1, 2, 3]
    assert line.actuation.command(AREAS, START + 3 * MS, START + 3 * MS) is None
    assert len(line.sent) == 4 and times(line, 20) == []
    ramp = SAFETY.arming.ramp * 1e3
    line.actuation.command(AREAS, START + 20 * MS, START + 20 * MS)
    assert line.actuation.areas == pytest.approx([area * 17 / ramp for area in AREAS])
    assert line.sent[-1].counts == SCALE.counts(line.actuation.areas)


def test_nothing_is_sent_to_a_board_that_has_not_answered() -> None:
    line = Line()
    line.actuation.board(None)
    line.actuation.make_safe(START)
    assert times(line, 50) == [] and line.actuation.mode is Mode.SAFE


def test_the_sequence_wraps_at_32_bits() -> None:
    line = Line().armed()
    line.actuation._sequence = (1 << 32) - 2
    assert times(line, 2) == [1, 2]
    assert [command.sequence for command in line.sent] == [(1 << 32) - 1, 0]
