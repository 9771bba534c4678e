# SPDX-License-Identifier: Apache-2.0
"""Damage anywhere: the strict reader refuses or reads the truth, the salvage keeps only the truth."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from helpers.small_logs import session, write

from pneumo_ros.errors import InputError
from pneumo_ros.log.decoded import Log
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.repair import recover
from pneumo_ros.log.salvage import salvage

CUTS, FLIPS = 1000, 1000


def contents(log: Log) -> dict[str, list[tuple[int, bytes]]]:
    """Every message, by topic."""
    return {
        topic: [(int(t), log.records(topic).message(i)) for i, t in enumerate(log.records(topic).log_time_ns)]
        for topic in log.topics
    }


def assert_nothing_invented(found: Log, truth: dict[str, list[tuple[int, bytes]]]) -> None:
    for topic, messages in contents(found).items():
        assert set(messages) <= set(truth.get(topic, [])), topic
        assert len(set(messages)) == len(messages)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("whole") / "whole.mcap"
    return write(path, session(100), chunk_size=4096, enable_data_crcs=True)


@pytest.fixture(scope="module")
def truth(whole: Path) -> dict[str, list[tuple[int, bytes]]]:
    return contents(read_log(whole))


def check(path: Path, damaged: bytes, truth: dict[str, list[tuple[int, bytes]]], may_read: bool) -> int:
    """Strict: an error of one line, or every message as it was. Salvage: nothing but true messages; how many."""
    path.write_bytes(damaged)
    try:
        log = read_log(path)
        assert may_read and contents(log) == truth
    except InputError as error:
        assert "\n" not in str(error) and str(path) in str(error)
    try:
        found = salvage(path)
    except InputError as error:
        assert "\n" not in str(error)
        return 0
    assert_nothing_invented(found.log, truth)
    total = sum(map(len, truth.values()))
    assert found.kept == total or found.losses or found.notes
    assert path.read_bytes() == damaged
    return found.kept


def test_cut_anywhere(whole: Path, truth: dict[str, list[tuple[int, bytes]]], tmp_path: Path) -> None:
    data = whole.read_bytes()
    places = np.random.default_rng(1).choice(len(data), CUTS, replace=False)
    kept = {int(p): check(tmp_path / "cut.mcap", data[:p], truth, may_read=False) for p in places}
    ordered = [kept[p] for p in sorted(kept)]
    assert ordered == sorted(ordered)  # the longer the file, the more of it is read
    assert ordered[-1] == sum(map(len, truth.values()))


def test_bits_flipped_anywhere(whole: Path, truth: dict[str, list[tuple[int, bytes]]], tmp_path: Path) -> None:
    data = whole.read_bytes()
    rng = np.random.default_rng(2)
    total = sum(map(len, truth.values()))
    kept = []
    for place, bit in zip(rng.choice(len(data), FLIPS, replace=False), rng.integers(0, 8, FLIPS), strict=True):
        damaged = bytearray(data)
        damaged[place] ^= 1 << int(bit)
        kept.append(check(tmp_path / "flip.mcap", bytes(damaged), truth, may_read=False))
    # One bit costs one chunk of 4 KiB (about 30 messages) at most.
    assert min(kept) > total - 60


@pytest.mark.parametrize("options", [{"compression": 0}, {"use_chunking": False}, {"enable_data_crcs": False}], ids=str)
def test_other_containers_give_no_traceback(tmp_path: Path, options: dict[str, object]) -> None:
    """Without checksums a flipped number cannot be seen; but nothing may crash, and where CRCs exist they hold."""
    from mcap.writer import CompressionType

    if "compression" in options:
        options = {"compression": CompressionType.NONE}
    path = write(tmp_path / "a.mcap", session(40), chunk_size=4096, **options)
    data, truth = path.read_bytes(), contents(read_log(path))
    rng = np.random.default_rng(3)
    protected = options.get("use_chunking", True)
    for place, bit in zip(rng.choice(len(data), 150, replace=False), rng.integers(0, 8, 150), strict=True):
        damaged = bytearray(data)
        damaged[place] ^= 1 << int(bit)
        if protected:
            check(tmp_path / "b.mcap", bytes(damaged), truth, may_read=True)
        else:
            (tmp_path / "b.mcap").write_bytes(bytes(damaged))
            for read in (read_log, salvage):
                try:
                    assert read(tmp_path / "b.mcap")
                except InputError as error:
                    assert "\n" not in str(error)
    for place in rng.choice(len(data), 100, replace=False):
        check(tmp_path / "c.mcap", data[:place], truth, may_read=False)


def test_a_loss_that_nothing_tells_of_is_not_called_none(tmp_path: Path) -> None:
    """Neither checksums nor a summary: a message whose opcode was spoiled is gone without a trace."""
    path = write(tmp_path / "a.mcap", session(40), use_chunking=False, enable_crcs=False)
    data = path.read_bytes()
    total = sum(map(len, contents(read_log(path)).values()))
    (summary,) = struct.unpack_from("<Q", data, len(data) - 28)
    cut = bytearray(data[: summary - 13])  # without the end of data, as a killed recorder leaves it
    length = 22 + len(read_log(path).records("/rig/displacement").message(3))
    frame = cut.index(struct.pack("<BQ", 5, length))
    cut[frame] |= 0x80  # an opcode of nobody's
    (tmp_path / "b.mcap").write_bytes(bytes(cut))
    found = recover(tmp_path / "b.mcap", tmp_path / "c.mcap")
    assert found.kept == total - 1 and not found.salvaged.losses
    assert found.salvaged.lost is None and not found.whole
