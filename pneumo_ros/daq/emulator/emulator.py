# SPDX-License-Identifier: Apache-2.0
"""A pseudo-terminal that behaves like the rig's board: same firmware rules, same converters, the plant in real time.

The board's clock and its sampling are ideal: samples are due at exact device times, and one that the computer makes
late still carries its due time, as a timer-driven converter's would. The emulator writes down what it did, in monotonic
time, so that a test can compare a driver with the truth.
"""

from __future__ import annotations

import contextlib
import errno
import os
import pty
import select
import time
import tty
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from pneumo_ros.daq.emulator.device import Device
from pneumo_ros.daq.emulator.faults import Fault, NoisyLine
from pneumo_ros.daq.emulator.record import EmulatorRecord
from pneumo_ros.daq.emulator.simulation import RigSimulation
from pneumo_ros.daq.frames import DeviceState, Hello
from pneumo_ros.errors import InputError

SECOND = 1_000_000_000  # ns
READ_SIZE = 4096
BACKLOG = 64_000  # bytes kept for a host that does not read; the rest is lost, as on a full USB buffer
BOOT_DARK = SECOND // 5  # ns the board needs to restart
WRAP = 1 << 32


class Emulator:
    """One emulated board on a pseudo-terminal.

    Parameters
    ----------
    simulation : the rig behind the board
    link : path of the symbolic link to the pseudo-terminal
    faults : what shall go wrong, and when
    seed : of the line's faults
    start_us : device clock at boot, us (near 2^32 shows the wrap-around)
    on_state : called with the board's state whenever it changes
    """

    def __init__(
        self,
        simulation: RigSimulation,
        link: Path,
        faults: Sequence[Fault] = (),
        seed: int = 1,
        start_us: int = 0,
        on_state: Callable[[DeviceState], None] = lambda state: None,
    ) -> None:
        self.simulation, self.link, self.faults = simulation, link, tuple(faults)
        self.record = EmulatorRecord()
        self._rng = np.random.default_rng(seed)
        self._line = NoisyLine(self._rng)
        self._drift = 1e-6 * sum(f.number("ppm") for f in self.faults if f.kind == "drift")
        self._start_us, self._on_state = start_us, on_state
        self._master: int | None = None
        self._slave: int | None = None
        self._armed_at: int | None = None
        self._active: dict[str, Fault] = {}
        self._stuck: dict[str, int] = {}
        self._held: deque[tuple[int, bytes]] = deque()
        self._backlog = bytearray()
        self._state = DeviceState.SAFE
        self._dark_until = 0
        self._heard_ns = 0
        self._boots = 0
        self.stopped = False

    # -- life ------------------------------------------------------------------------------------------------------

    def run(self, duration: float | None = None) -> EmulatorRecord:
        """Behave like the rig for ``duration`` s, or until :meth:`stop`; returns what was done."""
        self._plug()
        try:
            self._origin = time.monotonic_ns()
            self._boot(self._origin)
            end = None if duration is None else self._origin + round(duration * SECOND)
            period = self.simulation.hello.sample_period_us * 1000 / (1.0 + self._drift)
            index = 0
            while not self.stopped and (end is None or time.monotonic_ns() < end):
                index += 1
                self._period_until(self._origin + round(index * period))
        finally:
            self._unplug()
        return self.record

    def stop(self) -> None:
        """End :meth:`run` soon; safe to call from a signal handler."""
        self.stopped = True

    def _boot(self, now: int) -> None:
        self._boots += 1
        self._boot_ns = now
        identity: Hello = self.simulation.hello._replace(boot_id=self.simulation.hello.boot_id + self._boots - 1)
        self.device = Device(identity, self._send, self._write_outputs)
        self.device.boot(self._device_us(now))

    def _period_until(self, due: int) -> None:
        """Listen until the next sample is due, then take it."""
        while True:
            now = time.monotonic_ns()
            self._listen(max(0, due - now), due)
            if now >= due:
                break
        self._update_faults(due)
        self.simulation.advance()
        if due >= self._dark_until:
            self._sample(due)
        self._note_state(due)
        self._flush(due)
        self.record.lateness_ns.append(time.monotonic_ns() - due)

    def _sample(self, due: int) -> None:
        counts = self._counts()
        failed = "converter" in self._active
        self.record.sample(self._boots, self.device.samples, due, counts, self.simulation.state)
        self.device.tick(self._device_us(due), None if failed else counts, "estop" in self._active)

    def _counts(self) -> tuple[int, ...]:
        values = self.simulation.values()
        counts = list(self.simulation.convert(values))
        for name in ("stuck", "rail", "offset"):
            fault = self._active.get(name)
            if fault is not None:
                self._spoil(counts, fault)
        return tuple(counts)

    def _spoil(self, counts: list[int], fault: Fault) -> None:
        place = self.simulation.place(fault.word("channel"))
        if fault.kind == "rail":
            counts[place] = self.simulation.rail(fault.word("side"))
        elif fault.kind == "offset":
            counts[place] = self.simulation.shifted(counts[place], fault.word("channel"), fault.number("value"))
        else:
            counts[place] = self._stuck.setdefault(fault.word("channel"), counts[place])

    # -- faults ----------------------------------------------------------------------------------------------------

    def _update_faults(self, now: int) -> None:
        if self._armed_at is None or not self.faults:
            return
        elapsed = (now - self._armed_at) / SECOND
        active = {fault.kind: fault for fault in self.faults if fault.active(elapsed)}
        for kind in active.keys() - self._active.keys():
            self.record.event(now, "fault_on", kind)
            self._begin(kind, active[kind], now)
        for kind in self._active.keys() - active.keys():
            self.record.event(now, "fault_off", kind)
            self._end(kind, now)
        self._active = active

    def _begin(self, kind: str, fault: Fault, now: int) -> None:
        if kind == "disconnect":
            self._unplug()
        elif kind == "reset":
            self._dark_until = now + BOOT_DARK
            self.device.power_down()
        elif kind == "supply":
            self.simulation.set_supply(fault.number("pressure"))
        elif kind == "noise":
            self._emit(self._rng.bytes(int(fault.number("bytes"))))

    def _end(self, kind: str, now: int) -> None:
        if kind == "disconnect":
            self._plug()
        elif kind == "reset":
            self._boot(now)
        elif kind == "supply":
            self.simulation.set_supply(self.simulation.rig.supply_pressure.value)
        elif kind == "stuck":
            self._stuck.clear()

    # -- line ------------------------------------------------------------------------------------------------------

    def _plug(self) -> None:
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self._backlog.clear()
        part = self.link.with_name(self.link.name + ".part")
        try:
            with contextlib.suppress(FileNotFoundError):
                part.unlink()
            part.symlink_to(os.ttyname(self._slave))
            part.replace(self.link)
        except OSError as error:
            raise InputError(
                f"cannot make the link ({error})", where=self.link, remedy="choose another path"
            ) from error
        # The slave stays open here: without any holder the master would answer EIO until a host comes, and lose its
        # raw mode. A host still sees the port vanish, because closing the master hangs the slave up.

    def _unplug(self) -> None:
        with contextlib.suppress(FileNotFoundError):
            self.link.unlink()
        for handle in (self._master, self._slave):
            if handle is not None:
                os.close(handle)
        self._master = self._slave = None
        self._held.clear()

    def _listen(self, wait_ns: int, due: int) -> None:
        """Take what the host sends within ``wait_ns``; the board's clock never runs past a sample that is still due."""
        if self._master is None:
            time.sleep(wait_ns / SECOND)
            return
        if not select.select([self._master], [], [], wait_ns / SECOND)[0]:
            return
        try:
            data = os.read(self._master, READ_SIZE)
        except OSError as error:
            if error.errno not in (errno.EIO, errno.EAGAIN):
                raise
            time.sleep(min(wait_ns, SECOND // 1000) / SECOND)
            return
        now, silent = min(time.monotonic_ns(), due), self._active.get("silent")
        if now < self._dark_until or (silent is not None and silent.number("deaf")):
            return
        self._heard_ns = time.monotonic_ns()
        self.device.receive(self._line.pass_through(data, *self._rates()), self._device_us(now))
        self._note_state(time.monotonic_ns())

    def _rates(self) -> tuple[float, float]:
        drop, flip = self._active.get("drop"), self._active.get("flip")
        return (drop.number("rate") if drop else 0.0), (flip.number("rate") if flip else 0.0)

    def _send(self, data: bytes) -> None:
        if "silent" in self._active:
            return
        jitter = self._active.get("jitter")
        now = time.monotonic_ns()
        if jitter is None and not self._held:
            self._emit(self._line.pass_through(data, *self._rates()))
            return
        delay = self._rng.random() * jitter.number("ms") * 1e6 if jitter else 0.0
        # Frames stay in order: each waits at least as long as the one before.
        release = max(now + round(delay), self._held[-1][0] if self._held else 0)
        self._held.append((release, data))

    def _flush(self, now: int) -> None:
        now = max(now, time.monotonic_ns())
        while self._held and self._held[0][0] <= now:
            self._emit(self._line.pass_through(self._held.popleft()[1], *self._rates()))
        if self._backlog:
            self._emit(b"")

    def _emit(self, data: bytes) -> None:
        if self._master is None:
            return
        if len(self._backlog) + len(data) <= BACKLOG:
            self._backlog += data
        else:
            self.record.overruns += 1
        with contextlib.suppress(BlockingIOError):
            written = os.write(self._master, self._backlog)
            del self._backlog[:written]

    # -- record ----------------------------------------------------------------------------------------------------

    def _device_us(self, now: int) -> int:
        """The board's clock at a host time: starts at boot, runs fast by the drift, wraps."""
        return (self._start_us + round((now - self._boot_ns) * (1.0 + self._drift) / 1000)) % WRAP

    def _write_outputs(self, counts: tuple[int, ...]) -> None:
        self.simulation.write_outputs(counts)
        safe = counts == tuple(entry.safe for entry in self.simulation.hello.outputs)
        if self.record.outputs(time.monotonic_ns(), safe) and safe:
            self.record.event(self._heard_ns, "last_heard", "")

    def _note_state(self, now: int) -> None:
        state = self.device.state
        if state is self._state:
            return
        self._state = state
        self.record.event(now, "state", f"{state.name.lower()} {self.device.fault.name.lower()}")
        if state is DeviceState.ARMED and self._armed_at is None:
            self._armed_at = now
            self.simulation.start_road()
        self._on_state(state)
