# SPDX-License-Identifier: Apache-2.0
"""The driver's commands alone: which leave, when and with what; no board, no controller."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers.simulated_rig import MS, START

from pneumo_ros.daq.actuation import Actuation, Mode
from pneumo_ros.daq.calibration_file import load_calibration
from pneumo_ros.daq.emulator.board import board_identity
from pneumo_ros.daq.frames import Command, CommandFlag, decode
from pneumo_ros.daq.reasons import Finding, Reason
from pneumo_ros.daq.safety_config import SafetyConfig, load_safety
from pneumo_ros.daq.scaling import output_scale

SAFETY = load_safety()
SCALE = output_scale(load_calibration("appendix_c_corrected"), board_identity())
AREAS = (1e-6, 2e-6, 1e-6, 2e-6)


class Line:
    """What an Actuation sends, decoded, on a clock that the test sets."""

    def __init__(self, safety: SafetyConfig = SAFETY) -> None:
        self.sent: list[Command] = []
        self.discarded = 0
        self.actuation = Actuation(safety, self._take, self._discard)
        self.actuation.board(SCALE, 7)

    def _take(self, data: bytes) -> None:
        for frame in data.split(b"\0"):
            if frame:
                command = decode(frame)
                assert isinstance(command, Command)
                self.sent.append(command)

    def _discard(self) -> None:
        self.discarded += 1

    def armed(self, now: int = START) -> Line:
        self.actuation.arm(now)
        self.actuation.armed(now)
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


def ends(line: Line, expected_s: float, now: int = START) -> Finding:
    """What the timeouts say first after ``expected_s`` from ``now``, and nothing a nanosecond earlier."""
    limit = now + round(expected_s * 1e9)
    assert line.actuation.tick(limit) is None
    finding = line.actuation.tick(limit + 1)
    assert finding is not None
    return finding


def test_armed_without_a_command_ends_after_its_time() -> None:
    finding = ends(Line().armed(), SAFETY.arming.first_command)
    assert (finding.reason, finding.subject) == (Reason.COMMAND_STALE, "command")
    assert f"no command within {SAFETY.arming.first_command:.1f} s of arming" in finding.text


def test_armed_with_an_old_command_ends_after_its_time() -> None:
    line, late = Line().armed(), START + 3 * 10**9
    assert line.actuation.command(AREAS, late, late) is None
    finding = ends(line, SAFETY.timeouts.command, late)
    assert finding.reason is Reason.COMMAND_STALE
    assert finding.text == f"no fresh command for {SAFETY.timeouts.command * 1e3:.1f} ms"


@pytest.mark.parametrize("resetting", [False, True])
def test_a_board_that_does_not_follow_is_told(resetting: bool) -> None:
    line = Line()
    if resetting:
        line.actuation.make_safe(START - 1, estop=True)
        line.actuation.reset_estop(START)
        assert line.sent[-1].flags == CommandFlag.RESET and line.actuation.mode is Mode.RESETTING
    else:
        line.actuation.arm(START)
        assert line.actuation.mode is Mode.ARMING
    finding = ends(line, SAFETY.arming.healthy_for)
    assert (finding.reason, finding.subject) == (Reason.ARM_REFUSED, "board")
    assert f"within {SAFETY.arming.healthy_for:.1f} s" in finding.text


def test_safe_and_stopped_never_time_out() -> None:
    for estop in (False, True):
        line = Line()
        line.actuation.make_safe(START, estop=estop)
        assert line.actuation.mode is (Mode.ESTOP if estop else Mode.SAFE)
        assert line.actuation.tick(START + 10**12) is None


def test_an_emergency_stop_is_left_by_the_boards_word_alone() -> None:
    line = Line()
    line.actuation.make_safe(START, estop=True)
    line.actuation.make_safe(START)  # another trip is no release
    assert line.actuation.mode is Mode.ESTOP
    line.actuation.board(SCALE, 8)
    assert line.actuation.mode is Mode.ESTOP and line.actuation.session == 8
    line.actuation.reset_estop(START)
    line.actuation.make_safe(START)
    assert line.actuation.mode is Mode.ESTOP
    line.actuation.reset_estop(START)
    line.actuation.board(SCALE)  # a board that restarts while it resets
    assert line.actuation.mode is Mode.ESTOP and line.actuation.session == 0
    line.actuation.reset_estop(START)
    line.actuation.reset_done()
    assert line.actuation.mode is Mode.SAFE


def test_a_board_that_comes_back_is_safe_and_counts_anew() -> None:
    line = Line().armed()
    line.actuation.sample = 9
    line.actuation.command(AREAS, START, START)
    assert line.sent[-1].sample == 9 and line.sent[-1].session == 7 and line.sent[-1].sequence == 3
    assert line.sent[-1].flags == CommandFlag.ARM and line.actuation.sent == 3
    assert [number for number, _ in line.actuation.sent_ns] == [1, 2, 3]
    line.actuation.board(SCALE, 8)
    assert line.actuation.mode is Mode.SAFE and not line.actuation.sent_ns
    line.actuation.tick(START + 10**9)
    assert (line.sent[-1].session, line.sent[-1].sequence, line.sent[-1].sample) == (8, 1, 0)


def test_commands_count_in_the_armed_mode_alone() -> None:
    line = Line()
    assert line.actuation.command(AREAS, START, START) is None
    line.actuation.arm(START)
    count = len(line.sent)
    assert line.actuation.command(AREAS, START, START) is None
    assert len(line.sent) == count and line.actuation.refused == 0
    line.actuation.armed(START)
    assert line.actuation.command(AREAS, START + 5, START + 5) is None
    for stamp in (START + 5, START + 4):  # the same sample again, and one before it
        finding = line.actuation.command(AREAS, stamp, START + 6)
        assert finding is not None and "an older sample's than the last" in finding.text
    assert line.actuation.refused == 2
    finding = line.actuation.command((1.0, *AREAS[1:]), START + 7, START + 7)
    assert finding is not None and finding.reason is Reason.COMMAND_INVALID
    line.actuation.armed(START + 10**9)  # a new ride begins with its own first command
    assert line.actuation.command(AREAS, START + 1, START + 1) is None
    assert line.actuation.areas == SAFETY.safe_command


def test_what_was_sent_is_kept_for_the_log() -> None:
    line = Line().armed()
    line.actuation.applied.clear()
    line.actuation.command(AREAS, START, START)
    late = START + round(SAFETY.arming.ramp * 1e9)
    line.actuation.command(AREAS, late, late)
    (first, last) = line.actuation.applied
    assert (first.time_ns, first.areas) == (START, SAFETY.safe_command)
    assert (last.time_ns, last.areas) == (late, AREAS)


@pytest.mark.parametrize("now", [START, 3])
def test_a_ride_begins_at_the_safe_command_and_ends_its_ramp_at_the_controllers(now: int) -> None:
    """Valves that are safe open, on a clock of any age."""
    safe, ramp = (3e-6, 1e-6, 2e-6, 5e-7), round(SAFETY.arming.ramp * 1e9)
    line = Line(replace(SAFETY, safe_command=safe)).armed(now)
    for share in (0.0, 0.25, 0.5, 1.0, 3.0):
        at = now + round(share * ramp)
        assert line.actuation.command(AREAS, at, at) is None
        part = min(share, 1.0)
        expected = [part * area + (1.0 - part) * rest for area, rest in zip(AREAS, safe, strict=True)]
        assert line.actuation.areas == pytest.approx(expected)


def test_a_command_is_fresh_until_its_time_on_a_clock_of_any_age() -> None:
    line, limit = Line().armed(3), round(SAFETY.timeouts.command * 1e9)
    assert line.actuation.command(AREAS, 4, 4) is None
    for age in (limit // 7, limit // 2, limit):
        assert line.actuation.tick(4 + age) is None
    assert line.actuation.tick(4 + limit + 1) is not None
    finding = line.actuation.command(AREAS, 5, 5 + limit + 1)
    assert finding is not None and "ms old" in finding.text


def test_a_safe_driver_asks_the_board_for_nothing() -> None:
    line = Line()
    line.actuation.tick(START + 10**9)
    assert line.sent[-1].flags == CommandFlag(0)
