# SPDX-License-Identifier: Apache-2.0
"""An emergency stop on disk: found again by address or board, whoever looks, until a person resets it."""

from __future__ import annotations

from pathlib import Path

import pytest

from pneumo_ros.daq.stop_latch import StopLatch, address_key, board_key, described, state_folder

HERE, BOARD = address_key(3, "/rig1"), board_key("A 7/x")


def test_a_stop_is_found_by_whoever_comes_next(tmp_path: Path) -> None:
    assert StopLatch([HERE], tmp_path).found() == ""
    StopLatch([HERE], tmp_path).set(described("topic"))
    assert StopLatch([HERE], tmp_path).found().startswith("by topic at 20")


def test_places_and_boards_are_apart(tmp_path: Path) -> None:
    StopLatch([HERE], tmp_path).set("by topic")
    for other in (address_key(4, "/rig1"), address_key(3, "/rig2"), address_key(3, ""), BOARD):
        assert StopLatch([other], tmp_path).found() == "", other


def test_a_board_that_is_met_takes_over_the_stop_and_brings_its_own(tmp_path: Path) -> None:
    latch = StopLatch([HERE], tmp_path)
    latch.set("by topic")
    latch.know(BOARD)
    elsewhere = StopLatch([address_key(9, "")], tmp_path)
    elsewhere.know(BOARD)
    assert elsewhere.found() == "by topic"
    elsewhere.clear()
    assert StopLatch([BOARD], tmp_path).found() == StopLatch([address_key(9, "")], tmp_path).found() == ""
    assert latch.found() == "by topic", "the place where it was pressed has its own reset"


def test_the_first_stop_keeps_its_words(tmp_path: Path) -> None:
    latch = StopLatch([HERE, BOARD], tmp_path)
    latch.set("by topic")
    latch.set("by service")
    assert latch.found() == "by topic" and latch.trouble == ""


@pytest.mark.parametrize("content", [b"", b"\xff\xfe\x00"])
def test_what_cannot_be_read_is_a_stop(tmp_path: Path, content: bytes) -> None:
    (tmp_path / HERE).write_bytes(content)
    assert "unknown origin" in StopLatch([HERE], tmp_path).found()


def test_a_link_that_leads_nowhere_is_a_stop(tmp_path: Path) -> None:
    (tmp_path / HERE).symlink_to(tmp_path / "gone")
    assert "unknown origin" in StopLatch([HERE], tmp_path).found()


def test_a_folder_that_cannot_be_made_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    latch = StopLatch([HERE], tmp_path / "file" / "below")
    latch.set("by topic")
    assert "cannot be kept" in latch.trouble


def test_it_lives_in_the_users_state_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert state_folder().is_relative_to(tmp_path)
    StopLatch([HERE]).set("by topic")
    assert (state_folder() / HERE).read_text() == "by topic\n" and state_folder().stat().st_mode & 0o077 == 0
