# SPDX-License-Identifier: Apache-2.0
"""A proxy on the serial line that does its worst, and a witness who knows what both ends really said."""

from __future__ import annotations

import random
from collections import Counter, deque
from collections.abc import Callable

import numpy as np
from cobs import cobs

from helpers.simulated_rig import MS, SAFE, Bench
from pneumo_ros.daq.actuation import Mode
from pneumo_ros.daq.emulator.board import board_identity
from pneumo_ros.daq.frames import Command, CommandFlag, DeviceState, FrameError, Sample, checksum, decode
from pneumo_ros.daq.intake import Measurement

KINDS = (
    "drop", "duplicate", "reorder", "delay", "flip", "truncate", "flood", "replay", "old_session", "other_session",
    "other_version", "zeros", "silence",
)  # fmt: skip
NAMES = {"flood": "flooded"}
FLOOD = 5_000_000  # bytes of one flood
LATE_MS = 50.0
KEPT = 400  # frames of each direction that a replay draws from


class Line:
    """One direction: frames in, what the proxy makes of them out."""

    def __init__(self, rng: random.Random, recorded: list[bytes]) -> None:
        self.rng, self.recorded = rng, recorded
        self.kind = ""
        self.frames: Counter[str] = Counter()
        self.seen: deque[bytes] = deque(maxlen=KEPT)
        self._held: deque[tuple[int, bytes]] = deque()
        self._now = 0
        self._flood = 0
        self._playing = 0

    def start(self, kind: str, flood: int = 50_000) -> None:
        """From now on; '' is an honest line."""
        self.kind, self._flood, self._playing = kind, flood, self.rng.randrange(max(1, len(self.recorded)))

    def __call__(self, data: bytes) -> bytes:
        """One millisecond of the line."""
        self._now += 1
        frames = [frame + b"\0" for frame in data.split(b"\0") if frame]
        self.seen.extend(frames)
        self.frames[self.kind or "honest"] += len(frames)
        changed: Callable[[list[bytes]], list[bytes]] = getattr(self, f"_{NAMES.get(self.kind, self.kind)}", list)
        due = [frame for when, frame in self._held if when <= self._now]
        self._held = deque((when, frame) for when, frame in self._held if when > self._now)
        return b"".join(due + changed(frames))

    def _drop(self, frames: list[bytes]) -> list[bytes]:
        return [frame for frame in frames if self.rng.random() > 0.3]

    def _duplicate(self, frames: list[bytes]) -> list[bytes]:
        return [frame for frame in frames for _ in range(self.rng.choice((1, 2, 5)))]

    def _reorder(self, frames: list[bytes]) -> list[bytes]:
        mixed = frames + ([self.seen[-self.rng.randint(1, min(8, len(self.seen)))]] if self.seen else [])
        self.rng.shuffle(mixed)
        return mixed

    def _delay(self, frames: list[bytes]) -> list[bytes]:
        late = self.rng.choice((5, 30, 120, 1500))
        self._held.extend((self._now + late, frame) for frame in frames)
        return []

    def _flip(self, frames: list[bytes]) -> list[bytes]:
        out = []
        for frame in frames:
            spoiled = bytearray(frame)
            for _ in range(self.rng.choice((0, 1, 3))):
                spoiled[self.rng.randrange(len(spoiled))] ^= 1 << self.rng.randrange(8)
            out.append(bytes(spoiled))
        return out

    def _truncate(self, frames: list[bytes]) -> list[bytes]:
        return [frame[: self.rng.randrange(1, len(frame) + 1)] for frame in frames]

    def _flooded(self, frames: list[bytes]) -> list[bytes]:
        """Random bytes, delimiters among them, in front of the frames; once."""
        count, self._flood = self._flood, 0
        return [self.rng.randbytes(count), *frames]

    def _replay(self, frames: list[bytes]) -> list[bytes]:
        self.frames["played"] += 6
        return frames + [self.rng.choice(self.seen) for _ in range(6) if self.seen]

    def _old_session(self, frames: list[bytes]) -> list[bytes]:
        """A whole recorded session, in its order, beside the running one."""
        begin = self._playing
        self._playing += 6
        self.frames["played"] += 6
        return frames + self.recorded[begin : begin + 6]

    def _other_session(self, frames: list[bytes]) -> list[bytes]:
        return frames + [resealed(frame, session=self.rng.randrange(2**32)) for frame in frames]

    def _other_version(self, frames: list[bytes]) -> list[bytes]:
        return [resealed(frame, version=self.rng.choice((0, 1, 3, 255))) for frame in frames]

    def _zeros(self, frames: list[bytes]) -> list[bytes]:
        return [bytes(self.rng.randrange(100)), *frames, bytes(200)]

    def _silence(self, frames: list[bytes]) -> list[bytes]:
        return []


def resealed(frame: bytes, version: int | None = None, session: int | None = None) -> bytes:
    """The frame with another version or session, and its checksum right again."""
    data = bytearray(cobs.decode(frame[:-1]))[:-2]
    if version is not None:
        data[0] = version
    if session is not None and data[1] != 0x02:
        data[2:6] = session.to_bytes(4, "little")
    return cobs.encode(bytes(data) + checksum(bytes(data)).to_bytes(2, "little")) + b"\0"


class Witness:
    """A bench whose line is spoiled, and what must hold all the same."""

    def __init__(self, seed: int, recorded: tuple[list[bytes], list[bytes]] = ([], [])) -> None:
        self.rng = random.Random(seed)
        self.up, self.down = Line(self.rng, recorded[0]), Line(self.rng, recorded[1])
        self.bench = bench = Bench(board_identity(boot_id=1000 + seed))
        self.said: dict[tuple[int, int], tuple[int, ...]] = {}  # what the board sampled, by session and sequence
        self.asked: deque[tuple[int, tuple[int, ...]]] = deque(maxlen=400)  # ARM commands the host sent
        self.values = self.arms = self.trips = 0
        self.faults: list[str] = []
        self.recorded: tuple[list[bytes], list[bytes]] = ([], [])
        self._written = 0
        bench.up, bench.down = self._from_board, self._from_host
        bench.controller = self._steer

    def _steer(self, item: Measurement) -> None:
        """A command that no other sample has."""
        share = 1.0 + 0.2 * np.sin(0.37 * item.sequence + np.arange(4))
        self.bench.core.command((self.bench.simulation.trim.command * share).tolist(), item.stamp_ns, self.bench.now)

    def _from_board(self, data: bytes) -> bytes:
        for frame in data.split(b"\0"):
            record = _decoded(frame)
            if isinstance(record, Sample):
                self.said[record.session, record.sequence] = record.counts
            if frame:
                self.recorded[0].append(frame + b"\0")
        return self.up(data)

    def _from_host(self, data: bytes) -> bytes:
        for frame in data.split(b"\0"):
            record = _decoded(frame)
            if isinstance(record, Command) and record.flags & CommandFlag.ARM:
                self.asked.append((self.bench.now, record.counts))
            if frame:
                self.recorded[1].append(frame + b"\0")
        return self.down(data)

    def run(self, milliseconds: int) -> None:
        """The line as it is, everything checked every millisecond."""
        bench = self.bench
        for _ in range(milliseconds):
            before, armed = len(bench.measurements), bench.core.mode is Mode.ARMED
            bench.run(1)
            self._check_values(bench.measurements[before:])
            self._check_outputs()
            self.trips += armed and bench.core.mode is not Mode.ARMED
        bench.measurements.clear()

    def _check_values(self, found: list[Measurement]) -> None:
        intake = self.bench.core.intake
        for item in found:
            assert intake is not None
            self.values += 1
            true = self.said.get((intake.hello.session, item.sequence))
            if true is None or intake.scale.ordered(true) != item.counts:
                self.faults.append(f"wrong value published for sample {item.sequence}")

    def _check_outputs(self) -> None:
        """Valves open only as this host asked within the last 50 ms, and are safe 50 ms after its last wish."""
        now, outputs = self.bench.now, self.bench.outputs
        for when, counts in outputs[self._written :]:
            asked = any(when - sent <= LATE_MS * MS and counts == wish for sent, wish in self.asked)
            if counts != SAFE and not asked:
                self.faults.append(f"valves driven by a frame nobody sent lately: {counts}")
        self._written = len(outputs)
        latest = self.asked[-1][0] if self.asked else 0
        if outputs[-1][1] != SAFE and now - latest > LATE_MS * MS:
            self.faults.append(f"valves open {(now - latest) / MS:.0f} ms after the last wish")

    def arm(self) -> bool:
        """Over an honest line, as an operator would after a fault; whether it is armed then."""
        self.up.start("")
        self.down.start("")
        self.run(2200)
        if self.bench.core.mode is Mode.ESTOP:
            self.bench.core.reset(self.bench.now)
            self.run(400)
        if self.bench.core.mode is not Mode.ARMED and not self.bench.core.arm(self.bench.now):
            self.run(150)
            self.arms += 1
        return self.bench.core.mode is Mode.ARMED and self.bench.device.state is DeviceState.ARMED

    def attack(self, kind: str, direction: str, milliseconds: int = 300, flood: int = 50_000) -> None:
        """One kind of spoiling in one direction or both."""
        for line, name in ((self.up, "up"), (self.down, "down")):
            line.start(kind if direction in (name, "both") else "", flood)
        self.run(milliseconds)

    @property
    def frames(self) -> Counter[str]:
        """Frames that passed, and how."""
        return self.up.frames + self.down.frames


def _decoded(frame: bytes) -> object:
    try:
        return decode(frame)
    except FrameError:
        return None
