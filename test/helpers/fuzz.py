# SPDX-License-Identifier: Apache-2.0
"""Mutations of logs and configurations that know their structure, and everything that reads them."""

from __future__ import annotations

import copy
import json
import random
import struct
import zlib
from collections.abc import Callable
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import yaml
import zstandard

from helpers.hostile import RIG, rest_log
from helpers.small_logs import text
from pneumo_ros.cli.session_plan import node_tables
from pneumo_ros.daq.calibration_file import load_calibration
from pneumo_ros.daq.safety_config import load_safety
from pneumo_ros.dashboard.source import Playback
from pneumo_ros.diagnosis.half_car.signals import read_signals
from pneumo_ros.errors import PneumoError
from pneumo_ros.log.comparison import compare
from pneumo_ros.log.conformance import check_conformance
from pneumo_ros.log.decoded import STRING, Log
from pneumo_ros.log.inspection import inspect_log
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.repair import recover
from pneumo_ros.log.tables import export
from pneumo_ros.paths import share_file
from pneumo_ros.rig import load_rig
from pneumo_ros.session.plan import read_config
from pneumo_ros.session.replay import replay
from pneumo_ros.session.report import write_report
from pneumo_ros.session.summary import load_session

MAGIC = b"\x89MCAP0\r\n"
SCHEMA, CHANNEL, MESSAGE = 3, 4, 5  # opcodes
Mutation = Callable[[random.Random, list[tuple[int, bytes]], bool], None]
NAMES = (
    b"", b"\0", b"\xff\xfe", b"/rig/displacement", b"/valve/command", b"/rig/config", b"/rig/setup", b"/rig/events",
    b"/x" * 5000, b"sensor_msgs/msg/JointState", b"sensor_msgs/msg/FluidPressure", b"std_msgs/msg/String", b"msg",
    b"cdr", b"json", b"ros2msg", b"ros1msg", b"float64[] a", b"string<=3 a", b"byte[4294967295] a", b"a b c d",
    b"std_msgs/Header header", "\u202e\u0000\ud7ff".encode(),
)  # fmt: skip
INTERESTING = (0, 1, 2, 255, 256, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63, 2**64 - 1)
SETUP = yaml.safe_dump(
    {"node": "controller", "parameters": {"controller": "first_order_smflc", "pole": 20.0, "rate_hz": 500.0}}
)


SHORT, LONG = 12, 1100  # samples; a diagnosis takes the long one
LONG_SHARE, WHOLE_SHARE, FIELDS_SHARE = 0.1, 0.05, 0.6  # of the seeds
REPORTS = 8  # a page takes longer than all other readers: one log in so many gets one


@lru_cache(maxsize=2)
def base_log(count: int = SHORT) -> bytes:
    """A small log of the contract, with parameters, that every reader takes if it is long enough."""
    with TemporaryDirectory() as folder:
        extra = [("/rig/setup", STRING, 0, text(SETUP))]
        return rest_log(Path(folder) / "base.mcap", RIG.to_yaml(), count, extra).read_bytes()


def records(data: bytes, begin: int = 0) -> list[tuple[int, bytes]]:
    """(opcode, body) of each whole record."""
    out = []
    while begin + 9 <= len(data):
        opcode, length = struct.unpack_from("<BQ", data, begin)
        out.append((opcode, data[begin + 9 : begin + 9 + length]))
        begin += 9 + length
    return out


def joined(found: list[tuple[int, bytes]]) -> bytes:
    """The records' bytes."""
    return b"".join(struct.pack("<BQ", opcode, len(body)) + body for opcode, body in found)


def mutated_log(seed: int) -> bytes:
    """A log with one to four mutations.

    Most keep lengths and checksums right and change what fields say, as no reader's front door stops those; of the
    others the checksums are made right again in two thirds.
    """
    rng = random.Random(seed)
    found = records(base_log(LONG if rng.random() < LONG_SHARE else SHORT)[:-8], len(MAGIC))
    if rng.random() < FIELDS_SHARE:
        for _ in range(rng.randint(1, 4)):
            _inside(rng, found, True, (_field,))
        return MAGIC + joined(found) + MAGIC
    mend = rng.random() < 0.7
    for _ in range(rng.randint(1, 4)):
        rng.choice((_inside, _inside, _inside, _record, _order, _bytes))(rng, found, mend)
    data = MAGIC + joined(found) + MAGIC
    return data[: rng.randrange(len(data))] if rng.random() < WHOLE_SHARE else data


def _spoiled(rng: random.Random, body: bytes) -> bytes:
    """A field overwritten, bytes flipped, put in, taken out or doubled."""
    data, place = bytearray(body), rng.randrange(len(body) + 1)
    kind = rng.randrange(6)
    if kind == 0 and data:
        data[place % len(data)] ^= 1 << rng.randrange(8)
    elif kind == 1:
        width = rng.choice((1, 2, 4, 8))
        data[place : place + width] = (rng.choice(INTERESTING) % 256**width).to_bytes(width, "little")
    elif kind == 2:
        data[place:place] = rng.randbytes(rng.randint(1, 40))
    elif kind == 3:
        del data[place : place + rng.randint(1, 40)]
    elif kind == 4:
        data[place:place] = data[place : place + 60]
    else:
        data[place : place + 8] = struct.pack("<d", rng.choice((float("nan"), float("inf"), -1e300, 0.0, 1e-320)))
    return bytes(data)


def _inside(rng: random.Random, found: list[tuple[int, bytes]], mend: bool, kinds: tuple[Mutation, ...] = ()) -> None:
    """Records within a chunk."""
    chunks = [k for k, (opcode, _) in enumerate(found) if opcode == 6]
    if not chunks:
        return
    k = rng.choice(chunks)
    try:
        head, content = _unpacked(found[k][1])
    except (struct.error, zstandard.ZstdError, ValueError):
        return
    inner = records(content)
    rng.choice(kinds or (_record, _order, _bytes))(rng, inner, mend)
    content = joined(inner)
    size, crc = (len(content), zlib.crc32(content)) if mend else struct.unpack_from("<QI", head, 16)
    packed = zstandard.ZstdCompressor(1).compress(content)
    body = head[:16] + struct.pack("<QI", size, crc) + struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", len(packed))
    found[k] = (6, body + packed)
    if mend:  # without its index and summary a log is read record by record
        found[:] = [(opcode, body) for opcode, body in found if opcode not in (3, 4, 7, 8, 10, 11, 13, 14)]
        found[-1] = (2, bytes(20))


def _unpacked(body: bytes) -> tuple[bytes, bytes]:
    (length,) = struct.unpack_from("<I", body, 28)
    packed = body[28 + 4 + length + 8 :]
    return body[:28], zstandard.ZstdDecompressor().decompress(packed, max_output_size=1 << 22)


def _record(rng: random.Random, found: list[tuple[int, bytes]], mend: bool) -> None:
    if found:
        k = rng.randrange(len(found))
        found[k] = (found[k][0], _spoiled(rng, found[k][1]))


def _order(rng: random.Random, found: list[tuple[int, bytes]], mend: bool) -> None:
    """A record dropped, doubled, moved, or of another kind."""
    if not found:
        return
    k, kind = rng.randrange(len(found)), rng.randrange(4)
    if kind == 0:
        del found[k]
    elif kind == 1:
        found.insert(rng.randrange(len(found)), found[k])
    elif kind == 2:
        found.insert(rng.randrange(len(found)), found.pop(k))
    else:
        found[k] = (rng.choice((0, 1, 2, 3, 4, 5, 6, 7, 9, 12, 15, 16, 0x80, 255)), found[k][1])


def _field(rng: random.Random, found: list[tuple[int, bytes]], mend: bool) -> None:
    """What one field of a schema, a channel or a message says; every length stays right."""
    kind = rng.choice((SCHEMA, CHANNEL, *(MESSAGE,) * 8))
    places = [k for k, (opcode, _) in enumerate(found) if opcode == kind]
    if not places:
        return
    k = rng.choice(places)
    body = found[k][1]
    if kind == MESSAGE:
        found[k] = (kind, _other_message(rng, body))
        return
    begin, width = (2, 3) if kind == SCHEMA else (4, 2)
    texts, end = [], begin
    for _ in range(width):
        (length,) = struct.unpack_from("<I", body, end)
        texts.append(body[end + 4 : end + 4 + length])
        end += 4 + length
    chosen = rng.randrange(width)
    texts[chosen] = rng.choice(NAMES) if rng.random() < 0.5 else _spoiled(rng, texts[chosen])
    found[k] = (kind, body[:begin] + b"".join(struct.pack("<I", len(one)) + one for one in texts) + body[end:])


def _other_message(rng: random.Random, body: bytes) -> bytes:
    """Another channel, sequence or time, other data, or a text or list in it of another length."""
    head, data = bytearray(body[:22]), body[22:]
    kind = rng.randrange(4)
    if kind == 0:
        width, place = rng.choice(((2, 0), (4, 2), (8, 6), (8, 14)))
        head[place : place + width] = (rng.choice(INTERESTING) % 256**width).to_bytes(width, "little")
    elif kind == 1 and len(data) > 8:  # a whole field of the encoding, which is aligned after four bytes of head
        place = 4 + 4 * rng.randrange((len(data) - 4) // 4)
        data = data[:place] + (rng.choice(INTERESTING) % 2**32).to_bytes(4, "little") + data[place + 4 :]
    elif kind == 2 and len(data) > 16:
        place = 4 + 8 * rng.randrange((len(data) - 4) // 8)
        value = rng.choice((float("nan"), float("inf"), -1e300, 1e-320, 1e6, -1.0))
        data = data[:place] + struct.pack("<d", value) + data[place + 8 :]
    else:
        data = _spoiled(rng, data)
    return bytes(head) + data


def _bytes(rng: random.Random, found: list[tuple[int, bytes]], mend: bool) -> None:
    """Several records spoiled."""
    for _ in range(rng.randint(2, 6)):
        _record(rng, found, mend)


def read_everything(data: bytes, folder: Path) -> str:
    """What all readers of a log make of it: read, or refused with an error of one line; anything else is raised."""
    path = folder / "mutated.mcap"
    path.write_bytes(data)
    _refused(lambda: recover(path, folder / "recovered.mcap", overwrite=True))
    try:
        log = read_log(path)
    except PneumoError as error:
        assert "\n" not in str(error)
        return "refused"
    out = folder / "out"
    readers: tuple[Callable[[], Any], ...] = (
        lambda: json.dumps(asdict(inspect_log(log)), default=str), lambda: check_conformance(log),
        lambda: compare(log, log), lambda: export(log, out, overwrite=True), lambda: replay(log),
        lambda: read_signals(path), lambda: Playback(log), lambda: load_session(path),
    )  # fmt: skip
    if zlib.crc32(data) % REPORTS == 0:
        readers += (lambda: write_report(log, folder / "report.html"),)
    refused = [_refused(reader) for reader in readers]
    _closed(log)
    return "refused" if all(refused) else "read"


def _closed(log: Log) -> None:
    log._columns.clear()


def _refused(read: Callable[[], Any]) -> bool:
    try:
        read()
    except PneumoError as error:
        assert "\n" not in str(error), str(error)
        return True
    return False


CONFIGS: dict[str, tuple[Path, Callable[[Path], Any]]] = {
    "rig": (share_file("config", "rig.yaml"), load_rig),
    "safety": (share_file("config", "safety.yaml"), load_safety),
    "session": (share_file("config", "session.yaml"), lambda path: read_config(path, node_tables())),
    "calibration": (share_file("config", "calibration", "appendix_c.yaml"), lambda path: load_calibration(str(path))),
}
VALUES: tuple[Any, ...] = (
    None, True, "", "x", -1, 0, 1e308, float("nan"), float("inf"), 2**70, [], {}, [1, 2], {"value": 1},
    "2001-01-01", "\x00", "!!python/object/apply:os.system [true]", "\u202e", "a\nb",
)  # fmt: skip


def mutated_config(seed: int, folder: Path) -> str:
    """One configuration with one to three mutations: read, or refused with an error of one line."""
    rng = random.Random(seed)
    source, read = CONFIGS[rng.choice(sorted(CONFIGS))]
    path = folder / "mutated.yaml"
    if rng.random() < 0.3:
        path.write_bytes(_spoiled(rng, source.read_bytes()))
    else:
        document = yaml.safe_load(source.read_text(encoding="utf-8"))
        for _ in range(rng.randint(1, 3)):
            _spoil(rng, document)
        path.write_text(yaml.dump(document, allow_unicode=rng.random() < 0.5), encoding="utf-8")
    return "refused" if _refused(lambda: read(path)) else "read"


def _spoil(rng: random.Random, document: Any) -> None:
    """Somewhere in the tree: another value, a missing, doubled or further entry, the entry of another place."""
    places = list(_places(document))
    if not places:
        return
    holder, key = rng.choice(places)
    kind = rng.randrange(4)
    if kind == 0:
        del holder[key]
    elif kind == 1:
        holder[key] = copy.deepcopy(rng.choice(VALUES))
    elif kind == 2 and isinstance(holder, dict):
        holder[rng.choice((None, 3, "", "extra", "__class__", (1, 2)))] = copy.deepcopy(rng.choice(VALUES))
    else:
        other, its = rng.choice(places)
        holder[key] = copy.deepcopy(other[its])


def _places(node: Any) -> Any:
    entries = list(node.items()) if isinstance(node, dict) else list(enumerate(node)) if isinstance(node, list) else []
    for key, value in entries:
        yield node, key
        yield from _places(value)
