# SPDX-License-Identifier: Apache-2.0
"""Fixed-layout CDR of the two messages of the control loop, without a generic converter.

JointState and FluidPressure make up nearly all of the traffic. Converting a JointState through rclpy's Python objects
costs more than the whole control law (measured: 197 us a lockstep tick with typed messages, 97 us with raw ones, ten
topics), so the loop publishes and receives serialised bytes. The layout of a topic is fixed once its names are known:
encoders fill a template; decoders learn the layout from the first message and use it as long as every byte outside
stamp and values stays the same, else they read the message afresh. Tests hold both against rclpy's own serialisation.

Encoding: OMG CDR little endian, four bytes of encapsulation header, alignment counted after it.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.errors import InputError

HEADER = b"\x00\x01\x00\x00"
STAMP = struct.Struct("<iI")
NANO = 1_000_000_000
_AFTER_STAMP = len(HEADER) + STAMP.size


class JointEncoder:
    """Serialise JointState messages with fixed frame_id and names.

    Parameters
    ----------
    frame_id : of the header
    names : in the order of the values
    with_velocity : whether ``velocity`` carries as many values as ``position``
    """

    def __init__(self, frame_id: str, names: Sequence[str], with_velocity: bool = False) -> None:
        body = bytearray(HEADER + bytes(STAMP.size))
        _append_string(body, frame_id)
        _append_count(body, len(names))
        for name in names:
            _append_string(body, name)
        self._position = _append_doubles(body, len(names))
        self._velocity = _append_doubles(body, len(names) if with_velocity else 0)
        _append_doubles(body, 0)
        self._template = body
        self._values = struct.Struct(f"<{len(names)}d")
        self._with_velocity = with_velocity

    def encode_array(self, stamp_ns: int, position: NDArray[np.float64]) -> bytes:
        """:meth:`encode` from a contiguous float64 array, without a Python float a value."""
        body = self._template
        STAMP.pack_into(body, len(HEADER), *divmod(stamp_ns, NANO))
        body[self._position : self._position + self._values.size] = position.tobytes()
        return bytes(body)

    def encode(self, stamp_ns: int, position: Sequence[float], velocity: Sequence[float] = ()) -> bytes:
        """One message: ``stamp_ns`` since the epoch, values in the order of the names."""
        body = self._template
        STAMP.pack_into(body, len(HEADER), *divmod(stamp_ns, NANO))
        self._values.pack_into(body, self._position, *position)
        if self._with_velocity:
            self._values.pack_into(body, self._velocity, *velocity)
        return bytes(body)


class JointDecoder:
    """Read the ``position`` values of wanted names from serialised JointState messages, in the wanted order.

    Raises InputError from :meth:`decode` when a name is missing or the bytes are no such message.
    """

    def __init__(self, topic: str, names: Sequence[str]) -> None:
        self._topic, self._names = topic, tuple(names)
        self._prefix = b""
        self._length = 0
        self._values = struct.Struct("<0d")
        self._order: tuple[int, ...] | None = None

    def decode(self, data: bytes) -> tuple[int, tuple[float, ...]]:
        """(stamp in ns, values)."""
        start = len(self._prefix) + _AFTER_STAMP
        if len(data) != self._length or data[_AFTER_STAMP:start] != self._prefix:
            start = self._learn(data)
        sec, nanosec = STAMP.unpack_from(data, len(HEADER))
        values = self._values.unpack_from(data, _aligned(start))
        if self._order is not None:
            values = tuple(values[i] for i in self._order)
        return sec * NANO + nanosec, values

    def decode_array(self, data: bytes) -> tuple[int, NDArray[np.float64]]:
        """:meth:`decode` into a new array."""
        start = len(self._prefix) + _AFTER_STAMP
        if len(data) != self._length or data[_AFTER_STAMP:start] != self._prefix:
            start = self._learn(data)
        sec, nanosec = STAMP.unpack_from(data, len(HEADER))
        values = np.frombuffer(data, np.float64, self._values.size // 8, _aligned(start))
        return sec * NANO + nanosec, values.copy() if self._order is None else values[list(self._order)]

    def _learn(self, data: bytes) -> int:
        try:
            names, start = _read_names(data)
            (count,) = struct.unpack_from("<I", data, start - 4)
            order = tuple(names.index(name) for name in self._names)
            self._values = struct.Struct(f"<{count}d")
            self._values.unpack_from(data, _aligned(start))
        except (struct.error, UnicodeDecodeError) as error:
            raise InputError(f"not a JointState message ({error})", where=self._topic) from error
        except ValueError as error:
            raise InputError("a name is missing from the message", where=self._topic, value=names,
                             allowed=", ".join(self._names), remedy="publish every named value") from error  # fmt: skip
        if count != len(names):
            raise InputError("position and name differ in length", where=self._topic, value=(count, len(names)))
        self._order = None if order == tuple(range(count)) else order
        self._prefix, self._length = data[_AFTER_STAMP:start], len(data)
        return start


class PressureEncoder:
    """Serialise FluidPressure messages of one sensor; ``variance`` in Pa2."""

    def __init__(self, frame_id: str, variance: float) -> None:
        body = bytearray(HEADER + bytes(STAMP.size))
        _append_string(body, frame_id)
        _align(body)
        self._value = len(body)
        body += struct.pack("<2d", 0.0, variance)
        self._template = body

    def encode(self, stamp_ns: int, pressure: float) -> bytes:
        """One message; ``pressure`` absolute, Pa."""
        STAMP.pack_into(self._template, len(HEADER), *divmod(stamp_ns, NANO))
        struct.pack_into("<d", self._template, self._value, pressure)
        return bytes(self._template)


def decode_pressure(data: bytes) -> tuple[int, float]:
    """(stamp in ns, absolute pressure in Pa) of a serialised FluidPressure."""
    sec, nanosec = STAMP.unpack_from(data, len(HEADER))
    (pressure,) = struct.unpack_from("<d", data, len(data) - 16)
    return sec * NANO + nanosec, pressure


def stamp_of(data: bytes) -> int:
    """Stamp in ns of any serialised message that starts with a std_msgs/Header."""
    sec, nanosec = STAMP.unpack_from(data, len(HEADER))
    return int(sec * NANO + nanosec)


def encode_clock(stamp_ns: int) -> bytes:
    """A serialised rosgraph_msgs/Clock."""
    return HEADER + STAMP.pack(*divmod(stamp_ns, NANO))


def _read_names(data: bytes) -> tuple[list[str], int]:
    """Names of a JointState and the offset just after the count of its positions."""
    _, at = _read_string(data, _AFTER_STAMP)
    at = _padded(at, 4)
    (count,) = struct.unpack_from("<I", data, at)
    at += 4
    names = []
    for _ in range(count):
        name, at = _read_string(data, _padded(at, 4))
        names.append(name)
    return names, _padded(at, 4) + 4


def _read_string(data: bytes, at: int) -> tuple[str, int]:
    (size,) = struct.unpack_from("<I", data, at)
    end = at + 4 + size
    if end > len(data):
        raise struct.error("string beyond the end")
    return data[at + 4 : end - 1].decode(), end


def _padded(at: int, size: int) -> int:
    return at + (len(HEADER) - at) % size


def _aligned(at: int) -> int:
    return _padded(at, 8)


def _align(body: bytearray, size: int = 8) -> None:
    body += bytes((len(HEADER) - len(body)) % size)


def _append_count(body: bytearray, count: int) -> None:
    _align(body, 4)
    body += struct.pack("<I", count)


def _append_string(body: bytearray, text: str) -> None:
    encoded = text.encode() + b"\x00"
    _append_count(body, len(encoded))
    body += encoded


def _append_doubles(body: bytearray, count: int) -> int:
    """Append a sequence of ``count`` zeros; returns the offset of its first value."""
    _append_count(body, count)
    if count:  # an empty sequence has no elements to align
        _align(body)
    start = len(body)
    body += bytes(8 * count)
    return start
