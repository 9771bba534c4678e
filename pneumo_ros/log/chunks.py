# SPDX-License-Identifier: Apache-2.0
"""An MCAP writer for many small messages: the library's records, its own loop.

mcap's Writer spends 3.4 us on a message, most of it in single-field writes; in a thread that shares the interpreter
with the control loop that is a quarter of a lockstep period. This one packs a message with one call and a chunk's index
with one array: 1.0 us. Everything but the two hot records (Message, MessageIndex) is written by the library's record
classes, and tests read the result with the library and compare it with what the library's writer makes.
Source: MCAP specification, version 0.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence
from io import FileIO

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

MAGIC = b"\x89MCAP0\r\n"
MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
MESSAGE_FIELDS = MESSAGE.size - 9  # what the length counts besides the data
INDEX_HEAD = struct.Struct("<BQHI")  # opcode, length, channel, bytes of the entries


class ChunkedWriter:
    """Writes a chunked, zstd-compressed, indexed MCAP file to a stream.

    Parameters
    ----------
    stream : binary, writable, without a buffer of its own; not closed here
    profile, library : of the header
    chunk_bytes : a chunk is closed after the message that makes it this large, uncompressed
    """

    def __init__(self, stream: FileIO, profile: str, library: str, chunk_bytes: int) -> None:
        self._stream, self._chunk_bytes = stream, chunk_bytes
        self._position, self._crc = 0, 0
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._counts: dict[int, int] = {}
        self._chunks, self._index = 0, bytearray()  # as it is written: records of a day would take ten times as much
        self._metadata: list[MetadataIndex] = []
        self._pieces: list[bytes] = []
        self._size = 0
        self._entries: dict[int, list[int]] = {}
        self._first, self._last = 0, 0
        self._compressor = zstandard.ZstdCompressor()
        self._put(MAGIC)
        self._put(_encoded(Header(profile, library)))

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Write a schema; returns its id."""
        self._schemas.append(Schema(id=len(self._schemas) + 1, data=data, encoding=encoding, name=name))
        self._put(_encoded(self._schemas[-1]))
        return len(self._schemas)

    def add_channel(self, topic: str, encoding: str, schema: int, metadata: Mapping[str, str]) -> int:
        """Write a channel; returns its id."""
        number = len(self._channels) + 1
        self._channels.append(
            Channel(id=number, topic=topic, message_encoding=encoding, schema_id=schema, metadata=dict(metadata))
        )
        self._counts[number] = 0
        self._entries[number] = []
        self._put(_encoded(self._channels[-1]))
        return number

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""
        data = _encoded(Metadata(name=name, metadata=dict(values)))
        self._metadata.append(MetadataIndex(offset=self._position, length=len(data), name=name))
        self._put(data)

    def add_message(self, channel: int, log_ns: int, data: bytes, publish_ns: int) -> None:
        """Add one serialised message; its sequence number is its place in the channel."""
        count = self._counts[channel]
        self._counts[channel] = count + 1
        self._entries[channel] += (log_ns, self._size)
        self._pieces += (
            MESSAGE.pack(Opcode.MESSAGE, MESSAGE_FIELDS + len(data), channel, count, log_ns, publish_ns),
            data,
        )
        self._size += MESSAGE.size + len(data)
        if self._size >= self._chunk_bytes:
            self.flush()

    @property
    def counts(self) -> dict[int, int]:
        """Channel id -> messages."""
        return dict(self._counts)

    @property
    def span_ns(self) -> tuple[int, int]:
        """Log times of the first and last message of the closed chunks; (0, 0) before any."""
        return self._first, self._last

    def flush(self) -> None:
        """Close the chunk, if it holds anything, and hand everything to the system."""
        if self._pieces:
            self._write_chunk()
        self._stream.flush()

    def finish(self) -> None:
        """Close the chunk and write statistics, indexes and footer."""
        self.flush()
        self._put(_encoded(DataEnd(self._crc)))
        start = self._position
        groups = (
            (Opcode.SCHEMA, _joined(self._schemas)),
            (Opcode.CHANNEL, _joined(self._channels)),
            (Opcode.STATISTICS, _encoded(self._statistics())),
            (Opcode.CHUNK_INDEX, bytes(self._index)),
            (Opcode.METADATA_INDEX, _joined(self._metadata)),
        )
        summary, offsets = b"", b""
        for opcode, data in groups:
            offset = SummaryOffset(group_opcode=opcode, group_start=start + len(summary), group_length=len(data))
            offsets += _encoded(offset)
            summary += data
        footer = _encoded(Footer(start, start + len(summary), 0))[:-4]
        crc = zlib.crc32(summary + offsets + footer)
        try:
            self._put(summary + offsets + footer + struct.pack("<I", crc) + MAGIC)
        except OSError:  # without its index the file is whole all the same
            self._put(_encoded(Footer(0, 0, 0)) + MAGIC)
        self._stream.flush()

    def _put(self, data: bytes) -> None:
        """Write all of it or nothing: what a full disk took of it is cut off again, so that the file ends whole."""
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._stream.write(rest) :]
        except OSError:
            self._stream.truncate(self._position)
            self._stream.seek(self._position)
            raise
        self._crc = zlib.crc32(data, self._crc)
        self._position += len(data)

    def _write_chunk(self) -> None:
        content = b"".join(self._pieces)
        entries = {number: np.array(e, "<u8").reshape(-1, 2) for number, e in self._entries.items() if e}
        times = np.concatenate([e[:, 0] for e in entries.values()])
        packed = self._compressor.compress(content)
        begin, end = int(times.min()), int(times.max())
        data = _encoded(Chunk("zstd", packed, end, begin, zlib.crc32(content), len(content)))
        start = self._position
        offsets, indexes = {}, b""
        for number, own in entries.items():
            offsets[number] = start + len(data) + len(indexes)
            body = own.tobytes()
            indexes += INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + len(body), number, len(body)) + body
        self._put(data + indexes)
        for number in entries:
            self._entries[number] = []
        self._first = begin if not self._chunks else min(self._first, begin)
        self._last = max(self._last, end)
        self._chunks += 1
        self._index += _encoded(
            ChunkIndex(len(data), start, "zstd", len(packed), end, len(indexes), offsets, begin, len(content))
        )
        self._pieces, self._size = [], 0

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts={number: count for number, count in self._counts.items() if count},
            chunk_count=self._chunks,
            message_count=sum(self._counts.values()),
            message_end_time=self._last,
            message_start_time=self._first,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )


def _joined(records: Sequence[McapRecord]) -> bytes:
    return b"".join(_encoded(record) for record in records)


def _encoded(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())
