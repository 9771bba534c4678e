# SPDX-License-Identifier: Apache-2.0
"""Reading a damaged log: every chunk whose checksum holds, and an account of what is lost.

Nothing doubtful is kept: a chunk that fails its CRC is left out whole. After a broken record the scan goes on at the
next place from which records follow one another again: one flipped bit costs one chunk, not the rest of the file.
"""

from __future__ import annotations

import mmap
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from mcap.opcode import Opcode
from mcap.records import Footer, Header

from pneumo_ros.errors import InputError
from pneumo_ros.log.bags import PROFILE, Part, files_of
from pneumo_ros.log.container import FOOTER_LENGTH, FRAME, MAGIC, Block, Contents, DamageError, Frame, parse
from pneumo_ros.log.decoded import Log
from pneumo_ros.log.reading import assemble, read_log
from pneumo_ros.log.records import Gathered, gather
from pneumo_ros.log.sections import SMALL, check_ratio, check_sections, chunk_block, take_record
from pneumo_ros.log.unpacking import mapped

# A record starts with its opcode and a length; none here is 4 GiB long, so the upper half of the length is zero.
_START = re.compile(rb"[\x01-\x0f].{4}\x00\x00\x00\x00", re.DOTALL)
_CHAIN = 3  # records that must follow one another before a place is taken for a record's start
_NO_PLACE = "the file holds nothing readable"


@dataclass(frozen=True)
class Loss:
    """A stretch of the file that was left out.

    Attributes
    ----------
    file : the file it is in
    offset, length : bytes
    what : why, in words
    span_ns : log times of the first and last message in it, if the chunk's header tells
    content_bytes : uncompressed size, if the chunk's header tells; 0 otherwise
    """

    file: Path
    offset: int
    length: int
    what: str
    span_ns: tuple[int, int] | None = None
    content_bytes: int = 0


@dataclass
class Salvaged:
    """What could be read, and what could not.

    Attributes
    ----------
    log : the readable part
    losses : stretches left out, in file order
    expected : messages the file's own summary counts, or None if the summary is gone
    notes : doubts that are not losses: content without a checksum, a wrong checksum over the whole
    """

    log: Log
    losses: list[Loss]
    expected: int | None
    notes: list[str]

    @property
    def kept(self) -> int:
        """Messages read."""
        return sum(info.count for info in self.log.topics.values())

    @property
    def lost(self) -> int | None:
        """Messages lost; an estimate from chunk sizes where the summary is gone, None if even that is impossible.

        It is where nothing carries a checksum either: a message whose frame was spoiled leaves no trace.
        """
        if self.expected is not None:
            return max(self.expected - self.kept, 0)
        if self.log.unprotected:
            return None
        if not self.losses:
            return 0
        lost_bytes = sum(loss.content_bytes for loss in self.losses)
        kept_bytes = sum(len(self.log.records(topic).data) for topic in self.log.topics) + 31 * self.kept
        return round(lost_bytes * self.kept / kept_bytes) if lost_bytes and kept_bytes else None


class ChunkHeader(NamedTuple):
    """Start of a chunk record: log times of its first and last message, uncompressed size."""

    start_ns: int
    end_ns: int
    content_bytes: int


_CHUNK_HEAD = struct.Struct("<QQQ")
_NAME_AT = _CHUNK_HEAD.size + 4  # of the compression's name in a chunk: behind times, size and CRC
_NAME, _CONTENT = struct.Struct("<I"), struct.Struct("<Q")  # lengths of that name and of the content


@dataclass
class _Scan:
    """State of the scan of one file."""

    buffer: mmap.mmap | bytes
    contents: Contents
    losses: list[Loss] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    chunks: int = 0
    content: int = 0
    finished: bool = False

    def lose(self, begin: int, end: int, what: str, chunk: ChunkHeader | None = None) -> None:
        span = (chunk.start_ns, chunk.end_ns) if chunk else None
        size = chunk.content_bytes if chunk else 0
        self.losses.append(Loss(self.contents.path, begin, end - begin, what, span, size))


def salvage(path: str | Path) -> Salvaged:
    """Read what is readable of a damaged or unfinished log.

    Parameters
    ----------
    path : an .mcap (or .part) file, or a bag folder

    Raises
    ------
    InputError
        if nothing at all can be read, or the file is of another kind.
    """
    source = Path(path)
    parts, losses, notes = [], [], []
    expected: int | None = 0
    for file in files_of(source):
        part, scan = _salvage_file(file)
        parts.append(part)
        losses += scan.losses
        notes += scan.notes
        statistics = part.contents.statistics
        expected = None if expected is None or statistics is None else expected + statistics.message_count
    log = assemble(source, parts)
    if not log.topics:
        raise InputError(_NO_PLACE, where=source, remedy="no chunk of it is whole")
    if log.unprotected:
        notes.append("some messages carry no checksum: damage in their numbers cannot be seen")
    return Salvaged(log, losses, expected, notes)


def _salvage_file(path: Path) -> tuple[Part, _Scan]:
    with mapped(path) as buffer:
        scan = _Scan(buffer, Contents(path, Header("", "")))
        _learn_summary(scan)
        pieces: dict[int, Gathered] = {}
        for block in _blocks(scan):
            try:
                gather(block, None, pieces, scan.contents)
            except DamageError as error:
                scan.lose(block.offset, block.offset + block.size, error.fault)
        _check_profile(scan)
    records = {i: pieces.pop(i, Gathered()).records() for i in scan.contents.channels}
    return Part(scan.contents, records), scan


def _check_profile(scan: _Scan) -> None:
    header = scan.contents.header
    if header.profile not in (PROFILE, ""):
        raise InputError(
            "another profile", where=scan.contents.path, key="profile", value=header.profile, allowed=PROFILE
        )
    if header.profile == "":
        scan.notes.append("the header is gone or empty; the log is taken for one of ROS 2")
        scan.contents.header = Header(PROFILE, header.library)


def _learn_summary(scan: _Scan) -> None:
    """Schemas, channels and counts from the summary, if it is whole: the chunk that declared them may be lost."""
    buffer, contents = scan.buffer, scan.contents
    start = len(buffer) - len(MAGIC) - FOOTER_LENGTH - FRAME.size
    if start < len(MAGIC) or buffer[-len(MAGIC) :] != MAGIC:
        return
    frame = Frame(buffer[start], start + FRAME.size, len(buffer) - len(MAGIC))
    if FRAME.unpack_from(buffer, start) != (Opcode.FOOTER, FOOTER_LENGTH):
        return
    footer = parse(Footer, bytes(buffer[frame.begin : frame.end]), contents.path, start)
    if not len(MAGIC) < footer.summary_start < start:
        return
    try:
        summary = list(_follow(buffer, footer.summary_start, start))
        check_sections(buffer, [*summary, frame], contents)
        contents.schemas.update(contents.summary.schemas)
        contents.channels.update(contents.summary.channels)
    except DamageError as error:
        contents.statistics = None
        scan.notes.append(f"the summary is broken ({error.fault}); what is lost is estimated")


def _follow(buffer: mmap.mmap | bytes, begin: int, end: int) -> Iterator[Frame]:
    while begin < end:
        frame = _frame_at(buffer, begin)
        if frame is None:
            return
        yield frame
        begin = frame.end


def _frame_at(buffer: mmap.mmap | bytes, position: int) -> Frame | None:
    """The record that starts here, if it can be one."""
    if position + FRAME.size > len(buffer):
        return None
    opcode, length = FRAME.unpack_from(buffer, position)
    frame = Frame(opcode, position + FRAME.size, position + FRAME.size + length)
    known = Opcode.HEADER <= opcode <= Opcode.DATA_END or opcode >= 0x80
    return frame if known and frame.end <= len(buffer) else None


def _blocks(scan: _Scan) -> Iterator[Block]:
    """Sound blocks of messages in file order; what lies between goes to the losses."""
    buffer = scan.buffer
    position = len(MAGIC)
    if buffer[: len(MAGIC)] != MAGIC:
        position = _resync(buffer, 0)
        if position == len(buffer):
            raise InputError("not an MCAP file", where=scan.contents.path, remedy="give a session log (.mcap)")
        scan.lose(0, position, "broken start of the file")
    while position < len(buffer) and not scan.finished:
        frame = _frame_at(buffer, position)
        try:
            if frame is None:
                raise DamageError("broken or unfinished record", scan.contents.path, position)
            block = _take(scan, frame)
            position = _end(scan, frame)
        except DamageError as error:
            position = _skip(scan, frame, position, error)
            continue
        if block is not None:
            yield block
    if not scan.finished:
        scan.notes.append("the file ends without its footer: the recorder did not finish it, or the end is cut off")


def _take(scan: _Scan, frame: Frame) -> Block | None:
    buffer, contents = scan.buffer, scan.contents
    if frame.opcode == Opcode.CHUNK:
        block = chunk_block(buffer, frame, [], contents)
        scan.content = check_ratio(scan.content + len(block.data), buffer, contents.path, frame.start)
        scan.chunks += 1
        return block
    if frame.opcode == Opcode.MESSAGE:
        if scan.chunks:  # loose messages in a chunked file are the inside of a chunk whose frame is broken
            raise DamageError("inside of a broken chunk", contents.path, frame.start)
        contents.unprotected = True
        return Block(bytes(buffer[frame.start : frame.end]), (), frame.start, frame.end - frame.start)
    if frame.opcode == Opcode.HEADER:
        contents.header = parse(Header, bytes(buffer[frame.begin : frame.end]), contents.path, frame.start)
    elif frame.opcode in SMALL:
        take_record(contents, frame.opcode, bytes(buffer[frame.begin : frame.end]), frame.start)
    elif frame.opcode == Opcode.DATA_END:
        _finish(scan, frame)
    return None


def _end(scan: _Scan, frame: Frame) -> int:
    """Where the next record begins. A chunk says twice how long it is: where its content is whole, that length is
    right, and a record that claims to be longer must not swallow the chunks behind it."""
    if frame.opcode != Opcode.CHUNK:
        return frame.end
    (name,) = _NAME.unpack_from(scan.buffer, frame.begin + _NAME_AT)
    (content,) = _CONTENT.unpack_from(scan.buffer, frame.begin + _NAME_AT + _NAME.size + name)
    end = frame.begin + _NAME_AT + _NAME.size + name + _CONTENT.size + content
    if end != frame.end:
        scan.notes.append(f"the length of the chunk at byte {frame.start} is wrong; its content is whole")
    return int(end)


def _finish(scan: _Scan, frame: Frame) -> None:
    try:
        check_sections(scan.buffer, [frame, *_follow(scan.buffer, frame.end, len(scan.buffer))], scan.contents)
    except DamageError as error:
        scan.notes.append(error.fault)
    scan.finished = True


def _skip(scan: _Scan, frame: Frame | None, position: int, error: DamageError) -> int:
    """Where to go on after a broken record; what lies before is lost."""
    buffer = scan.buffer
    chunk = _chunk_header(buffer, position)
    # A chunk whose content is broken keeps its frame: the next record tells whether its length can be believed.
    trusted = frame is not None and _chained(buffer, frame.end)
    after = frame.end if frame is not None and trusted else _resync(buffer, position + 1)
    scan.lose(position, after, error.fault, chunk)
    return after


def _chunk_header(buffer: mmap.mmap | bytes, position: int) -> ChunkHeader | None:
    """Times and size from the head of a chunk that cannot be read whole; None if they make no sense."""
    begin = position + FRAME.size
    if buffer[position : position + 1] != bytes([Opcode.CHUNK]) or begin + _CHUNK_HEAD.size > len(buffer):
        return None
    header = ChunkHeader(*_CHUNK_HEAD.unpack_from(buffer, begin))
    return header if header.start_ns <= header.end_ns and header.content_bytes < 2**32 else None


def _resync(buffer: mmap.mmap | bytes, position: int) -> int:
    """The next place where records follow one another, or the end of the file."""
    while (match := _START.search(buffer, position)) is not None:
        if _chained(buffer, match.start()):
            return match.start()
        position = match.start() + 1
    return len(buffer)


def _chained(buffer: mmap.mmap | bytes, position: int) -> bool:
    """Whether records follow one another from here, to the end of the file or for a while."""
    for _ in range(_CHAIN):
        frame = _frame_at(buffer, position)
        if frame is None:
            return False
        if frame.opcode == Opcode.FOOTER:
            return frame.end - frame.begin == FOOTER_LENGTH and buffer[frame.end :] == MAGIC
        if frame.end == len(buffer):
            return True
        position = frame.end
    return True


def read_or_salvage(path: Path) -> tuple[Log, str]:
    """The log, or what is left of it and a line that says so; '' if it is whole.

    Raises
    ------
    InputError
        if nothing can be read.
    """
    try:
        return read_log(path), ""
    except DamageError as error:
        found = salvage(path)
        of = f" of {found.expected}" if found.expected is not None else ""
        return found.log, f"{error.what}, {path}: going on with the {found.kept}{of} messages that are whole"
