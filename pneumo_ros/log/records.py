# SPDX-License-Identifier: Apache-2.0
"""Messages of a channel in bulk: found in a block, gathered into arrays, still undecoded.

A log of a million messages is read in about a second because nothing is done per message: the record offsets come from
the chunk's own message index (verified to tile the chunk exactly; without one the chunk is walked), and each channel's
equally long records are copied with one fancy index.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from pneumo_ros.log.container import FRAME, Block, Contents, DamageError
from pneumo_ros.log.sections import take_record

# A Message record's fixed part: opcode, length, then channel, sequence, log and publish time (MCAP specification).
HEAD = np.dtype([
    ("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log", "<u8"), ("publish", "<u8"),
])  # fmt: skip
PRIVATE = 0x80  # opcodes from here on are private records, to be skipped
_FIXED = HEAD.itemsize - FRAME.size  # what a Message record's length counts besides the data


@dataclass(frozen=True)
class Records:
    """The messages of one topic in log-time order, serialised.

    ``data[offsets[i]:offsets[i + 1]]`` is message i; all arrays have length N but ``offsets``, which has N + 1.
    """

    log_time_ns: NDArray[np.int64]
    publish_time_ns: NDArray[np.int64]
    sequence: NDArray[np.int64]
    offsets: NDArray[np.int64]
    data: NDArray[np.uint8]
    disordered: int = 0  # messages whose log time lay before their predecessor's in the file

    def __len__(self) -> int:
        return len(self.log_time_ns)

    def message(self, i: int) -> bytes:
        """The serialised message i."""
        return self.data[self.offsets[i] : self.offsets[i + 1]].tobytes()

    def rows(self) -> NDArray[np.uint8] | None:
        """All messages as (N, length), or None if their lengths differ."""
        if len(self) == 0:
            return None
        length = int(self.offsets[1] - self.offsets[0])
        # Lengths are compared one by one: equal sums could hide two that differ.
        if np.any(np.diff(self.offsets) != length):
            return None
        return self.data.reshape(len(self), length)


@dataclass
class Gathered:
    """Pieces of one channel, block by block, until :meth:`records` joins them."""

    heads: list[NDArray[np.void]] = field(default_factory=list)
    data: list[NDArray[np.uint8]] = field(default_factory=list)
    size: int = 0  # bytes of messages

    def add(self, heads: NDArray[np.void], data: NDArray[np.uint8]) -> None:
        """The next messages."""
        self.heads.append(heads)
        self.data.append(data)
        self.size += len(data)

    def records(self) -> Records:
        """One array per column, in log-time order; messages of equal time stay in file order."""
        heads = np.concatenate(self.heads) if self.heads else np.empty(0, HEAD)
        data = np.concatenate(self.data) if self.data else np.empty(0, np.uint8)
        self.heads.clear()
        self.data.clear()
        offsets = np.concatenate([[0], np.cumsum(heads["length"].astype(np.int64) - _FIXED)])
        log = heads["log"].astype(np.int64)
        disordered = int(np.count_nonzero(np.diff(log) < 0))
        found = Records(
            log, heads["publish"].astype(np.int64), heads["sequence"].astype(np.int64), offsets, data, disordered
        )
        return _sorted(found) if disordered else found


def _sorted(found: Records) -> Records:
    order = np.argsort(found.log_time_ns, kind="stable")
    lengths = np.diff(found.offsets)[order]
    pieces = [found.data[found.offsets[i] : found.offsets[i + 1]] for i in order]
    return Records(
        found.log_time_ns[order],
        found.publish_time_ns[order],
        found.sequence[order],
        np.concatenate([[0], np.cumsum(lengths)]),
        np.concatenate(pieces),
        found.disordered,
    )


def join(parts: list[Records]) -> Records:
    """Several recordings of one topic (split files, several publishers) as one, in log-time order."""
    if len(parts) == 1:
        return parts[0]
    lengths = np.concatenate([np.diff(p.offsets) for p in parts])
    log = np.concatenate([p.log_time_ns for p in parts])
    joined = Records(
        log,
        np.concatenate([p.publish_time_ns for p in parts]),
        np.concatenate([p.sequence for p in parts]),
        np.concatenate([[0], np.cumsum(lengths)]),
        np.concatenate([p.data for p in parts]),
        sum(p.disordered for p in parts),
    )
    return _sorted(joined) if np.any(np.diff(log) < 0) else joined


def gather(
    block: Block, topics: Sequence[str] | None, into: dict[int, Gathered], contents: Contents, since_ns: int = 0
) -> int:
    """Sort a block's messages into their channels; returns how many it holds, wanted or not.

    Parameters
    ----------
    block : checked content of a chunk
    topics : to keep, or None for all
    into : pieces by channel id, added to
    contents : receives the schemas and channels that stand inside the block
    since_ns : log time before which nothing is kept

    Raises
    ------
    DamageError
        if the block's records do not fill it exactly.
    """
    starts = _starts(block, contents)
    if len(starts) == 0:
        return 0
    heads = _windows(block.data, HEAD.itemsize, 0)[starts].view(HEAD)
    if max(int(heads["log"].max()), int(heads["publish"].max())) >= 1 << 63:
        raise DamageError("a time beyond the year 2262 in the chunk", contents.path, block.offset)
    for channel in np.unique(heads["channel"]).tolist():
        if channel not in contents.channels:
            raise DamageError(f"messages of an undeclared channel {channel} in the chunk", contents.path, block.offset)
        if topics is None or contents.channels[channel].topic in topics:
            mask = (heads["channel"] == channel) & (heads["log"] >= since_ns)
            if mask.any():
                lengths = heads["length"][mask].astype(np.int64) - _FIXED
                into.setdefault(channel, Gathered()).add(heads[mask], _payloads(block.data, starts[mask], lengths))
    return len(starts)


def _windows(data: bytes, width: int, offset: int) -> NDArray[np.void]:
    """Every run of ``width`` bytes as one opaque element, so that a fancy index copies whole records."""
    count = len(data) - offset - width + 1
    return np.ndarray((max(count, 0),), f"V{width}", data, offset, (1,))


def _payloads(data: bytes, starts: NDArray[np.int64], lengths: NDArray[np.int64]) -> NDArray[np.uint8]:
    width = int(lengths[0])
    if width and np.all(lengths == width):
        return _windows(data, width, HEAD.itemsize)[starts].view(np.uint8)
    begins = (starts + HEAD.itemsize).tolist()
    joined = b"".join(data[b : b + n] for b, n in zip(begins, lengths.tolist(), strict=True))
    return np.frombuffer(joined, np.uint8)


def _starts(block: Block, contents: Contents) -> NDArray[np.int64]:
    """Offsets of the message records; everything between them is walked, so nothing is missed or counted twice."""
    hinted = _hinted(block)
    if hinted is None:
        return np.frombuffer(_walk(block, 0, len(block.data), contents), np.int64)
    ends = hinted + FRAME.size + _lengths(block.data, hinted)
    bounds = zip(
        np.concatenate([[0], ends]).tolist(), np.concatenate([hinted, [len(block.data)]]).tolist(), strict=True
    )
    missed = [start for begin, end in bounds if begin != end for start in _walk(block, begin, end, contents)]
    return np.sort(np.concatenate([hinted, np.array(missed, np.int64)])) if missed else hinted


def _hinted(block: Block) -> NDArray[np.int64] | None:
    """The offsets the message index claims, if records really stand there and do not overlap."""
    entries = []
    for body in block.hints:
        if len(body) < 6 or (len(body) - 6) % 16 or struct.unpack_from("<I", body, 2)[0] != len(body) - 6:
            return None
        entries.append(np.frombuffer(body, "<u8", offset=6)[1::2])
    found = np.sort(np.concatenate(entries)) if entries else np.empty(0, np.uint64)
    if len(found) == 0 or found[-1] > len(block.data) - HEAD.itemsize:
        return None
    starts = found.astype(np.int64)
    data = np.frombuffer(block.data, np.uint8)
    lengths = _lengths(block.data, starts)
    if np.any(data[starts] != Opcode.MESSAGE) or np.any(lengths < _FIXED) or np.any(lengths > len(block.data)):
        return None
    ends = starts + FRAME.size + lengths
    if np.any(ends[:-1] > starts[1:]) or ends[-1] > len(block.data):
        return None
    return starts


def _lengths(data: bytes, starts: NDArray[np.int64]) -> NDArray[np.int64]:
    return _windows(data, 8, 1)[starts].view("<u8").astype(np.int64)


def _walk(block: Block, begin: int, end: int, contents: Contents) -> array[int]:
    """Record by record: message offsets are returned, schemas and channels kept."""
    starts, position, unpack = array("q"), begin, FRAME.unpack_from
    while position < end:
        if position + FRAME.size > end:
            raise DamageError("a record leaves its chunk", contents.path, block.offset)
        opcode, length = unpack(block.data, position)
        stop = position + FRAME.size + length
        if stop > end or (opcode == Opcode.MESSAGE and length < _FIXED):
            raise DamageError("a record leaves its chunk", contents.path, block.offset)
        if opcode == Opcode.MESSAGE:
            starts.append(position)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            take_record(contents, opcode, block.data[position + FRAME.size : stop], block.offset)
        elif opcode < PRIVATE:
            raise DamageError(f"unexpected record 0x{opcode:02x} in a chunk", contents.path, block.offset)
        position = stop
    return starts
