# SPDX-License-Identifier: Apache-2.0
"""How much a log may ask for: a file of a few kilobytes can state, or unpack to, more than the computer has.

The limits lie far above what recorders write (chunks of 64 KiB to 4 MiB, some ten topics) and far below a computer's
memory. The one a real log of another writer may exceed, the chunk's, can be raised: ``pneumo --max-chunk MiB VERB``.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys.store import Typestore

from pneumo_ros.errors import InputError

MEBI = 1 << 20
DEFAULT_CHUNK = 256  # MiB
LARGEST_CHUNK = 4096  # MiB that --max-chunk takes
MAX_RATIO = 100  # of content to file; zstd makes a quiet log 10 to 20 times smaller
MAX_CHANNELS = 10_000
MAX_RECORDS = 1_500_000  # chunks and indexes, or one per kilobyte of a larger file; two hours of this rig have 800,000
MAX_DECLARATION = MEBI  # bytes of a schema, channel or metadata record
MAX_NESTING = 32  # types within types
MAX_FIELDS = 100_000  # numbers, texts and elements of fixed arrays in one message type
MAX_ARRAY = 16 * MEBI  # elements of a fixed array of numbers

_limit: ContextVar[int] = ContextVar("chunk_limit", default=DEFAULT_CHUNK * MEBI)


def chunk_limit() -> int:
    """Largest uncompressed chunk that is read, bytes."""
    return _limit.get()


def most_records(size: int) -> int:
    """Chunks and indexes of a file of ``size`` bytes."""
    return max(MAX_RECORDS, size // 1024)


def free_for_messages() -> int:
    """Bytes of messages that fit into memory: joining a topic's takes as much again for a moment."""
    try:
        rows = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines())
        return int(rows["MemAvailable"].split()[0]) * 1024 // 2
    except (OSError, KeyError, ValueError):
        return sys.maxsize


def set_chunk_limit(mebibytes: int) -> None:
    """Take another limit for the rest of this context, MiB."""
    _limit.set(mebibytes * MEBI)


@contextmanager
def chunks_up_to(mebibytes: int) -> Iterator[None]:
    """Another limit for a while, MiB."""
    token = _limit.set(mebibytes * MEBI)
    try:
        yield
    finally:
        _limit.reset(token)


def check_types(store: Typestore, name: str) -> None:
    """Refuse definitions that a short text makes endless: nested, doubling, or made of nothing.

    Raises
    ------
    InputError
        naming the type.
    """
    known: dict[str, int] = {}
    _fields(store, name, name, known, 0)


def _fields(store: Typestore, top: str, name: str, known: dict[str, int], depth: int) -> int:
    """Leaves of a type, fixed arrays counted element by element; each type is looked at once."""
    if depth > MAX_NESTING:
        raise _refused(top, f"nested deeper than {MAX_NESTING} types, or in itself")
    if name not in known:
        entries = store.fielddefs[name][1]
        known[name] = sum(_field(store, top, description, known, depth) for _, description in entries)
        if known[name] > MAX_FIELDS:
            raise _refused(top, f"more than {MAX_FIELDS} fields")
    return known[name]


def _field(store: Typestore, top: str, description: Any, known: dict[str, int], depth: int) -> int:
    node, inner = description  # rosbags: (kind, what it is made of)
    if node == Nodetype.NAME:
        return _fields(store, top, inner, known, depth + 1)
    if node == Nodetype.BASE:
        return 1
    element, size = inner
    if element[0] == Nodetype.NAME:
        each = _fields(store, top, element[1], known, depth + 1)
        if each == 0:
            raise _refused(top, "arrays of a type without fields")
        return each * (size if node == Nodetype.ARRAY else 1)
    if node == Nodetype.ARRAY and size > MAX_ARRAY:
        raise _refused(top, f"an array of {size} elements")
    text = element[1][0] in ("string", "wstring")
    return size if node == Nodetype.ARRAY and text else 1


def _refused(name: str, what: str) -> InputError:
    return InputError(f"the definition of {name} asks for too much: {what}", remedy="it is no message that is recorded")
