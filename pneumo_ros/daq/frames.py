# SPDX-License-Identifier: Apache-2.0
"""Records of the serial protocol, mirroring docs/serial-protocol.md one to one, and their frames.

A frame on the wire is COBS(version, kind, body, CRC-16) followed by 0x00; everything is little-endian.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from collections.abc import Callable
from enum import Enum, IntEnum, IntFlag
from typing import NamedTuple

from pneumo_ros.daq.cobs import stuffed, unstuffed

PROTOCOL_VERSION = 2
MAX_FRAME = 254  # bytes before the delimiter
DELIMITER = b"\x00"
INPUT_COUNT = 7
OUTPUT_COUNT = 4


class Kind(IntEnum):
    """What a frame holds."""

    HELLO_REQUEST = 0x01
    HELLO = 0x02
    SAMPLE = 0x10
    COMMAND = 0x20
    STATUS = 0x30


class Channel(IntEnum):
    """Analogue inputs by the number that HELLO gives them."""

    SPRUNG_FRONT = 0
    SPRUNG_REAR = 1
    UNSPRUNG_FRONT = 2
    UNSPRUNG_REAR = 3
    FRONT_PRESSURE = 4
    REAR_PRESSURE = 5
    SUPPLY_PRESSURE = 6


class Valve(IntEnum):
    """Analogue outputs by the number that HELLO gives them."""

    FRONT_INLET = 0
    REAR_INLET = 1
    FRONT_OUTLET = 2
    REAR_OUTLET = 3


class DeviceState(IntEnum):
    """State of the device."""

    SAFE = 0
    ARMED = 1
    ESTOP = 2


class DeviceFault(IntEnum):
    """Why the device last left ARMED."""

    NONE = 0
    WATCHDOG = 1
    ESTOP_COMMAND = 2
    ESTOP_INPUT = 3
    CONVERTER = 4
    HANDSHAKE = 5
    HOST_DISARMED = 6


class SampleFlag(IntFlag):
    """Flags of SAMPLE and STATUS."""

    ESTOP_PRESSED = 1
    CONVERTER_FAILED = 2


class CommandFlag(IntFlag):
    """Flags of COMMAND."""

    ARM = 1
    ESTOP = 2
    RESET = 4


class Reject(Enum):
    """Why a received frame was dropped, in the order the checks are made."""

    OVERLONG = "overlong"
    COBS = "cobs"
    SHORT = "short"
    CRC = "crc"
    VERSION = "version"
    KIND = "kind"
    LENGTH = "length"
    VALUE = "value"


class FrameError(Exception):
    """A frame that must be dropped; ``reason`` says at which check it failed."""

    def __init__(self, reason: Reject) -> None:
        self.reason = reason
        super().__init__(f"frame dropped: {reason.value}")


class HelloRequest(NamedTuple):
    """Host asks the device who it is."""

    nonce: int


class InputRange(NamedTuple):
    """One analogue input: what it measures and the converter's range, microvolt."""

    channel: int
    min_uv: int
    max_uv: int


class OutputRange(NamedTuple):
    """One analogue output: what it drives, its range in microvolt, its counts in the safe state."""

    valve: int
    min_uv: int
    max_uv: int
    safe: int


class Hello(NamedTuple):
    """The device says who it is and what its counts mean."""

    nonce: int
    boot_id: int
    session: int
    device_us: int
    sample_period_us: int
    watchdog_us: int
    firmware: tuple[int, int, int]
    adc_bits: int
    dac_bits: int
    serial_number: str
    inputs: tuple[InputRange, ...]
    outputs: tuple[OutputRange, ...]


class Sample(NamedTuple):
    """One conversion of all inputs; ``counts`` in the order of HELLO's inputs."""

    session: int
    sequence: int
    device_us: int
    state: DeviceState
    flags: SampleFlag
    counts: tuple[int, ...]


class Command(NamedTuple):
    """What the valves shall do; ``counts`` in the order of HELLO's outputs.

    ``sample`` is one more than the sequence of the latest SAMPLE the host had: the board tells by it how old a command
    is, whatever held it up.
    """

    session: int
    sequence: int
    sample: int
    flags: CommandFlag
    counts: tuple[int, ...]


class Status(NamedTuple):
    """The device's state, why, and its counters."""

    session: int
    device_us: int
    state: DeviceState
    fault: DeviceFault
    flags: SampleFlag
    command_sequence: int
    command_us: int
    good_frames: int
    bad_frames: int
    refused_commands: int
    counts: tuple[int, ...]


Record = HelloRequest | Hello | Sample | Command | Status

_HEADER = struct.Struct("<BB")
_HEADER_SIZE = _HEADER.size
_CRC = struct.Struct("<H")
_HELLO_REQUEST = struct.Struct("<I")
_HELLO_FIXED = struct.Struct("<IIIIII5B16s")
_INPUT = struct.Struct("<Bii")
_OUTPUT = struct.Struct("<BiiH")
_SAMPLE = struct.Struct(f"<IIIBB{INPUT_COUNT}i")
_COMMAND = struct.Struct(f"<IIIB{OUTPUT_COUNT}H")
_STATUS = struct.Struct(f"<IIBBBIIIII{OUTPUT_COUNT}HB")
_HELLO_SIZE = _HELLO_FIXED.size + INPUT_COUNT * _INPUT.size + OUTPUT_COUNT * _OUTPUT.size

# Looking a member up costs a tenth of making the enumeration find it, and a sample comes every millisecond.
_STATES = {state.value: state for state in DeviceState}
_FLAGS = tuple(SampleFlag(value) for value in range(4))

BODY_SIZE: dict[int, int] = {
    Kind.HELLO_REQUEST: _HELLO_REQUEST.size,
    Kind.HELLO: _HELLO_SIZE,
    Kind.SAMPLE: _SAMPLE.size,
    Kind.COMMAND: _COMMAND.size,
    Kind.STATUS: _STATUS.size,
}


def checksum(payload: bytes) -> int:
    """CRC-16/IBM-3740 of version, kind and body: the standard library's polynomial, started from all ones."""
    return crc_hqx(payload, 0xFFFF)


def encode(record: Record) -> bytes:
    """The frame of a record, ready for the wire, delimiter included."""
    kind, body = _body(record)
    payload = _HEADER.pack(PROTOCOL_VERSION, kind) + body
    return stuffed(payload + _CRC.pack(checksum(payload))) + DELIMITER


def decode(frame: bytes) -> Record:
    """The record of one frame, given without its delimiter.

    Raises
    ------
    FrameError
        at the first failing check; nothing of such a frame may be used.
    """
    payload = _payload(frame)
    version, kind = payload[:_HEADER_SIZE]
    if version != PROTOCOL_VERSION:
        raise FrameError(Reject.VERSION)
    if kind not in _DECODERS:
        raise FrameError(Reject.KIND)
    body = payload[_HEADER_SIZE:]
    if len(body) != BODY_SIZE[kind]:
        raise FrameError(Reject.LENGTH)
    try:
        return _DECODERS[kind](body)
    except (ValueError, LookupError) as error:
        raise FrameError(Reject.VALUE) from error


def _payload(frame: bytes) -> bytes:
    """Version, kind and body of a frame whose COBS and CRC are right."""
    if len(frame) > MAX_FRAME:
        raise FrameError(Reject.OVERLONG)
    try:
        data = unstuffed(frame)
    except ValueError as error:
        raise FrameError(Reject.COBS) from error
    if len(data) < _HEADER_SIZE + _CRC.size:
        raise FrameError(Reject.SHORT)
    payload = data[:-2]
    if data[-2] | data[-1] << 8 != crc_hqx(payload, 0xFFFF):
        raise FrameError(Reject.CRC)
    return payload


def _body(record: Record) -> tuple[Kind, bytes]:
    if isinstance(record, Sample):
        return Kind.SAMPLE, _SAMPLE.pack(*record[:5], *record.counts)
    if isinstance(record, Command):
        return Kind.COMMAND, _COMMAND.pack(*record[:4], *record.counts)
    if isinstance(record, Status):
        return Kind.STATUS, _STATUS.pack(*record[:10], *record.counts, 0)
    if isinstance(record, HelloRequest):
        return Kind.HELLO_REQUEST, _HELLO_REQUEST.pack(record.nonce)
    return Kind.HELLO, _hello_body(record)


def _hello_body(hello: Hello) -> bytes:
    name = hello.serial_number.encode("ascii")
    fixed = _HELLO_FIXED.pack(*hello[:6], *hello.firmware, hello.adc_bits, hello.dac_bits, name)
    inputs = b"".join(_INPUT.pack(*entry) for entry in hello.inputs)
    outputs = b"".join(_OUTPUT.pack(*entry) for entry in hello.outputs)
    return fixed + inputs + outputs


def _hello_request(body: bytes) -> HelloRequest:
    (nonce,) = _HELLO_REQUEST.unpack(body)
    if nonce == 0:
        raise ValueError("nonce 0 is the boot announcement's")
    return HelloRequest(nonce)


def _hello(body: bytes) -> Hello:
    nonce, boot_id, session, device_us, period_us, watchdog_us, *small, name = _HELLO_FIXED.unpack_from(body)
    major, minor, patch, adc_bits, dac_bits = small
    split = _HELLO_FIXED.size + INPUT_COUNT * _INPUT.size
    inputs = tuple(InputRange(*entry) for entry in _INPUT.iter_unpack(body[_HELLO_FIXED.size : split]))
    outputs = tuple(OutputRange(*entry) for entry in _OUTPUT.iter_unpack(body[split:]))
    if not (8 <= adc_bits <= 32 and 8 <= dac_bits <= 16):
        raise ValueError("converter width")
    firmware = (major, minor, patch)
    return Hello(nonce, boot_id, session, device_us, period_us, watchdog_us, firmware, adc_bits, dac_bits,
                 _ascii(name), inputs, outputs)  # fmt: skip


def _ascii(name: bytes) -> str:
    text = name.rstrip(b"\x00")
    if any(not 0x20 <= byte <= 0x7E for byte in text):
        raise ValueError("serial number is not printable ASCII")
    return text.decode("ascii")


def _sample(body: bytes) -> Sample:
    session, sequence, device_us, state, flags, *counts = _SAMPLE.unpack(body)
    return Sample(session, sequence, device_us, _STATES[state], _FLAGS[flags], tuple(counts))


def _command(body: bytes) -> Command:
    session, sequence, sample, flags, *counts = _COMMAND.unpack(body)
    if flags > 7:
        raise ValueError("unknown flag")
    return Command(session, sequence, sample, CommandFlag(flags), tuple(counts))


def _status(body: bytes) -> Status:
    session, device_us, state, fault, flags, *numbers, reserved = _STATUS.unpack(body)
    sequence, command_us, good, bad, refused, *counts = numbers
    if reserved != 0:
        raise ValueError("reserved byte")
    known = _STATES[state], DeviceFault(fault), _FLAGS[flags]
    return Status(session, device_us, *known, sequence, command_us, good, bad, refused, tuple(counts))


_DECODERS: dict[int, Callable[[bytes], Record]] = {
    Kind.HELLO_REQUEST: _hello_request,
    Kind.HELLO: _hello,
    Kind.SAMPLE: _sample,
    Kind.COMMAND: _command,
    Kind.STATUS: _status,
}
