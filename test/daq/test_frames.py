# SPDX-License-Identifier: Apache-2.0
"""Frames and stream of the serial protocol: the shared vectors, damage, and getting back in step."""

from __future__ import annotations

import random
import re
import subprocess
from pathlib import Path

import pytest
from cobs import cobs
from helpers.folders import FIRMWARE
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumo_ros.daq import cobs as ours
from pneumo_ros.daq import frames
from pneumo_ros.daq.emulator.board import board_identity
from pneumo_ros.daq.emulator.device import Device
from pneumo_ros.daq.frames import Command, CommandFlag, FrameError, Kind, Record, Reject, Sample, decode, encode
from pneumo_ros.daq.stream import StreamDecoder

CONVERTED = tuple(range(11, 18))  # what the vectors' board converts


def lines(name: str) -> list[str]:
    text = (FIRMWARE / "vectors" / name).read_text(encoding="ascii")
    return [line for line in text.splitlines() if not line.startswith("#")]


def flat(value: object) -> list[int | str]:
    if isinstance(value, tuple):
        return [number for entry in value for number in flat(entry)]
    return [value] if isinstance(value, str) else [int(value)]  # type: ignore[call-overload]


def wanted(fields: list[str]) -> list[int | str]:
    out: list[int | str] = []
    for name, _, value in (field.partition("=") for field in fields):
        out += [value] if name == "serial_number" else [int(number) for number in value.split(",")]
    return out


@pytest.mark.parametrize("line", [line for line in lines("frames.txt") if line.startswith("good")])
def test_good_vectors_decode_and_encode(line: str) -> None:
    _, hexed, kind, *fields = line.split()
    wire = bytes.fromhex(hexed)
    record = decode(wire[:-1])
    assert type(record).__name__.lower() == kind.replace("_", "")
    assert flat(tuple(record)) == wanted(fields)
    assert encode(record) == wire


@pytest.mark.parametrize("line", [line for line in lines("frames.txt") if line.startswith("bad")])
def test_bad_vectors_are_dropped_for_their_reason(line: str) -> None:
    _, hexed, reason = line.split()
    decoder = StreamDecoder()
    assert decoder.feed(bytes.fromhex(hexed)) == []
    assert dict(decoder.rejected) == {Reject(reason): 1}


class Board:
    """The Python device under the steps of behaviour.txt."""

    def __init__(self, identity: frames.Hello) -> None:
        self.sent = b""
        self.estop = False
        self.outputs: tuple[int, ...] = ()
        self.device = Device(identity, self._send, self._write)
        self.device.boot(0)

    def _send(self, data: bytes) -> None:
        self.sent += data

    def _write(self, counts: tuple[int, ...]) -> None:
        self.outputs = counts

    def step(self, verb: str, *args: str) -> None:
        if verb == "rx":
            self.device.receive(bytes.fromhex(args[1]), int(args[0]))
        elif verb == "tick":
            self.device.tick(int(args[0]), None if "fail" in args else CONVERTED, self.estop)
        elif verb == "estop":
            self.estop = args[0] == "1"
        elif verb == "sent":
            assert self.sent.hex() == args[0]
            self.sent = b""
        else:
            assert verb == "expect"
            d = self.device
            found = [d.state, d.fault, *self.outputs, d.decoder.good, d.decoder.bad, d.refused_commands]
            assert found == [int(arg) for arg in args]


def test_behaviour_vectors() -> None:
    identity = decode(bytes.fromhex(lines("behaviour.txt")[0].split()[1])[:-1])
    assert isinstance(identity, frames.Hello)
    board, cases, checks = Board(identity), 0, 0
    for line in lines("behaviour.txt")[1:]:
        if line.startswith("case"):
            board, cases = Board(identity), cases + 1
        else:
            board.step(*line.split())
            checks += line.startswith(("expect", "sent"))
    assert cases >= 12 and checks >= 40


def test_firmware_core_passes_the_same_vectors_under_the_sanitizers(tmp_path: Path) -> None:
    run = subprocess.run(
        ["make", "-C", str(FIRMWARE), "test", f"BUILD={tmp_path}"], capture_output=True, text=True, timeout=120
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert "0 failures" in run.stdout


def test_crc_is_the_named_one() -> None:
    assert frames.checksum(b"123456789") == 0x29B1


counts = st.lists(st.integers(-(2**31), 2**31 - 1), min_size=7, max_size=7).map(tuple)
u32 = st.integers(0, 2**32 - 1)
samples = st.builds(
    Sample,
    u32,
    u32,
    u32,
    st.sampled_from(frames.DeviceState),
    st.sampled_from(list(map(frames.SampleFlag, range(4)))),
    counts,
)


@settings(max_examples=300, deadline=None)
@given(samples)
def test_round_trip_of_any_sample(sample: Sample) -> None:
    wire = encode(sample)
    assert wire.count(0) == 1 and wire[-1] == 0
    assert decode(wire[:-1]) == sample


@settings(max_examples=500, deadline=None)
@given(st.lists(st.one_of(st.just(0), st.integers(0, 255)), max_size=ours.LONGEST).map(bytes))
def test_stuffing_is_that_of_the_cobs_library(data: bytes) -> None:
    assert ours.stuffed(data) == cobs.encode(data)
    assert ours.unstuffed(ours.stuffed(data)) == data


@settings(max_examples=500, deadline=None)
@given(st.binary(max_size=frames.MAX_FRAME))
def test_what_the_cobs_library_refuses_is_refused(frame: bytes) -> None:
    try:
        wanted: bytes | None = cobs.decode(frame)
    except cobs.DecodeError:
        wanted = None
    try:
        found: bytes | None = ours.unstuffed(frame)
    except ValueError:
        found = None
    assert found == wanted


def test_data_of_a_full_run_is_refused() -> None:
    with pytest.raises(ValueError, match="254 bytes to stuff, 253 are allowed"):
        ours.stuffed(b"\x01" * 254)
    with pytest.raises(ValueError, match="too long"):
        ours.unstuffed(cobs.encode(b"\x01" * 254))


def crc16(payload: bytes) -> int:
    """CRC-16/IBM-3740 by its definition, a bit at a time: polynomial 0x1021, all ones at the start."""
    crc = 0xFFFF
    for byte in payload:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


def test_the_checksum_has_the_catalogue_s_check_value() -> None:
    assert frames.checksum(b"123456789") == crc16(b"123456789") == 0x29B1


def accepts_rightly(frame: bytes) -> bool:
    """Whether ``decode`` takes the frame; fails if it takes one whose CRC is wrong by an independent computation."""
    try:
        decode(frame)
    except FrameError:
        return False
    data = cobs.decode(frame)
    assert crc16(data[:-2]) == int.from_bytes(data[-2:], "little")
    return True


@settings(max_examples=3000, deadline=None)
@given(samples, st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), max_size=6), st.integers(0, 50))
def test_mutated_frames_never_crash_nor_pass_with_a_wrong_crc(
    sample: Sample, edits: list[tuple[int, int]], cut: int
) -> None:
    damaged = bytearray(encode(sample)[:-1])
    for place, value in edits:
        damaged[place % len(damaged)] = value
    accepts_rightly(bytes(damaged[: len(damaged) - cut] if cut else damaged))


@settings(max_examples=500, deadline=None)
@given(st.binary(max_size=600), st.integers(1, 97))
def test_resync_after_noise_loses_at_most_one_good_frame(noise: bytes, portion: int) -> None:
    good = [Sample(1, i, i * 1000, frames.DeviceState.SAFE, frames.SampleFlag(0), (i,) * 7) for i in range(5)]
    stream = noise + b"".join(map(encode, good))
    decoder = StreamDecoder()
    found: list[Record] = []
    for start in range(0, len(stream), portion):
        found += decoder.feed(stream[start : start + portion])
    assert found[-4:] == good[-4:]


def test_any_single_to_triple_bit_error_is_caught() -> None:
    """CRC-16/IBM-3740 has Hamming distance 4 at these lengths; COBS turns a hit on a code byte into a longer error."""
    rng = random.Random(5)
    wire = encode(Command(5, 77, 3, CommandFlag.ARM, (1, 0, 4095, 256)))[:-1]
    payload = cobs.decode(wire)
    for _ in range(5000):
        damaged = bytearray(payload)
        for bit in rng.sample(range(8 * len(payload)), rng.randint(1, 3)):
            damaged[bit // 8] ^= 1 << bit % 8
        with pytest.raises(FrameError):
            decode(cobs.encode(bytes(damaged)))


def test_memory_stays_bounded_without_delimiters() -> None:
    decoder = StreamDecoder()
    for _ in range(1000):
        decoder.feed(b"\x7e" * 1000)
    assert len(decoder._pending) <= frames.MAX_FRAME
    assert len(decoder.feed(b"\x00" + encode(Command(5, 1, 0, CommandFlag(0), (0, 0, 0, 0))))) == 1
    assert decoder.rejected[Reject.OVERLONG] == 1


def test_protocol_page_states_the_sizes_of_the_code() -> None:
    page = (FIRMWARE.parent / "docs" / "serial-protocol.md").read_text(encoding="utf-8")
    for kind, size in frames.BODY_SIZE.items():
        assert f"### 0x{kind:02x} {kind.name} " in page
        assert f"{kind.name} " in page and f", {size} bytes" in page.split(f" {kind.name} (")[1].splitlines()[0]
    assert set(frames.BODY_SIZE) == set(Kind)


def test_protocol_page_states_the_numbers_of_the_code() -> None:
    page = (FIRMWARE.parent / "docs" / "serial-protocol.md").read_text(encoding="utf-8")
    for title, numbers in (("Channels", frames.Channel), ("Valves", frames.Valve)):
        line = next(line for line in page.splitlines() if line.startswith(f"{title}: "))
        told = re.findall(r"(\d+) (\w+)", line)
        assert [(int(number), name) for number, name in told] == [(n.value, n.name.lower()) for n in numbers]
    for flag in CommandFlag.__members__.values():  # those of two bits as well, which iteration leaves out
        assert f"bit {flag.value.bit_length() - 1} {flag.name}" in page and flag.value.bit_count() == 1
    for state in frames.DeviceState:
        assert f"{state.value} {state.name}" in page
    assert [fault.value for fault in frames.DeviceFault] == list(range(7))


def hello_with(adc_bits: int = 16, dac_bits: int = 12, serial_number: str = "A") -> frames.Hello:
    """What a board of these converters and this serial number is decoded as."""
    board = board_identity()._replace(adc_bits=adc_bits, dac_bits=dac_bits, serial_number=serial_number)
    hello = decode(encode(board)[:-1])
    assert isinstance(hello, frames.Hello)
    return hello


@pytest.mark.parametrize(
    ("field", "good", "bad"), [("adc_bits", (8, 9, 31, 32), (7, 33)), ("dac_bits", (8, 9, 15, 16), (7, 17, 0))]
)
def test_converters_have_a_width_that_counts_fit_in(field: str, good: tuple[int, ...], bad: tuple[int, ...]) -> None:
    for bits in good:
        assert getattr(hello_with(**{field: bits}), field) == bits
    for bits in bad:
        with pytest.raises(FrameError) as error:
            hello_with(**{field: bits})
        assert error.value.reason is Reject.VALUE


def test_a_serial_number_is_printable() -> None:
    assert hello_with(serial_number=" ~!}").serial_number == " ~!}"
    for byte in ("\x1f", "\x7f", "a\nb"):
        with pytest.raises(FrameError) as error:
            hello_with(serial_number=byte)
        assert error.value.reason is Reject.VALUE


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (bytes(frames.MAX_FRAME - 1), Reject.CRC),  # 254 bytes with their stuffing: the longest that is read
        (bytes(frames.MAX_FRAME), Reject.OVERLONG),
        (b"\x02\x01\x00", Reject.SHORT),
        (b"\x02\x01\x00\x00", Reject.CRC),
    ],
)
def test_lengths_at_the_edge(data: bytes, reason: Reject) -> None:
    with pytest.raises(FrameError) as error:
        decode(cobs.encode(data))
    assert error.value.reason is reason


@pytest.mark.parametrize(
    ("version", "kind", "reason"), [(1, 1, Reject.VERSION), (3, 1, Reject.VERSION), (2, 3, Reject.KIND)]
)
def test_other_versions_and_kinds_are_refused(version: int, kind: int, reason: Reject) -> None:
    payload = bytes([version, kind]) + bytes(4)
    with pytest.raises(FrameError) as error:
        decode(cobs.encode(payload + frames.checksum(payload).to_bytes(2, "little")))
    assert error.value.reason is reason
