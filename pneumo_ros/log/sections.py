# SPDX-License-Identifier: Apache-2.0
"""An MCAP file section by section, strictly: chunks, small records, and the summary that they must agree with."""

from __future__ import annotations

import mmap
import struct
import zlib
from collections.abc import Iterable, Iterator
from itertools import takewhile
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Footer, Header, Metadata, Schema, Statistics

from pneumo_ros.log.bounds import MAX_CHANNELS, MAX_DECLARATION, MAX_RATIO, chunk_limit, most_records
from pneumo_ros.log.container import Block, Contents, DamageError, Frame, frames, parse
from pneumo_ros.log.unpacking import LARGER, decompress


def read_blocks(buffer: mmap.mmap | bytes, path: Path, contents: Contents) -> Iterator[Block]:
    """Blocks of messages in file order, strictly: the file is checked against its summary, ``contents`` is filled.

    Raises
    ------
    DamageError
        at the first broken record, checksum or count.
    """
    everything, loose = _listed(buffer, path)
    data_end = next((i for i, f in enumerate(everything) if f.opcode == Opcode.DATA_END), len(everything) - 1)
    data, summary = everything[:data_end], everything[data_end:]
    check_sections(buffer, summary, contents)
    _read_small(buffer, data, contents)
    chunks = content = 0
    for i, frame in enumerate(data):
        if frame.opcode == Opcode.CHUNK:
            chunks += 1
            following = (data[k] for k in range(i + 1, len(data)))
            index = takewhile(lambda f: f.opcode == Opcode.MESSAGE_INDEX, following)
            block = chunk_block(buffer, frame, index, contents)
            content = check_ratio(content + len(block.data), buffer, path, frame.start)
            yield block
    if loose:
        contents.unprotected = True
        joined = b"".join(bytes(buffer[begin:end]) for begin, end in loose)
        yield Block(joined, (), loose[0][0], len(joined))
    _check_against_summary(contents, chunks, summary[0].start)


def _listed(buffer: mmap.mmap | bytes, path: Path) -> tuple[list[Frame], list[tuple[int, int]]]:
    """Records that must be looked at one by one, and the stretches of messages that stand outside of chunks."""
    kept: list[Frame] = []
    loose: list[tuple[int, int]] = []
    most = most_records(len(buffer))
    for frame in frames(buffer, path):
        if frame.opcode == Opcode.MESSAGE:
            begin = loose.pop()[0] if loose and loose[-1][1] == frame.start else frame.start
            loose.append((begin, frame.end))
        elif frame.opcode < 0x80:
            kept.append(frame)
        if len(kept) > most:
            raise DamageError(f"more than {most} records", path, frame.start)
    return kept, loose


def check_ratio(content: int, buffer: mmap.mmap | bytes, path: object, offset: int) -> int:
    """Bytes unpacked so far, if a file of this size may hold them.

    Raises
    ------
    DamageError
        if no log is this much larger than its file.
    """
    if content > max(chunk_limit(), MAX_RATIO * len(buffer)):
        raise DamageError(f"{content} bytes in a file of {len(buffer)}", path, offset, LARGER)
    return content


def _check_against_summary(contents: Contents, chunks: int, offset: int) -> None:
    """What no checksum covers (records outside chunks, whole chunks skipped) must agree with the summary's copy."""
    statistics = contents.statistics
    if statistics is not None and statistics.chunk_count != chunks:
        raise DamageError(f"{chunks} chunks found, the summary counts {statistics.chunk_count}", contents.path, offset)
    for kind, ours in (("schemas", contents.schemas), ("channels", contents.channels)):
        repeated = getattr(contents.summary, kind)
        if any(repeated.get(identity, record) != record for identity, record in ours.items()):
            raise DamageError(f"{kind} disagree with the summary's", contents.path, offset)


def chunk_block(buffer: mmap.mmap | bytes, frame: Frame, index: Iterable[Frame], contents: Contents) -> Block:
    """A chunk's content, checked.

    Raises
    ------
    DamageError
        if it does not parse, decompress or match its CRC.
    """
    chunk = parse(Chunk, bytes(buffer[frame.begin : frame.end]), contents.path, frame.start)
    contents.unprotected |= chunk.uncompressed_crc == 0
    bodies = tuple(bytes(buffer[after.begin : after.end]) for after in index)
    return Block(decompress(chunk, contents.path, frame.start), bodies, frame.start, frame.end - frame.start)


def _read_small(buffer: mmap.mmap | bytes, data: list[Frame], contents: Contents) -> None:
    for frame in data:
        if frame.opcode in SMALL:
            take_record(contents, frame.opcode, bytes(buffer[frame.begin : frame.end]), frame.start)


SMALL = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA, Opcode.ATTACHMENT)


def take_record(contents: Contents, opcode: int, body: bytes, offset: int) -> None:
    """Keep a schema, channel, metadata or attachment record.

    Raises
    ------
    DamageError
        if it does not parse.
    """
    if opcode != Opcode.ATTACHMENT and len(body) > MAX_DECLARATION:
        raise DamageError(f"a declaration of {len(body)} bytes, more than {MAX_DECLARATION},", contents.path, offset)
    counts = (contents.schemas, contents.channels, contents.metadata, contents.attachments)
    if max(len(kind) for kind in counts) >= MAX_CHANNELS:
        raise DamageError(f"more than {MAX_CHANNELS} schemas, channels or attachments", contents.path, offset)
    if opcode == Opcode.SCHEMA:
        schema = parse(Schema, body, contents.path, offset)
        contents.schemas[schema.id] = schema
    elif opcode == Opcode.CHANNEL:
        channel = parse(Channel, body, contents.path, offset)
        contents.channels[channel.id] = channel
    elif opcode == Opcode.METADATA:
        contents.metadata.append(parse(Metadata, body, contents.path, offset))
    elif opcode == Opcode.ATTACHMENT:
        stated = struct.unpack("<I", body[-4:].rjust(4, b"\0"))[0]
        if stated and zlib.crc32(body[:-4]) != stated:
            raise DamageError("CRC error of an attachment", contents.path, offset)
        contents.attachments.append(parse(Attachment, body, contents.path, offset))


def check_sections(buffer: mmap.mmap | bytes, summary: list[Frame], contents: Contents) -> None:
    """CRCs of the data and summary sections; keeps the statistics.

    ``summary`` is every record from the end of data (or the summary's first) to the footer.

    Raises
    ------
    DamageError
        if a checksum does not hold.
    """
    end, path = summary[0], contents.path
    if end.opcode == Opcode.DATA_END and end.end - end.begin == 4:
        stated = struct.unpack_from("<I", buffer, end.begin)[0]
        if stated and zlib.crc32(memoryview(buffer)[: end.start]) != stated:
            raise DamageError("CRC error of the data section ending", path, end.start)
    elif end.opcode == Opcode.DATA_END:
        raise DamageError("broken end of data", path, end.start)
    footer = parse(Footer, bytes(buffer[summary[-1].begin : summary[-1].end]), path, summary[-1].start)
    if footer.summary_crc:
        begin = footer.summary_start or summary[-1].start
        # The CRC covers the summary and the footer's own first fields: opcode, length and the two offsets.
        if zlib.crc32(memoryview(buffer)[begin : summary[-1].end - 4]) != footer.summary_crc:
            raise DamageError("CRC error of the summary ending", path, summary[-1].start)
    for frame in summary:
        body = bytes(buffer[frame.begin : frame.end])
        if frame.opcode == Opcode.STATISTICS:
            contents.statistics = parse(Statistics, body, path, frame.start)
        elif frame.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            take_record(contents.summary, frame.opcode, body, frame.start)


def read_header(buffer: mmap.mmap | bytes, path: Path) -> Header:
    """The header, which must be the first record.

    Raises
    ------
    DamageError
        if another record stands first.
    """
    first = next(iter(frames(buffer, path)))
    if first.opcode != Opcode.HEADER:
        raise DamageError("no header", path, first.start)
    return parse(Header, bytes(buffer[first.begin : first.end]), path, first.start)
