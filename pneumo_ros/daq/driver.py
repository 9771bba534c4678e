# SPDX-License-Identifier: Apache-2.0
"""The driver with its port: a reader thread, a supervising thread, and reopening by itself."""

from __future__ import annotations

import contextlib
import os
import select
import termios
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from typing import TypeVar

import numpy as np
import serial

from pneumo_ros.daq.actuation import Applied, Mode
from pneumo_ros.daq.calibration import SENSORS, Calibration
from pneumo_ros.daq.core import DriverCore
from pneumo_ros.daq.intake import Measurement
from pneumo_ros.daq.link import Phase
from pneumo_ros.daq.reasons import Event, Level, Reason
from pneumo_ros.daq.safety_config import SafetyConfig
from pneumo_ros.errors import InputError
from pneumo_ros.rig import Rig

BAUD = 921_600
TICK = 0.002  # s between looks at the timeouts
REOPEN = 0.1  # s between attempts to open the port
READ_SIZE = 4096
LATENESS_KEPT = 5000
POLL = 0.05  # s the reader waits for bytes before it looks whether to stop
T = TypeVar("T")


class SerialDriver:
    """A rig on a serial port.

    Parameters
    ----------
    port : device file, or a link to one
    safety, calibration, rig : configuration
    on_measurement, on_event : called from the driver's threads, never while a lock is held
    baud : of a UART; USB CDC ignores it
    on_applied : the same, for every opening that went to the valves
    """

    def __init__(
        self,
        port: str,
        safety: SafetyConfig,
        calibration: Calibration,
        rig: Rig,
        on_measurement: Callable[[Measurement], None],
        on_event: Callable[[Event], None],
        baud: int = BAUD,
        on_applied: Callable[[Applied], None] = lambda _: None,
    ) -> None:
        self.port, self.baud = port, baud
        self.core = DriverCore(safety, calibration, rig, self._write, self._discard)
        self.dropped_writes = 0
        self.lateness_ns: deque[tuple[int, int]] = deque(maxlen=LATENESS_KEPT)  # (when, how late a look was)
        self._on_measurement, self._on_event, self._on_applied = on_measurement, on_event, on_applied
        self._serial: serial.Serial | None = None
        self._lock = threading.RLock()
        self._delivery = threading.Lock()
        self._changed = threading.Condition(self._lock)
        self._stop = threading.Event()
        self._threads: list[threading.Thread] = []
        self._collected: list[Measurement] | None = None
        self._complained = self._failed = False

    # -- life ------------------------------------------------------------------------------------------------------

    def open(self) -> None:
        """Open the port and start the threads.

        Raises
        ------
        InputError
            if the port cannot be opened now. Later the driver reopens it by itself.
        """
        self._open_port()
        self._stop.clear()
        self._threads = [
            threading.Thread(target=self._guarded, args=(target,), name=name, daemon=True)
            for target, name in ((self._read_forever, "daq-reader"), (self._supervise, "daq-supervisor"))
        ]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Valves safe, threads ended, port closed."""
        self.disarm()
        self._stop.set()
        for thread in self._threads:
            thread.join()
        with self._lock:
            self._close_port()

    def wait_for(self, condition: Callable[[DriverCore], bool], timeout: float) -> bool:
        """Wait until ``condition`` of the core holds; False after ``timeout`` s."""
        with self._changed:
            return self._changed.wait_for(lambda: condition(self.core), timeout)

    # -- what an operator and a controller ask ---------------------------------------------------------------------

    def command(self, areas: Sequence[float], stamp_ns: int) -> None:
        """Pass on a controller's command: m2 in the order of VALVES; ``stamp_ns`` its sample time, monotonic."""
        self._do(lambda now: self.core.command(areas, stamp_ns, now))

    def arm(self, timeout: float = 1.0) -> list[str]:
        """Arm the valves and wait for the board to follow; returns why not."""
        why = self._ask(self.core.arm, Mode.ARMING, timeout)
        if why or self.core.mode is Mode.ARMED:
            return why
        trip = self.core.trip
        return [trip.message if trip else "the board did not arm"]

    def disarm(self) -> None:
        """Safe command."""
        self._do(self.core.disarm)

    def estop(self, source: str) -> None:
        """Emergency stop, latched."""
        self._do(lambda now: self.core.estop(source, now))

    def trip(self, reason: Reason, why: str) -> None:
        """Valves safe because of something the driver cannot see itself."""
        self._do(lambda now: self.core.refuse(reason, why, now))

    def reset(self, timeout: float = 1.0) -> list[str]:
        """Reset an emergency stop; returns why not."""
        why = self._ask(self.core.reset, Mode.RESETTING, timeout)
        return why if why or self.core.mode is Mode.SAFE else ["the board stays in its emergency stop"]

    def _ask(self, request: Callable[[int], list[str]], asking: Mode, timeout: float) -> list[str]:
        """Ask the board and wait while the answer is out; returns why it was not even asked."""
        why = self._do(request)
        if not why:
            self.wait_for(lambda core: core.mode is not asking, timeout)
        return why

    def averages(self, samples: int, timeout: float) -> dict[str, tuple[float, float]]:
        """Mean and standard deviation of the next samples' values by sensor name, SI, for zero and span.

        Raises
        ------
        InputError
            while armed, without samples, or if a sensor cannot be believed.
        """
        if self.core.mode is not Mode.SAFE:
            raise InputError(f"cannot measure a reference in mode {self.core.mode.value}", where=self.port,
                             remedy="deactivate the driver first")  # fmt: skip
        with self._changed:
            taken: list[Measurement] = []
            self._collected = taken
            complete = self._changed.wait_for(lambda: len(taken) >= samples, timeout)
            self._collected = None
        if not complete:
            raise InputError(f"only {len(taken)} of {samples} samples came", where=self.port)
        for number, name in enumerate(SENSORS):
            if not all(m.valid[number] for m in taken):
                raise InputError("sensor cannot be believed", where=self.port, key=name, remedy="see /rig/events")
        values = np.array([m.values for m in taken[:samples]])
        return {name: (float(values[:, i].mean()), float(values[:, i].std())) for i, name in enumerate(SENSORS)}

    def use(self, calibration: Calibration) -> None:
        """Take another calibration."""
        self._do(lambda now: self.core.use(calibration, now))

    @property
    def failed(self) -> bool:
        """Whether one of the driver's threads has ended by an error; it then drives no valve any more."""
        return self._failed

    # -- threads ---------------------------------------------------------------------------------------------------

    def _guarded(self, target: Callable[[], None]) -> None:
        """Run a thread; if it breaks, the valves are made safe and the driver ends."""
        try:
            target()
        except Exception as error:
            self._failed = True
            self._stop.set()
            text = f"{threading.current_thread().name}: {type(error).__name__}: {error}"
            self._do(partial(self.core.fail, text))
            raise

    def _do(self, action: Callable[[int], T]) -> T:
        with self._changed:
            result = action(time.monotonic_ns())
            self._changed.notify_all()
        self._deliver()
        return result

    def _deliver(self) -> None:
        """Hand out what the core produced, in order, one thread at a time, without holding the core's lock.

        A thread that finds another one at it leaves: a publisher that blocks must not hold up the timeouts.
        """
        while self.core.pending and self._delivery.acquire(blocking=False):
            try:
                out, applied = self._drain()
                for opening in applied:
                    self._on_applied(opening)
                for item in out:
                    if isinstance(item, Measurement):
                        self._on_measurement(item)
                    else:
                        self._on_event(item)
            finally:
                self._delivery.release()

    def _drain(self) -> tuple[list[Measurement | Event], list[Applied]]:
        with self._changed:
            out, applied = self.core.drain(), self.core.drain_applied()
            if self._collected is not None:
                self._collected += [item for item in out if isinstance(item, Measurement)]
                self._changed.notify_all()
        return out, applied

    def _read_forever(self) -> None:
        while not self._stop.is_set():
            with self._changed:
                self._changed.wait_for(lambda: self._serial is not None, POLL)
                port = self._serial
            if port is None:
                continue
            try:
                if not select.select([port.fileno()], [], [], POLL)[0]:
                    continue
                data = os.read(port.fileno(), READ_SIZE)
                if not data:
                    raise OSError("end of file")
            except (OSError, ValueError) as error:
                self._do(partial(self._on_gone, str(error)))
                continue
            self._do(partial(self.core.receive, data))

    def _supervise(self) -> None:
        next_open, due = 0.0, time.monotonic_ns()
        while not self._stop.wait(TICK):
            now = time.monotonic_ns()
            self.lateness_ns.append((now, now - due - round(TICK * 1e9)))
            due = now
            if self._serial is None and time.monotonic() >= next_open:
                next_open = time.monotonic() + REOPEN
                self._try_open()
            self._do(self.core.tick)

    # -- port ------------------------------------------------------------------------------------------------------

    def _open_port(self) -> None:
        try:
            # Exclusive: two drivers on one rig would command the same valves.
            port = serial.Serial(self.port, self.baud, timeout=0, write_timeout=0, exclusive=True)
        except (OSError, ValueError) as error:
            raise InputError(
                f"cannot open the port ({error})", where=self.port, remedy="check cable, name, permissions, other users"
            ) from error
        # An FTDI adapter otherwise gathers bytes for 16 ms. A pseudo-terminal, for one, does not know the setting.
        with contextlib.suppress(OSError, ValueError, NotImplementedError):
            port.set_low_latency_mode(True)
        with self._changed:
            self._serial = port
            self.core.opened(time.monotonic_ns())
            self._changed.notify_all()

    def _try_open(self) -> None:
        try:
            self._open_port()
            self._complained = False
        except InputError as error:
            if not self._complained:
                self._complained = True
                with self._lock:
                    self.core.event(Level.WARN, Reason.LINK_BUSY, str(error), {"port": self.port}, time.monotonic_ns())

    def _on_gone(self, why: str, now: int) -> None:
        self._close_port()
        self.core.closed(f"{self.port}: {why}", now)

    def _close_port(self) -> None:
        port, self._serial = self._serial, None
        if port is not None:
            with contextlib.suppress(OSError):
                port.close()

    def _write(self, data: bytes) -> None:
        """Never waits: a full buffer or a vanished port loses the frame, and the timeouts see what is wrong.

        Not pyserial's write(): without a write timeout it spins for as long as the buffer is full.
        """
        port = self._serial
        if port is None:
            return
        try:
            if os.write(port.fileno(), data) < len(data):
                self.dropped_writes += 1
        except (OSError, serial.SerialException):
            self.dropped_writes += 1

    def _discard(self) -> None:
        port = self._serial
        if port is not None:
            with contextlib.suppress(OSError, termios.error):
                port.reset_output_buffer()

    @property
    def running(self) -> bool:
        """Whether a board is answering."""
        return self.core.phase is Phase.RUNNING
