# SPDX-License-Identifier: Apache-2.0
"""Small files that ask for a lot of memory or time, each made in milliseconds; and what a command makes of them."""

from __future__ import annotations

import struct
import subprocess
import sys
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import lz4.frame
import numpy as np
import zstandard

from helpers.hostile import rest_log
from helpers.small_logs import text, write
from pneumo_ros.log.decoded import STRING
from pneumo_ros.rig import load_rig

MAGIC = b"\x89MCAP0\r\n"
GIGA = 1 << 30
BLOCK = 128 * 1024
CONFIG = load_rig().to_yaml()
STRING_DEFINITION = b"string data"


class Done(NamedTuple):
    """A command that ended: exit code, what it said, largest resident memory in MB."""

    code: int
    said: str
    peak: float


PEAK = """
import atexit, sys
atexit.register(lambda: print("\\npeak", open("/proc/self/status").read().split("VmHWM:")[1].split()[0]))
sys.argv[0] = "pneumo"
from pneumo_ros.cli.main import main
main()
"""


def run(*words: object, patience: float = 120.0) -> Done:
    """The command line in a process of its own, with its peak memory."""
    command = [sys.executable, "-c", PEAK, *map(str, words)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
                          timeout=patience, check=False)  # fmt: skip
    said, _, peak = done.stdout.decode(errors="replace").rpartition("\npeak ")
    return Done(done.returncode, said, float(peak) / 1024)


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def prefixed(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


def schema(name: bytes = b"std_msgs/msg/String", definition: bytes = STRING_DEFINITION) -> bytes:
    return record(3, struct.pack("<H", 1) + prefixed(name) + prefixed(b"ros2msg") + prefixed(definition))


def channel(number: int, topic: bytes = b"/t") -> bytes:
    return record(4, struct.pack("<HH", number, 1) + prefixed(topic) + prefixed(b"cdr") + struct.pack("<I", 0))


def message(data: bytes) -> bytes:
    return record(5, struct.pack("<HIQQ", 1, 0, 1, 1) + data)


def chunk(compression: bytes, packed: bytes, size: int, crc: int = 0) -> bytes:
    head = struct.pack("<QQQI", 0, 1, size, crc) + prefixed(compression)
    return record(6, head + struct.pack("<Q", len(packed)) + packed)


def file(path: Path, *records: bytes) -> Path:
    end = record(15, struct.pack("<I", 0)) + record(2, bytes(20))
    path.write_bytes(MAGIC + record(1, prefixed(b"ros2") + prefixed(b"test")) + b"".join(records) + end + MAGIC)
    return path


def zstd_run(size: int, stated: int | None, begin: bytes = b"", byte: bytes = b"\0") -> bytes:
    """A zstd frame of one byte repeated, as run-length blocks of 4 bytes for 128 KiB each."""
    head = b"\x28\xb5\x2f\xfd" + (b"\xc0\x38" + struct.pack("<Q", stated) if stated is not None else b"\x00\x38")
    blocks = [struct.pack("<I", len(begin) << 3)[:3] + begin] if begin else []
    count, rest = divmod(size, BLOCK)
    blocks += [struct.pack("<I", BLOCK << 3 | 2)[:3] + byte] * count
    return head + b"".join(blocks) + struct.pack("<I", rest << 3 | 3)[:3] + byte


def lz4_run(size: int) -> bytes:
    """An LZ4 frame of zeros: one block of 4 MiB, repeated."""
    whole = lz4.frame.compress(bytes(4 << 20), block_size=lz4.frame.BLOCKSIZE_MAX4MB, block_linked=False,
                               store_size=False)  # fmt: skip
    return whole[:7] + whole[7:-4] * (size // (4 << 20)) + whole[-4:]


def definition(*types: str) -> bytes:
    """A schema of nested types: the first is the message's own."""
    return (
        ("\n" + "=" * 80 + "\n")
        .join([types[0], *(f"MSG: test/T{k + 1}\n{t}" for k, t in enumerate(types[1:]))])
        .encode()
    )


def typed(path: Path, text: bytes, data: bytes = bytes(64)) -> Path:
    return file(path, schema(b"test/msg/T0", text), channel(1), message(b"\0\1\0\0" + data))


def log_with(path: Path, topic: str, value: str) -> Path:
    return write(path, [("/rig/config", STRING, 0, text(CONFIG)), (topic, STRING, 1, text(value))])


def aliases() -> str:
    """2^60 values in 60 lines."""
    return "a0: &a0 [1, 1]\n" + "".join(f"a{k}: &a{k} [*a{k - 1}, *a{k - 1}]\n" for k in range(1, 60))


def many_channels(path: Path) -> Path:
    """1e6 declarations, as many ids as there are, in a chunk that packs well."""
    one = channel(1)
    rows = np.tile(np.frombuffer(one, np.uint8), (1_000_000, 1))
    rows[:, 9:11] = (np.arange(1_000_000) % 65535 + 1).astype("<u2").view(np.uint8).reshape(-1, 2)
    content = schema() + rows.tobytes()
    return file(path, chunk(b"zstd", zstandard.ZstdCompressor(1).compress(content), len(content), zlib.crc32(content)))


def packed_file(path: Path) -> Path:
    path = path.with_suffix(".mcap.zstd")
    path.write_bytes(zstd_run(4 * GIGA, None, MAGIC))
    return path


def long_text(path: Path) -> Path:
    begin = schema() + channel(1) + struct.pack("<BQ", 5, GIGA + 30) + struct.pack("<HIQQ", 1, 0, 1, 1)
    begin += b"\0\1\0\0" + struct.pack("<I", GIGA)
    size = len(begin) + GIGA
    return file(path, chunk(b"zstd", zstd_run(GIGA, size, begin, b"a"), size))


BOMBS: dict[str, Callable[[Path], Path]] = {
    "zstd, 4 GiB as stated": lambda p: file(p, chunk(b"zstd", zstd_run(4 * GIGA, 4 * GIGA), 4 * GIGA)),
    "zstd, 4 GiB, 1 kB stated": lambda p: file(p, chunk(b"zstd", zstd_run(4 * GIGA, None), 1000)),
    "zstd frame lies": lambda p: file(p, chunk(b"zstd", zstd_run(4 * GIGA, 1000), 1000)),
    "lz4, 4 GiB as stated": lambda p: file(p, chunk(b"lz4", lz4_run(4 * GIGA), 4 * GIGA)),
    "lz4, 4 GiB, 1 kB stated": lambda p: file(p, chunk(b"lz4", lz4_run(4 * GIGA), 1000)),
    "chunk of zeros, 250 MiB": lambda p: file(p, chunk(b"zstd", zstd_run(250 << 20, 250 << 20), 250 << 20)),
    "stated 2^64 - 1": lambda p: file(p, chunk(b"zstd", zstd_run(1000, None), 2**64 - 1)),
    "chunk data of 2^63": lambda p: file(p, record(6, struct.pack("<QQQI", 0, 1, 9, 0) + prefixed(b"")
                                                   + struct.pack("<Q", 2**63) + b"x")),
    "packed file, 4 GiB": packed_file,
    "doubling types": lambda p: typed(p, definition(*(f"T{k + 1} a\nT{k + 1} b" for k in range(30)), "uint8 x")),
    "types in themselves": lambda p: typed(p, definition("T1 a", "T1 b")),
    "array of nothing": lambda p: typed(p, definition("T1[] a", ""), b"\xff\xff\xff\xff"),
    "fixed array of 2^32": lambda p: typed(p, definition("string[4294967295] a")),
    "sequence of 2^32": lambda p: typed(p, b"float64[] a", b"\xff\xff\xff\xff"),
    "texts, 2^32": lambda p: typed(p, b"string[] a", b"\xff\xff\xff\xff"),
    "text of 2^32": lambda p: typed(p, b"string a", b"\xff\xff\xff\xff"),
    "1e6 channels": many_channels,
    "1 GiB text": long_text,
    "metadata of 2^32": lambda p: file(p, record(12, prefixed(b"m") + struct.pack("<I", 2**32 - 1) + b"x")),
    "aliases in the rig": lambda p: rest_log(p, aliases(), 5),
    "aliases in parameters": lambda p: log_with(p, "/rig/setup", aliases()),
    "deep YAML": lambda p: log_with(p, "/rig/setup", "[" * 100_000),
    "deep JSON as the rig": lambda p: rest_log(p, '{"rig":' * 100_000, 5),
}  # fmt: skip
"""Name -> what writes it."""


def verbs(log: Path, folder: Path) -> dict[str, Sequence[object]]:
    """Every verb that reads a log."""
    return {
        "log info": ("log", "info", log), "log validate": ("log", "validate", log),
        "log recover": ("log", "recover", log, "-o", folder / "r.mcap", "--overwrite"),
        "log export": ("log", "export", log, "-o", folder / "csv", "--overwrite"),
        "log compare": ("log", "compare", log, log), "log report": ("log", "report", log, "-o", folder / "r.html"),
        "replay --stepped": ("replay", log, "--stepped"), "replay --closed-loop": ("replay", log, "--closed-loop"),
        "replay (live)": ("replay", log, "--rate", "100"), "view": ("view", log),
        "diagnose": ("diagnose", log, "-o", folder / "d"),
    }  # fmt: skip
