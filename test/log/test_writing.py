# SPDX-License-Identifier: Apache-2.0
"""The log writer: what the mcap library reads of it, and what happens when the disk says no."""

from __future__ import annotations

import io
import shutil
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from rosbags.highlevel import AnyReader

from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.log.bags import files_of
from pneumo_ros.log.cdr import JointEncoder
from pneumo_ros.log.chunks import ChunkedWriter
from pneumo_ros.log.writing import AT_LATEST, AT_STAMP, CHUNK_BYTES, FREE_BYTES_NEEDED, LogWriter

MESSAGES = [(1 + i % 3, 1_000 + 7 * i, bytes([i % 251]) * (20 + i % 90)) for i in range(9_000)]


def library_file() -> bytes:
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD, enable_data_crcs=True)
    writer.start("ros2", "test")
    schema = writer.register_schema("a/msg/B", "ros2msg", b"int32 x")
    for i in range(3):
        writer.register_channel(f"/t{i}", "cdr", schema, {"k": str(i)})
    sequence = [0, 0, 0, 0]
    for channel, time, data in MESSAGES:
        writer.add_message(channel, time, data, time, sequence[channel])
        sequence[channel] += 1
    writer.add_metadata("m", {"key": "value"})
    writer.finish()
    return stream.getvalue()


def our_file() -> bytes:
    stream = io.BytesIO()
    writer = ChunkedWriter(stream, "ros2", "test", CHUNK_BYTES)
    schema = writer.add_schema("a/msg/B", "ros2msg", b"int32 x")
    for i in range(3):
        writer.add_channel(f"/t{i}", "cdr", schema, {"k": str(i)})
    for channel, time, data in MESSAGES:
        writer.add_message(channel, time, data, time)
    writer.add_metadata("m", {"key": "value"})
    writer.finish()
    return stream.getvalue()


def test_library_reads_the_same_from_both_writers() -> None:
    ours, theirs = (make_reader(io.BytesIO(data), validate_crcs=True) for data in (our_file(), library_file()))
    assert list(ours.iter_messages()) == list(theirs.iter_messages())
    assert list(ours.iter_messages(topics=["/t1"], start_time=20_000)) == list(
        theirs.iter_messages(topics=["/t1"], start_time=20_000)
    ), "through chunk and message indexes"
    one, two = ours.get_summary(), theirs.get_summary()
    assert one is not None and two is not None
    assert one.channels == two.channels and one.schemas == two.schemas
    one.statistics.chunk_count = two.statistics.chunk_count
    assert one.statistics == two.statistics
    assert list(ours.iter_metadata()) == list(theirs.iter_metadata())


def test_every_checksum_holds_and_chunks_stay_small() -> None:
    data = our_file()
    records = list(StreamReader(io.BytesIO(data), validate_crcs=True, emit_chunks=True).records)
    chunks = [r for r in records if type(r).__name__ == "Chunk"]
    assert len(chunks) > 2 and all(c.uncompressed_size <= 256 * 1024 for c in chunks)
    end = next(r for r in records if type(r).__name__ == "DataEnd")
    assert end.data_section_crc != 0


def sample(stamp: int) -> bytes:
    return JointEncoder("ground", topics.ROAD.names, True).encode(stamp, (0.1, 0.2), (0.0, 0.0))


def test_log_times_sequence_and_bag_metadata(tmp_path: Path) -> None:
    writer = LogWriter(tmp_path / "a.mcap", {"run": {"seed": "3"}})
    road = writer.add_topic(topics.ROAD.name, topics.ROAD.type)
    note = writer.add_topic("/note", topics.STRING)
    for i in range(5):
        writer.write(road, sample(10**9 + i), AT_STAMP)
    writer.write(note, b"\x00\x01\x00\x00\x02\x00\x00\x00a\x00", AT_LATEST)
    assert (tmp_path / "a.mcap.part").exists() and not (tmp_path / "a.mcap").exists()
    written = writer.finish()
    assert written.complete and written.counts == {topics.ROAD.name: 5, "/note": 1}
    with AnyReader([tmp_path]) as bag:
        times = [(c.topic, t) for c, t, _ in bag.messages()]
    assert sorted(times) == [("/note", 10**9 + 4), *((topics.ROAD.name, 10**9 + i) for i in range(5))]
    assert files_of(tmp_path) == [tmp_path / "a.mcap"], "our own reader takes the folder too"


def test_a_message_too_short_for_its_stamp_is_told_and_the_rest_written(tmp_path: Path) -> None:
    """Another process may send anything under a topic's name."""
    writer = LogWriter(tmp_path / "a.mcap")
    road = writer.add_topic(topics.ROAD.name, topics.ROAD.type, step_ns=1)
    for data in (sample(10**9), b"\x00\x01\x00\x00\x01", sample(10**9 + 1)):
        writer.write(road, data, AT_STAMP)
    assert writer.finish().counts == {topics.ROAD.name: 2}
    assert writer.disorder == f"a message of {topics.ROAD.name} ends before its stamp does"


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_whatever_ends_the_writing_the_log_is_not_complete(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = LogWriter(tmp_path / "a.mcap")
    road = writer.add_topic(topics.ROAD.name, topics.ROAD.type)
    monkeypatch.setattr(writer._writer, "add_message", lambda *_: {}["no such key"])
    writer.write(road, sample(10**9), AT_STAMP)
    written = writer.finish()
    assert not written.complete and "writing failed (KeyError('no such key'))" in written.reason


def test_a_log_among_others_leaves_the_folder_alone(tmp_path: Path) -> None:
    """A folder's metadata.yaml is about one bag: a second log neither takes it over nor makes one where it must not."""
    for name, folder in (("run.mcap", True), ("rerun.mcap", True), ("residual.mcap", False)):
        writer = LogWriter(tmp_path / name, bag_folder=folder)
        writer.write(writer.add_topic(topics.ROAD.name, topics.ROAD.type), sample(10**9))
        writer.finish()
        with AnyReader([tmp_path / name]) as lone:
            assert lone.message_count == 1
    assert (tmp_path / "metadata.yaml").read_text().count("path: run.mcap") == 1
    lonely = tmp_path / "lonely"
    LogWriter(lonely / "residual.mcap", bag_folder=False).finish()
    assert [path.name for path in lonely.iterdir()] == ["residual.mcap"]


def test_full_disk_ends_the_log_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk cannot be filled in a test: its usage is what the system would report."""
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=FREE_BYTES_NEEDED - 1))
    writer = LogWriter(tmp_path / "a.mcap")
    road = writer.add_topic(topics.ROAD.name, topics.ROAD.type)
    writer.write(road, sample(10**9))
    written = writer.finish()
    assert not written.complete and "disk nearly full" in written.reason
    assert list(make_reader((tmp_path / "a.mcap").open("rb")).iter_messages()) == []


@pytest.mark.parametrize("name", ["a.bag", "taken.mcap", "taken.mcap/b.mcap"])
def test_bad_target_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "taken.mcap").write_bytes(b"precious")
    with pytest.raises(InputError):
        LogWriter(tmp_path / name)
    assert (tmp_path / "taken.mcap").read_bytes() == b"precious"
