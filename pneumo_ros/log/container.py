# SPDX-License-Identifier: Apache-2.0
"""The MCAP container: records with every bound and checksum checked, nothing decoded.

Framing and bounds are done here because the reader must tell *where* a damaged file breaks and must never take a short
read for a record; the records themselves are parsed by the ``mcap`` library. Nothing here knows of ROS.

What protects what in an MCAP file: each chunk carries the CRC of its uncompressed content, the data section may carry
one of its own, and so may the summary. A file written without them (``rosbag2``'s fast-write preset) can only be
checked for structure; :attr:`Contents.unprotected` says so.
"""

from __future__ import annotations

import mmap
import struct
import tempfile
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from io import BytesIO
from itertools import islice, takewhile
from pathlib import Path
from typing import BinaryIO, NamedTuple, TypeVar

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Footer, Header, Metadata, Schema, Statistics

from pneumo_ros.errors import InputError
from pneumo_ros.log.bounds import MAX_CHANNELS, MAX_DECLARATION, MAX_RATIO, MAX_RECORDS, MEBI, chunk_limit

MAGIC = b"\x89MCAP0\r\n"
FRAME = struct.Struct("<BQ")  # opcode and length before every record
FOOTER_LENGTH = 20
RECOVER = "pneumo log recover IN --output OUT keeps what is readable"
LARGER = "no recorder writes this; if the log can be trusted, give a larger limit: pneumo --max-chunk MiB VERB"

# In the data section these may stand, in any order; anything else there is a flipped opcode (or a future record).
_DATA_RECORDS = {
    Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK, Opcode.MESSAGE_INDEX,
    Opcode.ATTACHMENT, Opcode.METADATA, Opcode.DATA_END,
}  # fmt: skip


class DamageError(InputError):
    """The container is broken at a known byte; what precedes it can be recovered."""

    def __init__(self, fault: str, path: object, offset: int, remedy: str = RECOVER) -> None:
        self.fault, self.offset = fault, offset
        super().__init__(f"{fault} at byte {offset}", where=path, remedy=remedy)


class Frame(NamedTuple):
    """One record of the file: its opcode and where its body lies."""

    opcode: int
    begin: int
    end: int

    @property
    def start(self) -> int:
        """Offset of the opcode."""
        return self.begin - FRAME.size


class Block(NamedTuple):
    """Consecutive records in one buffer: a chunk's content, or the loose records of an unchunked file."""

    data: bytes
    hints: tuple[bytes, ...]  # bodies of the chunk's MessageIndex records; verified before use
    offset: int  # of the chunk in the file
    size: int  # of the chunk in the file


@dataclass
class Contents:
    """What the file holds outside its messages."""

    path: Path
    header: Header
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: list[Metadata] = field(default_factory=list)
    attachments: list[Attachment] = field(default_factory=list)
    statistics: Statistics | None = None
    unprotected: bool = False
    _summary: Contents | None = None

    @property
    def summary(self) -> Contents:
        """Schemas and channels as the summary repeats them."""
        if self._summary is None:
            self._summary = Contents(self.path, self.header)
        return self._summary


class _ExactStream(ReadDataStream):
    """The library takes what is left for what was asked; a broken length must not pass as a short text."""

    def read(self, length: int) -> bytes:
        data: bytes = super().read(length)
        if len(data) != length:
            raise EndOfFile
        return data


R = TypeVar("R")


def parse(kind: type[R], body: bytes, path: object, offset: int) -> R:
    """One small record, or a :class:`DamageError` that says where it is."""
    stream = _ExactStream(BytesIO(body))
    try:
        record: R = kind.read(stream)  # type: ignore[attr-defined]
    except (McapError, struct.error, UnicodeDecodeError, MemoryError, OverflowError) as error:
        raise DamageError(f"broken {kind.__name__} record", path, offset) from error
    return record


@contextmanager
def mapped(path: Path) -> Iterator[mmap.mmap | bytes]:
    """The file's bytes, mapped so that a long log does not have to fit in memory twice.

    A file that ``ros2 bag record --compression-mode file`` packed as a whole (``.zstd``) is unpacked beside it.

    Raises
    ------
    InputError
        if it cannot be read or unpacked.
    """
    try:
        stream = path.open("rb")
    except OSError as error:
        raise InputError(f"cannot read the log ({error})", where=path, remedy="give a readable file") from error
    with stream:
        if path.suffix == ".zstd":
            with _unpacked(stream, path) as buffer:
                yield buffer
        elif path.stat().st_size == 0:
            yield b""
        else:
            with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as buffer:
                yield buffer


@contextmanager
def _unpacked(stream: BinaryIO, path: Path) -> Iterator[mmap.mmap | bytes]:
    """Unpacked piece by piece into a file without a name, so that memory never holds it whole."""
    most = max(chunk_limit(), MAX_RATIO * path.stat().st_size)
    try:
        with zstandard.ZstdDecompressor().stream_reader(stream) as reader, tempfile.TemporaryFile() as unpacked:
            while piece := reader.read(MEBI):
                if unpacked.tell() + len(piece) > most:
                    raise InputError(f"the packed file holds more than {most >> 20} MiB", where=path, remedy=LARGER)
                unpacked.write(piece)
            unpacked.flush()
            if unpacked.tell() == 0:
                yield b""
                return
            with mmap.mmap(unpacked.fileno(), 0, access=mmap.ACCESS_READ) as buffer:
                yield buffer
    except (zstandard.ZstdError, MemoryError, OSError) as error:
        raise InputError(
            f"the packed file is broken ({error})", where=path, remedy="nothing in it can be told"
        ) from error


def check_magic(buffer: mmap.mmap | bytes, path: Path) -> None:
    """Refuse what is not an MCAP file at all.

    Raises
    ------
    InputError
        if the file is empty or starts with other bytes.
    """
    if len(buffer) == 0:
        raise InputError("the file is empty", where=path, remedy="nothing can be recovered from it")
    if buffer[: len(MAGIC)] != MAGIC:
        raise InputError(
            "not an MCAP file", where=path, value=bytes(buffer[:8]), remedy="give a session log (.mcap) or a bag folder"
        )


def frames(buffer: mmap.mmap | bytes, path: Path) -> Iterator[Frame]:
    """Every record up to and including the footer.

    Raises
    ------
    DamageError
        if a record leaves the file, an unknown record stands in the data section, or the file ends without its footer.
    """
    position, in_data = len(MAGIC), True
    while position + FRAME.size <= len(buffer):
        opcode, length = FRAME.unpack_from(buffer, position)
        frame = Frame(opcode, position + FRAME.size, position + FRAME.size + length)
        if frame.end > len(buffer):
            raise DamageError("the file ends inside a record (truncated, or a broken length)", path, position)
        if in_data and opcode not in _DATA_RECORDS and opcode < 0x80:  # from 0x80 on: private records, to be skipped
            raise DamageError(f"unexpected record 0x{opcode:02x}", path, position)
        yield frame
        if opcode == Opcode.FOOTER:
            _check_end(buffer, frame, path)
            return
        in_data = in_data and opcode != Opcode.DATA_END
        position = frame.end
    raise DamageError("the file ends without a footer (truncated, or its recorder was killed)", path, position)


def _check_end(buffer: mmap.mmap | bytes, footer: Frame, path: Path) -> None:
    if footer.end - footer.begin != FOOTER_LENGTH or buffer[footer.end :] != MAGIC:
        raise DamageError("broken footer", path, footer.start)


def decompress(chunk: Chunk, path: object, offset: int) -> bytes:
    """The chunk's records, their size and CRC checked.

    Raises
    ------
    DamageError
        if the content does not decompress to what the chunk promises.
    """
    if max(chunk.uncompressed_size, len(chunk.data)) > chunk_limit():
        large = max(chunk.uncompressed_size, len(chunk.data))
        raise DamageError(f"a chunk of {large} bytes, more than {chunk_limit() >> 20} MiB,", path, offset, LARGER)
    try:
        data = _decompressed(chunk)
    except (zstandard.ZstdError, RuntimeError, ValueError, MemoryError, EOFError) as error:
        raise DamageError(f"a chunk does not decompress ({chunk.compression!r:.20})", path, offset) from error
    if len(data) != chunk.uncompressed_size:
        raise DamageError(f"a chunk holds other than the {chunk.uncompressed_size} bytes it states", path, offset)
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise DamageError("CRC error of a chunk", path, offset)
    return data


def _decompressed(chunk: Chunk) -> bytes:
    # Nothing is allocated for a size that only the compressed data state, and unpacking ends one byte past the promise.
    most = chunk.uncompressed_size + 1
    if chunk.compression == "zstd":
        size = zstandard.frame_content_size(chunk.data)
        if size not in (-1, chunk.uncompressed_size):
            raise ValueError("size")
        if size >= 0:
            return zstandard.ZstdDecompressor().decompress(chunk.data)
        with zstandard.ZstdDecompressor().stream_reader(chunk.data) as reader:
            return bytes(reader.read(most))
    if chunk.compression == "lz4":
        import lz4.frame

        unpacker = lz4.frame.LZ4FrameDecompressor()
        return bytes(unpacker.decompress(chunk.data, max_length=most))
    if chunk.compression == "":
        return bytes(chunk.data)
    raise ValueError("compression")


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
            index = takewhile(lambda f: f.opcode == Opcode.MESSAGE_INDEX, islice(data, i + 1, None))
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
    for frame in frames(buffer, path):
        if frame.opcode == Opcode.MESSAGE:
            begin = loose.pop()[0] if loose and loose[-1][1] == frame.start else frame.start
            loose.append((begin, frame.end))
        elif frame.opcode < 0x80:
            kept.append(frame)
        if len(kept) > MAX_RECORDS:
            raise DamageError(f"more than {MAX_RECORDS} records", path, frame.start)
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
        promised = struct.unpack("<I", body[-4:].rjust(4, b"\0"))[0]
        if promised and zlib.crc32(body[:-4]) != promised:
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
        promised = struct.unpack_from("<I", buffer, end.begin)[0]
        if promised and zlib.crc32(memoryview(buffer)[: end.start]) != promised:
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
