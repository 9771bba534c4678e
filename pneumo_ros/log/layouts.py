# SPDX-License-Identifier: Apache-2.0
"""Where the fields of a serialised message lie, so that thousands are decoded by one array view.

Messages of a sensor topic differ in their numbers only: frame id, channel names and array lengths stay. So the layout
of the first message (from its type's definition) holds for all that are equally long and agree in those constant bytes;
:func:`decode` checks both and gives up (None) otherwise, and the caller deserialises one by one.

CDR as ROS 2 writes it (XCDR1): a primitive is aligned to its size, counted from the end of the 4-byte header; text and
sequences start with a 32-bit length; an empty sequence has no padding after its length.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.base import TypesysError
from rosbags.typesys.store import Typestore

from pneumo_ros.errors import InputError
from pneumo_ros.log.bounds import check_types

ORIGIN = 4  # CDR header: two bytes of encoding (00 00 big, 00 01 little endian), two of options
_PRIMITIVES = {
    "bool": "?", "byte": "u1", "char": "u1", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
_MANY = 4096  # longer sequences of structures or texts are left to the generic way
_ROWS = 65536  # rows compared at once: bounds the memory of the check

Text = str | tuple[str, ...]


@dataclass(frozen=True)
class Leaf:
    """A number, or an array of ``count`` numbers, at a fixed byte."""

    path: str
    dtype: str
    offset: int
    count: int | None


@dataclass(frozen=True)
class Layout:
    """Fixed places of one message type with given texts and array lengths.

    Attributes
    ----------
    length : bytes of a message, header included
    leaves : its numbers
    texts : its strings, constant over all messages of this layout
    constant : (length,) True where messages must agree with ``sample``: header, lengths, texts
    sample : the message the layout was taken from
    """

    length: int
    leaves: tuple[Leaf, ...]
    texts: dict[str, Text]
    constant: NDArray[np.bool_]
    sample: NDArray[np.uint8]


class UnfitError(Exception):
    """The type or this message has no fixed layout."""


@lru_cache(maxsize=256)
def type_store(name: str, encoding: str, definition: str) -> Typestore:
    """Types of one schema, from the definition the log itself carries.

    Raises
    ------
    InputError
        if the definition cannot be read.
    """
    parsers = {"ros2msg": get_types_from_msg, "ros2idl": None, "omgidl": None}
    if encoding not in parsers:
        raise InputError(
            f"schema encoding {encoding!r} of {name} cannot be decoded", allowed="ros2msg, ros2idl, omgidl"
        )
    parse = parsers[encoding]
    try:
        types = parse(definition, name) if parse else get_types_from_idl(definition)
        store = get_typestore(Stores.EMPTY)
        store.register(types)
        _fill(store)
        check_types(store, name)
    except InputError:
        raise
    except (TypesysError, KeyError, ValueError, SyntaxError, RecursionError, IndexError, TypeError) as error:
        raise InputError(
            f"the definition of {name} cannot be read", remedy="record it again with its schema"
        ) from error
    return store


@lru_cache(maxsize=1)
def _standard() -> Typestore:
    return get_typestore(Stores.ROS2_JAZZY)


@lru_cache(maxsize=256)
def lacks_standard_fields(store: Typestore, name: str) -> bool:
    """Whether the log's definition of a type of ROS 2's own lacks a field that the standard one has, at any depth."""
    standard = _standard()
    open_names, seen = [name], set[str]()
    while open_names:
        one = open_names.pop()
        if one in seen or one not in standard.fielddefs:
            continue
        seen.add(one)
        wanted = standard.fielddefs[one][1]
        own = dict(store.fielddefs[one][1]) if one in store.fielddefs else {}
        if any(own.get(field) != kind for field, kind in wanted):
            return True
        open_names += _named(wanted)
    return False


def _fill(store: Typestore) -> None:
    """Nested types that the schema leaves out, from the standard ones."""
    missing = {name for _, fields in store.fielddefs.values() for name in _named(fields)} - set(store.fielddefs)
    if missing:
        standard = _standard()
        store.register({name: standard.fielddefs[name] for name in missing})
        _fill(store)


def _named(fields: Any) -> list[str]:
    names = []
    for _, (node, inner) in fields:
        if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            node, inner = inner[0]
        if node == Nodetype.NAME:
            names.append(inner)
    return names


@dataclass
class _Cursor:
    """Walks one message, noting what it passes."""

    store: Typestore
    data: bytes
    order: Literal["<", ">"]
    position: int = ORIGIN
    leaves: list[Leaf] = field(default_factory=list)
    texts: dict[str, Text] = field(default_factory=dict)
    constants: list[tuple[int, int]] = field(default_factory=lambda: [(0, ORIGIN)])

    def align(self, size: int) -> None:
        self.position += (ORIGIN - self.position) % size

    def length(self) -> int:
        self.align(4)
        (count,) = struct.unpack_from(self.order + "I", self.data, self.position)
        self.constants.append((self.position, self.position + 4))
        self.position += 4
        return int(count)

    def text(self) -> str:
        count = self.length()
        end = self.position + count
        raw = self.data[self.position : end]
        if len(raw) != count or (count and raw[-1]):
            raise UnfitError
        self.constants.append((self.position, end))
        self.position = end
        return raw[:-1].decode("utf-8")

    def numbers(self, path: str, base: str, count: int | None) -> None:
        dtype = np.dtype(_PRIMITIVES[base]).newbyteorder(self.order)
        if count != 0:
            self.align(dtype.itemsize)
        self.leaves.append(Leaf(path, dtype.str, self.position, count))
        self.position += dtype.itemsize * (1 if count is None else count)
        if self.position > len(self.data):
            raise UnfitError

    def structure(self, path: str, name: str) -> None:
        for entry, description in self.store.fielddefs[name][1]:
            self.field(f"{path}.{entry}" if path else entry, description)

    def field(self, path: str, description: Any) -> None:
        node, inner = description
        if node == Nodetype.NAME:
            self.structure(path, inner)
        elif node == Nodetype.BASE:
            self.single(path, inner[0])
        else:
            element, size = inner
            self.several(path, element, size if node == Nodetype.ARRAY else self.length())

    def single(self, path: str, base: str) -> None:
        if base == "string":
            self.texts[path] = self.text()
        elif base in _PRIMITIVES:
            self.numbers(path, base, None)
        else:
            raise UnfitError

    def several(self, path: str, element: Any, count: int) -> None:
        node, inner = element
        if node == Nodetype.BASE and inner[0] in _PRIMITIVES:
            self.numbers(path, inner[0], count)
        elif count > _MANY:
            raise UnfitError
        elif node == Nodetype.BASE and inner[0] == "string":
            self.texts[path] = tuple(self.text() for _ in range(count))
        elif node == Nodetype.NAME:
            for i in range(count):
                self.structure(f"{path}[{i}]", inner)
        else:
            raise UnfitError


def layout_of(store: Typestore, name: str, sample: bytes) -> Layout | None:
    """The layout of type ``name`` as this message shows it, or None if it has none.

    Parameters
    ----------
    store : types, see :func:`type_store`
    name : full name, ``pkg/msg/Type``
    sample : one serialised message with its CDR header
    """
    if sample[:2] not in (b"\x00\x00", b"\x00\x01"):
        return None
    cursor = _Cursor(store, sample, "<" if sample[1] else ">")
    try:
        cursor.structure("", name)
    except (UnfitError, struct.error, UnicodeDecodeError, KeyError):
        return None
    if not 0 <= len(sample) - cursor.position < 4:  # writers may pad to a multiple of four
        return None
    constant = np.zeros(len(sample), np.bool_)
    for begin, end in cursor.constants:
        constant[begin:end] = True
    return Layout(len(sample), tuple(cursor.leaves), cursor.texts, constant, np.frombuffer(sample, np.uint8))


def decode(
    layout: Layout, rows: NDArray[np.uint8], only: tuple[str, ...] | None = None
) -> dict[str, NDArray[Any]] | None:
    """Every number of every message, by path; None if a message does not have this layout.

    Parameters
    ----------
    layout : from one of the messages
    rows : (N, length) serialised messages
    only : paths to decode; all without it

    Returns
    -------
    arrays (N,) for scalars, (N, count) for arrays, in native byte order
    """
    if rows.shape[1] != layout.length or not _agrees(layout, rows):
        return None
    return {leaf.path: _column(leaf, rows) for leaf in layout.leaves if only is None or leaf.path in only}


def _agrees(layout: Layout, rows: NDArray[np.uint8]) -> bool:
    columns = np.flatnonzero(layout.constant)
    wanted = layout.sample[columns]
    # Runs of bytes compare faster than single ones, but take() on a block of rows is quick enough: 15 ns a byte.
    return all(bool(np.all(rows[i : i + _ROWS].take(columns, axis=1) == wanted)) for i in range(0, len(rows), _ROWS))


def _column(leaf: Leaf, rows: NDArray[np.uint8]) -> NDArray[Any]:
    dtype = np.dtype(leaf.dtype)
    shape = (len(rows),) if leaf.count is None else (len(rows), leaf.count)
    strides = (rows.strides[0],) if leaf.count is None else (rows.strides[0], dtype.itemsize)
    if 0 in shape:
        return np.empty(shape, dtype.newbyteorder("="))
    view: NDArray[Any] = np.ndarray(shape, dtype, rows, leaf.offset, strides)
    return view.astype(dtype.newbyteorder("="))
