# SPDX-License-Identifier: Apache-2.0
"""Bytes of a log file and of its chunks: mapped, and unpacked within bounds."""

from __future__ import annotations

import mmap
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import zstandard
from mcap.records import Chunk

from pneumo_ros.errors import InputError
from pneumo_ros.log.bounds import MAX_RATIO, MEBI, chunk_limit
from pneumo_ros.log.container import DamageError

LARGER = "no recorder writes this; if the log can be trusted, give a larger limit: pneumo --max-chunk MiB VERB"


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


def decompress(chunk: Chunk, path: object, offset: int) -> bytes:
    """The chunk's records, their size and CRC checked.

    Raises
    ------
    DamageError
        if the content does not decompress to what the chunk states.
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
    # Nothing is allocated for a size that only the compressed data state, and unpacking ends one byte past it.
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
