# SPDX-License-Identifier: Apache-2.0
"""Writes frames.txt and behaviour.txt, the vectors that the C and the Python side both have to pass.

Uses the standard library only, with its own COBS and binascii's CRC, so that neither side is checked against itself.
Run it after a change of the protocol: ``python firmware/vectors/generate.py``.

frames.txt     good HEX KIND FIELD=VALUE...     decodes to these fields, and these fields encode to HEX
               bad HEX REASON                   is dropped for this reason
behaviour.txt  case NAME                        a board that has just booted at device time 0
               rx US HEX                        bytes arrive at device time US
               tick US [fail]                   a sample period; the converter gives 11,12,...,17 or fails
               estop 0|1                        the hardware input, seen at the next tick
               expect STATE FAULT O0 O1 O2 O3 GOOD BAD REFUSED
               sent HEX                         what the board has sent since the last `sent` or the case's start
"""

from __future__ import annotations

import binascii
import struct
from pathlib import Path

HERE = Path(__file__).resolve().parent
HELLO_REQUEST, HELLO, SAMPLE, COMMAND, STATUS = 0x01, 0x02, 0x10, 0x20, 0x30
NAMES = {HELLO_REQUEST: "hello_request", HELLO: "hello", SAMPLE: "sample", COMMAND: "command", STATUS: "status"}
ARM, ESTOP, RESET = 1, 2, 4
WATCHDOG_US = 40_000
COUNTS = tuple(range(11, 18))
SAFE, ARMED, STOPPED = 0, 1, 2
NONE, WATCHDOG, ESTOP_COMMAND, ESTOP_INPUT, CONVERTER, HANDSHAKE, HOST_DISARMED = range(7)


def stuff(data: bytes) -> bytes:
    """COBS for payloads below 254 bytes: each zero is replaced by the distance to the next."""
    return b"".join(bytes([len(block) + 1]) + block for block in data.split(b"\x00"))


def wire(payload: bytes, crc: int | None = None) -> bytes:
    value = binascii.crc_hqx(payload, 0xFFFF) if crc is None else crc
    return stuff(payload + struct.pack("<H", value)) + b"\x00"


def frame(kind: int, body: bytes, version: int = 2) -> bytes:
    return wire(bytes([version, kind]) + body)


def hello_request(nonce: int) -> bytes:
    return frame(HELLO_REQUEST, struct.pack("<I", nonce))


IDENTITY = {
    "boot_id": 7, "sample_period_us": 1000, "watchdog_us": WATCHDOG_US, "firmware": (1, 2, 3), "adc_bits": 16,
    "dac_bits": 12, "serial_number": "PNEUMO-0001",
    "inputs": tuple((channel, -10_000_000, 10_000_000) for channel in (3, 2, 1, 0, 4, 5, 6)),
    "outputs": tuple((valve, 0, 10_000_000, 10 * valve) for valve in range(4)),
}  # fmt: skip


NEXT = (7 * 2_654_435_761 + 1) % 2**32  # after its first handshake
SESSION = 7 * 2_654_435_761 % 2**32  # of a board of boot id 7 before its first handshake


def hello(nonce: int, device_us: int, session: int = SESSION, **changes: object) -> bytes:
    h = {**IDENTITY, **changes}
    body = struct.pack(
        "<6I5B16s", nonce, h["boot_id"], session, device_us, h["sample_period_us"], h["watchdog_us"], *h["firmware"],
        h["adc_bits"], h["dac_bits"], h["serial_number"].encode("latin-1"),
    )  # fmt: skip
    body += b"".join(struct.pack("<Bii", *entry) for entry in h["inputs"])
    return frame(HELLO, body + b"".join(struct.pack("<BiiH", *entry) for entry in h["outputs"]))


def sample(
    sequence: int, device_us: int, state: int, flags: int, counts: tuple[int, ...], session: int = SESSION
) -> bytes:
    return frame(SAMPLE, struct.pack("<IIIBB7i", session, sequence, device_us, state, flags, *counts))


def command(
    sequence: int, flags: int, counts: tuple[int, ...] = (0, 0, 0, 0), session: int = SESSION, seen: int = 0
) -> bytes:
    return frame(COMMAND, struct.pack("<IIIB4H", session, sequence, seen, flags, *counts))


def status(*fields: int, session: int = SESSION) -> bytes:
    return frame(STATUS, struct.pack("<IIBBBIIIII4HB", session, *fields, 0))


def listed(value: object) -> str:
    return ",".join(map(str, value)) if isinstance(value, tuple) else str(value)


def good(data: bytes, kind: int, **fields: object) -> str:
    return f"good {data.hex()} {NAMES[kind]} " + " ".join(f"{name}={listed(value)}" for name, value in fields.items())


def good_frames() -> list[str]:
    lines = [good(hello_request(n), HELLO_REQUEST, nonce=n) for n in (1, 0x01020304, 0xFFFFFFFF)]
    for nonce, time, changes in (
        (0, 0, {}),
        (9, 0xFFFFFFFF, {"serial_number": "0123456789ABCDEF", "adc_bits": 24, "dac_bits": 16}),
        (1, 5, {"serial_number": "", "inputs": tuple((c, -(2**31), 2**31 - 1) for c in range(7))}),
    ):
        h = {
            "nonce": nonce,
            "boot_id": 7,
            "session": SESSION,
            "device_us": time,
            **{k: v for k, v in IDENTITY.items() if k != "boot_id"},
        }
        h.update(changes)
        flat = {**h, "inputs": sum(h["inputs"], ()), "outputs": sum(h["outputs"], ())}
        lines.append(good(hello(nonce, time, **changes), HELLO, **flat))
    for fields in (
        (0, 0, 0, 0, (0,) * 7),
        (0xFFFFFFFF, 0xFFFFFFFF, 2, 3, (-1, -32768, 32767, -(2**31), 2**31 - 1, 1, 256)),
        (0x00010000, 65536, 1, 1, (0, 255, 0, 256, 0, 65536, 0)),
    ):
        names = dict(zip(("sequence", "device_us", "state", "flags", "counts"), fields, strict=True))
        lines.append(good(sample(*fields, session=fields[0] ^ 5), SAMPLE, session=fields[0] ^ 5, **names))
    for fields in ((1, 0, (0, 0, 0, 0)), (0x80000000, ARM, (1, 256, 4095, 65535)), (0, 7, (0, 0, 0, 1))):
        own = {"session": 2**32 - 1 - fields[0], "sequence": fields[0], "sample": fields[0] // 3}
        data = command(*fields, session=own["session"], seen=own["sample"])
        lines.append(good(data, COMMAND, **own, flags=fields[1], counts=fields[2]))
    for fields in ((0,) * 13, (1, 2, 6, 3, 5, 6, 7, 8, 9, 10, 11, 12, 0xFFFF)):
        names = ("device_us", "state", "fault", "flags", "command_sequence", "command_us", "good_frames",
                 "bad_frames", "refused_commands")  # fmt: skip
        named = dict(zip(names, fields[:9], strict=True))
        lines.append(good(status(*fields), STATUS, session=SESSION, **named, counts=fields[9:]))
    return lines


def bad_frames() -> list[str]:
    payload = bytes([2, COMMAND]) + struct.pack("<IIIB4H", SESSION, 5, 0, ARM, 1, 2, 3, 4)
    right = binascii.crc_hqx(payload, 0xFFFF)
    cut = command(5, ARM, (1, 2, 3, 4))
    cases = [
        (b"\x11" * 255 + b"\x00", "overlong"),
        (b"\x05\x01\x02\x00", "cobs"),
        (b"\xff\x01\x00", "cobs"),
        (b"\x01\x00", "short"),
        (wire(b"\x01"), "short"),
        (wire(b""), "short"),
        (wire(payload, right ^ 1), "crc"),
        (wire(payload, right ^ 0x8000), "crc"),
        (wire(payload, (right >> 8) | (right & 0xFF) << 8), "crc"),
        (cut[:-3] + b"\x00", "cobs"),
        (frame(COMMAND, payload[2:], version=1), "version"),
        (frame(COMMAND, payload[2:], version=0), "version"),
        (frame(0x21, payload[2:]), "kind"),
        (frame(0x00, b""), "kind"),
        (frame(COMMAND, payload[2:-1]), "length"),
        (frame(COMMAND, payload[2:] + b"\x00"), "length"),
        (frame(SAMPLE, b""), "length"),
        (frame(HELLO_REQUEST, bytes(4)), "value"),
        (command(1, 8), "value"),
        (sample(1, 1, 3, 0, (0,) * 7), "value"),
        (sample(1, 1, 0, 4, (0,) * 7), "value"),
        (status(1, 3, 0, 0, *(0,) * 9), "value"),
        (status(1, 0, 7, 0, *(0,) * 9), "value"),
        (frame(STATUS, bytes(39) + b"\x01"), "value"),
        (hello(1, 1, adc_bits=7), "value"),
        (hello(1, 1, adc_bits=33), "value"),
        (hello(1, 1, dac_bits=17), "value"),
        (hello(1, 1, serial_number="A\x00B"), "value"),
        (hello(1, 1, serial_number="A\xe9"), "value"),
    ]
    return [f"bad {data.hex()} {reason}" for data, reason in cases]


def expect(state: int, fault: int, outputs: tuple[int, ...], good: int, bad: int = 0, refused: int = 0) -> str:
    return f"expect {state} {fault} {' '.join(map(str, outputs))} {good} {bad} {refused}"


SAFE_OUT = (0, 10, 20, 30)
OPEN = (100, 200, 300, 400)


def rx(time: int, *frames: bytes) -> str:
    return f"rx {time} {b''.join(frames).hex()}"


def arm(start: int = 1, time: int = 100) -> list[str]:
    return [rx(time, command(start, 0)), rx(time + 1, command(start + 1, ARM, OPEN)), ]  # fmt: skip


def boot_cases() -> list[str]:
    return [
        "case boot announces and holds the safe outputs",
        f"sent {hello(0, 0).hex()}",
        expect(SAFE, NONE, SAFE_OUT, 0),
        rx(50, hello_request(0xABCD)),
        f"sent {hello(0xABCD, 50, NEXT).hex()}",
        "tick 1000",
        f"sent {sample(0, 1000, 0, 0, COUNTS, NEXT).hex()}",
        "tick 2000 fail",
        f"sent {sample(1, 2000, 0, 2, (0,) * 7, NEXT).hex()}",
        "tick 100000",
        "sent "
        + sample(2, 100000, 0, 0, COUNTS, NEXT).hex()
        + status(100000, 0, 0, 0, 0, 0, 1, 0, 0, *SAFE_OUT, session=NEXT).hex(),
    ]


def arming_cases() -> list[str]:
    return [
        "case arming needs a command without ARM first",
        rx(10, command(1, ARM, OPEN)),
        expect(SAFE, NONE, SAFE_OUT, 1),
        rx(20, command(2, 0, OPEN)),
        expect(SAFE, NONE, SAFE_OUT, 2),
        "sent " + hello(0, 0).hex(),
        rx(30, command(3, ARM, OPEN)),
        expect(ARMED, NONE, OPEN, 3),
        "sent " + status(30, 1, 0, 0, 3, 30, 3, 0, 0, *OPEN).hex(),
        rx(40, command(4, ARM, (1, 2, 3, 4))),
        expect(ARMED, NONE, (1, 2, 3, 4), 4),
        rx(50, command(5, 0, OPEN)),
        expect(SAFE, HOST_DISARMED, SAFE_OUT, 5),
        rx(60, command(6, ARM, OPEN)),
        expect(SAFE, HOST_DISARMED, SAFE_OUT, 6),
        "case a handshake disarms and forgets the sequence",
        *arm(start=1000),
        expect(ARMED, NONE, OPEN, 2),
        rx(200, hello_request(3)),
        expect(SAFE, HANDSHAKE, SAFE_OUT, 3),
        rx(300, command(1, 0, session=NEXT), command(2, ARM, OPEN, NEXT)),
        expect(ARMED, HANDSHAKE, OPEN, 5),
        "case frames of the session before, or of none, do nothing",
        *arm(),
        rx(200, hello_request(3)),
        rx(300, command(3, 0), command(4, ARM, OPEN), command(5, 0, session=0), command(6, ARM, OPEN, 0)),
        expect(SAFE, HANDSHAKE, SAFE_OUT, 7, 0, 4),
        rx(301, hello_request(3)),
        rx(302, command(1, 0, session=NEXT), command(2, ARM, OPEN, NEXT), command(7, RESET, session=NEXT)),
        expect(SAFE, HANDSHAKE, SAFE_OUT, 11, 0, 7),
        rx(303, command(3, ESTOP, session=NEXT)),
        expect(SAFE, HANDSHAKE, SAFE_OUT, 12, 0, 8),
        "case what opens valves answers a sample of just now; what closes them may be late",
        *(f"tick {1000 * k}" for k in range(1, 51)),
        rx(50100, command(1, 0)),
        rx(50200, command(2, ARM, OPEN, seen=9)),
        expect(SAFE, NONE, SAFE_OUT, 2, 0, 1),
        rx(50300, command(3, ARM, OPEN, seen=51)),
        expect(SAFE, NONE, SAFE_OUT, 3, 0, 2),
        rx(50400, command(4, ARM, OPEN, seen=10)),
        expect(ARMED, NONE, OPEN, 4, 0, 2),
        rx(50500, command(5, ARM, (1, 1, 1, 1), seen=0)),
        expect(ARMED, NONE, OPEN, 5, 0, 3),
        rx(50600, command(6, ESTOP, seen=0)),
        expect(STOPPED, ESTOP_COMMAND, SAFE_OUT, 6, 0, 3),
        rx(50700, command(7, RESET, seen=9)),
        expect(STOPPED, ESTOP_COMMAND, SAFE_OUT, 7, 0, 4),
        rx(50800, command(8, RESET, seen=50)),
        expect(SAFE, ESTOP_COMMAND, SAFE_OUT, 8, 0, 4),
    ]


def watchdog_cases() -> list[str]:
    return [
        "case watchdog trips just after its time and stays tripped",
        *arm(time=1000),
        f"tick {1001 + WATCHDOG_US}",
        expect(ARMED, NONE, OPEN, 2),
        f"tick {1002 + WATCHDOG_US}",
        expect(SAFE, WATCHDOG, SAFE_OUT, 2),
        rx(50000, command(3, ARM, OPEN), command(4, ARM, OPEN)),
        expect(SAFE, WATCHDOG, SAFE_OUT, 4),
        rx(51000, command(5, 0), command(6, ARM, OPEN)),
        expect(ARMED, WATCHDOG, OPEN, 6),
        "case the watchdog survives the wrap of the clock",
        *arm(time=0xFFFFFF00),
        f"tick {(0xFFFFFF01 + WATCHDOG_US) % 2**32}",
        expect(ARMED, NONE, OPEN, 2),
        f"tick {(0xFFFFFF02 + WATCHDOG_US) % 2**32}",
        expect(SAFE, WATCHDOG, SAFE_OUT, 2),
        "case damaged and stale frames do not feed the watchdog",
        *arm(start=10, time=1000),
        rx(30000, command(11, ARM, OPEN)),
        rx(30001, command(9, ARM, OPEN)),
        rx(30002, command(11 + 2**31, ARM, OPEN)),
        rx(30003, command(12, ARM, (0, 0, 0, 4096))),
        rx(30004, bytes([command(12, ARM, OPEN)[0] ^ 1]) + command(12, ARM, OPEN)[1:]),
        expect(ARMED, NONE, OPEN, 6, 1, 4),
        f"tick {1002 + WATCHDOG_US}",
        expect(SAFE, WATCHDOG, SAFE_OUT, 6, 1, 4),
        "case sequences wrap",
        rx(1, command(0xFFFFFFFE, 0), command(0xFFFFFFFF, ARM, OPEN), command(0, ARM, (9, 9, 9, 9))),
        expect(ARMED, NONE, (9, 9, 9, 9), 3),
    ]


def estop_cases() -> list[str]:
    return [
        "case e-stop by command is latched; only RESET without ARM ends it",
        *arm(),
        rx(200, command(3, ARM | ESTOP, OPEN)),
        expect(STOPPED, ESTOP_COMMAND, SAFE_OUT, 3),
        rx(300, command(4, 0), command(5, ARM, OPEN), command(6, RESET | ARM), command(7, RESET | ESTOP)),
        expect(STOPPED, ESTOP_COMMAND, SAFE_OUT, 7),
        rx(350, hello_request(5)),
        expect(STOPPED, ESTOP_COMMAND, SAFE_OUT, 8),
        rx(400, command(8, RESET, session=NEXT)),
        expect(SAFE, ESTOP_COMMAND, SAFE_OUT, 9),
        rx(500, command(9, ARM, OPEN, NEXT)),
        expect(SAFE, ESTOP_COMMAND, SAFE_OUT, 10),
        rx(600, command(10, 0, session=NEXT), command(11, ARM, OPEN, NEXT)),
        expect(ARMED, ESTOP_COMMAND, OPEN, 12),
        "case e-stop by the input needs its release before RESET works",
        *arm(),
        "estop 1",
        "tick 1000",
        expect(STOPPED, ESTOP_INPUT, SAFE_OUT, 2),
        rx(1100, command(3, RESET)),
        expect(STOPPED, ESTOP_INPUT, SAFE_OUT, 3),
        "estop 0",
        "tick 2000",
        expect(STOPPED, ESTOP_INPUT, SAFE_OUT, 3),
        rx(2100, command(4, RESET)),
        expect(SAFE, ESTOP_INPUT, SAFE_OUT, 4),
    ]


def line_cases() -> list[str]:
    first, second = command(1, 0), command(2, ARM, OPEN)
    return [
        "case noise costs the frame it runs into and no more",
        rx(1, b"\x55\xaa\x13" + command(100, 0), first, second),
        expect(ARMED, NONE, OPEN, 2, 1),
        "case a frame may come byte by byte, with idle bytes between frames",
        *(rx(index, bytes([byte])) for index, byte in enumerate(first)),
        rx(100, b"\x00\x00\x00", second[:7]),
        rx(101, second[7:]),
        expect(ARMED, NONE, OPEN, 2),
        "case an endless line without delimiter ends in one dropped frame",
        *(rx(index, b"\x7e" * 200) for index in range(5)),
        rx(10, b"\x00", first, second),
        expect(ARMED, NONE, OPEN, 2, 1),
        "case five failed conversions in a row disarm",
        *arm(time=1000),
        *(f"tick {2000 + 1000 * i} fail" for i in range(4)),
        expect(ARMED, NONE, OPEN, 2),
        "tick 6000",
        *(f"tick {7000 + 1000 * i} fail" for i in range(4)),
        expect(ARMED, NONE, OPEN, 2),
        "tick 11000 fail",
        expect(SAFE, CONVERTER, SAFE_OUT, 2),
        rx(11500, command(3, 0), command(4, ARM, OPEN)),
        expect(SAFE, CONVERTER, SAFE_OUT, 4),
    ]


def main() -> None:
    frames = ["# made by generate.py", *good_frames(), *bad_frames()]
    cases = [*boot_cases(), *arming_cases(), *watchdog_cases(), *estop_cases(), *line_cases()]
    identity = f"identity {hello(0, 0).hex()}"
    (HERE / "frames.txt").write_text("\n".join(frames) + "\n", encoding="ascii")
    (HERE / "behaviour.txt").write_text("\n".join(["# made by generate.py", identity, *cases]) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
