# SPDX-License-Identifier: Apache-2.0
"""What `pneumo log recover` keeps that a recovery which only reads on does not.

The peer reads with mcap's own Python reader as the `mcap` tool's `recover` does: a chunk that does not decompress or
fails its CRC is skipped, and the first record that leads nowhere ends the reading.
"""

from __future__ import annotations

import io
import struct
from pathlib import Path

import numpy as np
import pytest
from helpers.small_logs import session, write
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk

from pneumo_ros.log.salvage import salvage

DAMAGES = 150
Kept = set[tuple[str, int, bytes]]


def kept_by_reading_on(data: bytes) -> Kept:
    """Messages of every chunk up to the first record that cannot be read."""
    found: Kept = set()
    topics: dict[int, str] = {}
    records = StreamReader(io.BytesIO(data), emit_chunks=True).records
    while True:
        try:
            record = next(records)
        except Exception:  # the end of the file, or whatever the library makes of a broken record
            return found
        if isinstance(record, Channel):
            topics[record.id] = record.topic
        if isinstance(record, Chunk):
            try:
                inside = breakup_chunk(record, validate_crc=True)
            except Exception:  # a chunk that is broken: the next one may not be
                continue
            topics.update({r.id: r.topic for r in inside if isinstance(r, Channel)})
            messages = [r for r in inside if isinstance(r, Message) and r.channel_id in topics]
            found |= {(topics[m.channel_id], m.log_time, m.data) for m in messages}


def kept_by_salvage(path: Path) -> Kept:
    log = salvage(path).log
    return {
        (topic, int(t), log.records(topic).message(i))
        for topic in log.topics
        for i, t in enumerate(log.records(topic).log_time_ns)
    }


def chunks_of(data: bytes) -> list[tuple[int, int]]:
    """Where each chunk's record begins, and where its content does."""
    place, found = 8, []
    while place + 9 <= len(data):
        opcode, length = struct.unpack_from("<BQ", data, place)
        if opcode == Opcode.CHUNK:
            found.append((place, place + 9 + 48))
        if opcode == Opcode.FOOTER:
            break
        place += 9 + length
    return found


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = write(tmp_path_factory.mktemp("whole") / "whole.mcap", session(100), chunk_size=4096, enable_data_crcs=True)
    return path.read_bytes()


def both(data: bytes, tmp_path: Path) -> tuple[Kept, Kept]:
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    return kept_by_salvage(path), kept_by_reading_on(data)


def test_whole_and_cut_files_give_the_same(data: bytes, tmp_path: Path) -> None:
    assert len(kept_by_reading_on(data)) > 300
    for cut in (len(data), *np.linspace(len(data) // 3, len(data) - 1, 20).astype(int).tolist()):
        ours, theirs = both(data[:cut], tmp_path)
        assert ours == theirs, cut


def test_a_broken_chunk_costs_both_that_chunk(data: bytes, tmp_path: Path) -> None:
    whole, spoiled = kept_by_reading_on(data), bytearray(data)
    _, content = chunks_of(data)[5]
    spoiled[content + 40] ^= 0x10
    ours, theirs = both(bytes(spoiled), tmp_path)
    assert ours == theirs and 0 < len(whole - ours) < 60


def test_a_broken_length_does_not_swallow_the_chunks_behind_it(data: bytes, tmp_path: Path) -> None:
    whole, spoiled = kept_by_reading_on(data), bytearray(data)
    record, _ = chunks_of(data)[5]
    spoiled[record + 2] ^= 0x10  # the second byte of the record's length
    ours, theirs = both(bytes(spoiled), tmp_path)
    assert ours == whole, "the chunk states its length twice"
    assert theirs < ours and len(whole - theirs) > 100


def test_a_record_that_leads_nowhere_costs_one_chunk_and_not_the_rest_of_the_file(data: bytes, tmp_path: Path) -> None:
    whole, spoiled = kept_by_reading_on(data), bytearray(data)
    record, _ = chunks_of(data)[5]
    spoiled[record + 8] ^= 0x01  # the highest byte of the record's length
    ours, theirs = both(bytes(spoiled), tmp_path)
    assert theirs < ours and len(whole - ours) < 60 and len(whole - theirs) > 100


def test_nothing_is_lost_that_reading_on_keeps(data: bytes, tmp_path: Path) -> None:
    """But for a chunk whose header states another size than its content has: that is doubtful, and left out."""
    rng, ours_kept, theirs_kept = np.random.default_rng(4), 0, 0
    sizes = {place for record, _ in chunks_of(data) for place in range(record + 25, record + 33)}
    for place, bit in zip(rng.choice(len(data), DAMAGES, replace=False), rng.integers(0, 8, DAMAGES), strict=True):
        spoiled = bytearray(data)
        spoiled[place] ^= 1 << int(bit)
        if spoiled[:8] != data[:8]:
            continue
        ours, theirs = both(bytes(spoiled), tmp_path)
        assert theirs <= ours or (int(place) in sizes and len(theirs - ours) < 60), int(place)
        ours_kept, theirs_kept = ours_kept + len(ours), theirs_kept + len(theirs)
    assert ours_kept > theirs_kept
