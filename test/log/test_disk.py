# SPDX-License-Identifier: Apache-2.0
"""A disk that says no: whatever was recorded until then is read back, and the log says why it ends."""

from __future__ import annotations

import errno
import resource
import shutil
from io import FileIO
from pathlib import Path

import numpy as np
import pytest
from helpers.small_logs import STORE, joint

from pneumo_ros.log.decoded import JOINT_STATE
from pneumo_ros.log.inspection import inspect_log
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.salvage import salvage
from pneumo_ros.log.writing import LogWriter, Written

COUNT = 3000
LIMITS = (0, 1, 100, 2_000, 10_000, 20_000, 50_000, 99_999, 100_000, 131_072, 150_000, 160_000, 165_000, 170_000)


def message(i: int, shift_ns: int = 0) -> bytes:
    rng = np.random.default_rng(i)
    return bytes(STORE.serialize_cdr(joint(10**9 + i * 2_000_000 + shift_ns, rng.normal(size=4).tolist()), JOINT_STATE))


def record(writer: LogWriter, count: int = COUNT) -> Written:
    channel = writer.add_topic("/rig/displacement", JOINT_STATE)
    for i in range(count):
        writer.write(channel, message(i))
    return writer.finish()


def read_back(written: Written) -> int:
    """Messages that are there, the first so many of those sent."""
    log = read_log(written.path) if written.path.suffix == ".mcap" else salvage(written.path).log
    records = log.records("/rig/displacement") if "/rig/displacement" in log.topics else None
    for i in range(0 if records is None else len(records)):
        assert records is not None and records.message(i) == message(i)
    return 0 if records is None else len(records)


@pytest.mark.parametrize("limit", LIMITS)
def test_a_limit_on_the_files_size_at_any_byte(tmp_path: Path, limit: int) -> None:
    """The system refuses every byte beyond it; the limit is the process's, so it is lifted again at once."""
    writer = LogWriter(tmp_path / "log.mcap")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (max(limit, writer.part.stat().st_size), hard))
    try:
        written = record(writer)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not written.complete and "File too large" in written.reason
    if limit > 150_000:
        assert read_back(written) > 500


@pytest.mark.parametrize("after", [0, 1])
def test_a_full_disk_that_gives_back_the_reserve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after: int) -> None:
    """ENOSPC at a write, in the middle of it; with the reserve gone there is room again: nothing recorded is lost."""
    reserve, calls, real = tmp_path / ".log.mcap.reserve", [0], FileIO.write

    class Full(FileIO):
        def write(self, data: object) -> int:  # type: ignore[override]
            calls[0] += len(data) > 10_000  # type: ignore[arg-type]
            if calls[0] > after and reserve.exists() and len(data) > 10_000:  # type: ignore[arg-type]
                real(self, memoryview(data)[:5000])  # type: ignore[call-overload]
                raise OSError(errno.ENOSPC, "No space left on device")
            return real(self, data)  # type: ignore[arg-type]

    monkeypatch.setattr("pneumo_ros.log.writing.FileIO", Full)
    written = record(LogWriter(tmp_path / "log.mcap"))
    assert not written.complete and "No space left" in written.reason and written.path.name == "log.mcap"
    assert read_back(written) == written.counts["/rig/displacement"] > 500 * (after + 1) - 1
    assert next(m for m in read_log(written.path).metadata if m.name == "session").metadata["complete"] == "false"


def test_a_folder_that_is_removed(tmp_path: Path) -> None:
    folder = tmp_path / "gone"
    writer = LogWriter(folder / "log.mcap")
    shutil.rmtree(folder)
    written = record(writer)
    assert not written.complete and "folder" in written.reason
    assert written.path == folder / "log.mcap" and read_log(written.path).library


def test_a_link_in_the_files_place_is_not_followed(tmp_path: Path) -> None:
    target = tmp_path / "precious"
    target.write_text("kept")
    (tmp_path / "log.mcap.part").symlink_to(target)
    with pytest.raises(Exception, match="cannot create the log"):
        LogWriter(tmp_path / "log.mcap")
    assert target.read_text() == "kept"


@pytest.mark.parametrize("hours", [-1, 1])
def test_a_clock_that_is_set_by_an_hour(tmp_path: Path, hours: int) -> None:
    writer = LogWriter(tmp_path / "log.mcap")
    channel = writer.add_topic("/rig/displacement", JOINT_STATE)
    for i in range(400):
        jump = hours * 3600 * 10**9 if i >= 200 else 0
        writer.write(channel, message(i), 2 * 10**13 + i * 2_000_000 + jump)
    written = writer.finish()
    log = read_log(written.path)
    assert written.complete and log.topics["/rig/displacement"].count == 400
    timing = inspect_log(log).topics[0].timing
    assert timing is not None and timing.jumps + timing.backward >= 1
