# SPDX-License-Identifier: Apache-2.0
"""Consistent overhead byte stuffing (Cheshire and Baker, 1999) of what fits into a frame of the serial protocol.

Each run of bytes without a zero gets its length + 1 in front and loses the zero behind it, so that 0x00 ends a frame.
A frame is shorter than a full run of 254 bytes, so the code 0xFF, which stands for one, never occurs in it: without
that case both directions are a few lines. (ROS has no package of a COBS library, and a line at 1 kHz needs no more.)
"""

from __future__ import annotations

LONGEST = 253  # bytes of data: one more could make a full run
_CODES = tuple(bytes((length + 1,)) for length in range(LONGEST + 1))


def stuffed(data: bytes) -> bytes:
    """``data`` without a zero in it, one byte longer.

    Raises
    ------
    ValueError
        if the data is longer than :data:`LONGEST`.
    """
    if len(data) > LONGEST:
        raise ValueError(f"{len(data)} bytes to stuff, {LONGEST} are allowed")
    return b"".join([_CODES[len(run)] + run for run in data.split(b"\x00")])


def unstuffed(frame: bytes) -> bytes:
    """The data of a stuffed frame, given without its delimiter.

    Raises
    ------
    ValueError
        if a zero stands in it or its last run is cut short.
    """
    if len(frame) > LONGEST + 1 or 0 in frame:
        raise ValueError("too long, or a zero inside")
    data, at, end = bytearray(frame), 0, len(frame)
    while at < end:
        code = data[at]
        data[at] = 0  # each length stands where the zero before its run was; the first has none before it
        at += code
    if at != end:
        raise ValueError("the last run is cut short")
    return bytes(data[1:])
