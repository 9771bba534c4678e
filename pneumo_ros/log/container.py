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
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import NamedTuple, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Header, Metadata, Schema, Statistics

from pneumo_ros.errors import InputError

MAGIC = b"\x89MCAP0\r\n"
FRAME = struct.Struct("<BQ")  # opcode and length before every record
FOOTER_LENGTH = 20
RECOVER = "pneumo log recover IN --output OUT keeps what is readable"

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
