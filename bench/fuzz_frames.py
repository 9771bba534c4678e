# SPDX-License-Identifier: Apache-2.0
"""Mutated frames by the million: nothing crashes, none with a wrong CRC is taken, Python and C agree on every one.

``python bench/fuzz_frames.py [--count 1000000] [--seed 1]`` builds the firmware core under the address and
undefined-behaviour sanitizers, feeds both sides the same frames and prints how each was judged. Exit code 1 if any
judgement is wrong.
"""

from __future__ import annotations

import argparse
import random
import struct
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from cobs import cobs

from pneumo_ros.daq.frames import FrameError, decode

FIRMWARE = Path(__file__).resolve().parent.parent / "firmware"
C_REASONS = ("ok", "idle", "overlong", "cobs", "short", "crc", "version", "kind", "length", "value")
BATCH = 20_000


def seeds() -> list[bytes]:
    """Every frame of the shared vectors, good and bad, without its delimiter."""
    text = (FIRMWARE / "vectors" / "frames.txt").read_text(encoding="ascii")
    return [bytes.fromhex(line.split()[1])[:-1] for line in text.splitlines() if not line.startswith("#")]


def _entry(byte: int) -> int:
    crc = byte << 8
    for _ in range(8):
        crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


TABLE = tuple(map(_entry, range(256)))


def crc16(payload: bytes) -> int:
    """CRC-16/IBM-3740 by a table made from its polynomial: not the function that is under test."""
    crc = 0xFFFF
    for byte in payload:
        crc = crc << 8 & 0xFFFF ^ TABLE[crc >> 8 ^ byte]
    return crc


def mutated(rng: random.Random, corpus: list[bytes]) -> bytes:
    """One frame after up to four edits: bits, bytes, insertions, deletions, swaps, splices, right CRC, any content."""
    data = bytearray(rng.choice(corpus))
    for _ in range(rng.randint(1, 4)):
        place = rng.randrange(len(data)) if data else 0
        match rng.randrange(7):
            case 0 if data:
                data[place] ^= 1 << rng.randrange(8)
            case 1 if data:
                data[place] = rng.randrange(256)
            case 2:
                data[place:place] = rng.randbytes(rng.randint(1, 8))
            case 3:
                del data[place : place + rng.randint(1, 8)]
            case 4 if data:
                other = rng.randrange(len(data))
                data[place], data[other] = data[other], data[place]
            case 5:
                data[place:] = rng.choice(corpus)[place:]
            case _:
                content = (
                    rng.randbytes(rng.randint(0, 40)) if rng.random() < 0.5 else bytes([2, 0x10]) + rng.randbytes(42)
                )
                data = bytearray(cobs.encode(content + struct.pack("<H", crc16(content))))
    return bytes(data[:300])


def judged(frame: bytes) -> str:
    """What the Python side says; a frame taken with a CRC that is wrong by its definition is a failure."""
    try:
        decode(frame)
    except FrameError as error:
        return error.reason.value
    data = cobs.decode(frame)
    right = crc16(data[:-2]) == int.from_bytes(data[-2:], "little")
    return "ok" if right else "TAKEN WITH A WRONG CRC"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng, corpus, verdicts, disagreements = random.Random(options.seed), seeds(), Counter[str](), 0
    with tempfile.TemporaryDirectory() as build:
        subprocess.run(["make", "-s", "-C", str(FIRMWARE), "all", f"BUILD={build}"], check=True)
        for start in range(0, options.count, BATCH):
            batch = [mutated(rng, corpus) for _ in range(min(BATCH, options.count - start))]
            stream = b"".join(struct.pack("<H", len(frame)) + frame for frame in batch)
            c_side = subprocess.run([f"{build}/verdicts"], input=stream, capture_output=True, check=True).stdout
            for frame, code in zip(batch, c_side, strict=True):
                verdict = judged(frame)
                verdicts[verdict] += 1
                # An empty frame is idle on a line; pneumo_decode alone calls it short, as Python does.
                disagreements += code >= len(C_REASONS) or C_REASONS[code] != verdict
    wrong = verdicts["TAKEN WITH A WRONG CRC"]
    print(f"{options.count} mutated frames: {dict(verdicts.most_common())}")
    print(f"taken with a wrong CRC: {wrong}; judged differently by C and Python: {disagreements}; crashes: 0")
    return 1 if wrong or disagreements else 0


if __name__ == "__main__":
    sys.exit(main())
