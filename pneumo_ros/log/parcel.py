# SPDX-License-Identifier: Apache-2.0
"""Several serialised messages in one, each with its topic: what the nodes of a lockstep session send one another.

Between processes a message costs for being delivered, hardly for its size. A message in a parcel has the bytes that
its topic would carry, so that whoever opens it, the recorder first of all, has the same as every other listener.

Layout: a serialised std_msgs/msg/UInt8MultiArray without dimensions. Its data are the messages one after the other,
each as length of the topic's name (uint16) and of the message (uint32), little endian, the name in UTF-8, the message.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator

from pneumo_ros.errors import InputError
from pneumo_ros.log.cdr import HEADER

_BEFORE = struct.Struct("<4s3I")  # encapsulation, no dimensions, no offset, bytes of data
_LENGTHS = struct.Struct("<HI")


def pack(messages: Iterable[tuple[str, bytes]]) -> bytes:
    """One serialised message of many: (topic's name, serialised message) each, in this order."""
    parts: list[bytes] = []
    for topic, data in messages:
        name = topic.encode()
        parts += (_LENGTHS.pack(len(name), len(data)), name, data)
    content = b"".join(parts)
    return _BEFORE.pack(HEADER, 0, 0, len(content)) + content


def unpack(parcel: bytes, where: str) -> Iterator[tuple[str, bytes]]:
    """What :func:`pack` was given.

    Raises
    ------
    InputError
        naming the topic ``where`` the bytes came from, if they are no parcel; what came before the fault was given.
    """
    try:
        _, dimensions, _, size = _BEFORE.unpack_from(parcel)
        at, end = _BEFORE.size, _BEFORE.size + size
        if dimensions or end > len(parcel):
            raise ValueError(f"{len(parcel)} bytes, {dimensions} dimensions, {size} bytes of data")
        while at < end:
            named, long = _LENGTHS.unpack_from(parcel, at)
            begin = at + _LENGTHS.size
            at = begin + named + long
            if at > end:
                raise ValueError("a message beyond the end")
            yield parcel[begin : begin + named].decode(), parcel[begin + named : at]
    except (struct.error, ValueError) as error:  # a name that is no UTF-8 is a ValueError as well
        raise InputError(f"not a parcel of messages ({error})", where=where) from error
