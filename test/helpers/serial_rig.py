# SPDX-License-Identifier: Apache-2.0
"""An emulated rig in its own process, a driver on its port, estimator and controller at 500 Hz: a loop without ROS."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from helpers import emulators
from pneumo_ros.control import half_car as control
from pneumo_ros.daq.calibration_file import load_calibration
from pneumo_ros.daq.core import DriverCore
from pneumo_ros.daq.driver import SerialDriver
from pneumo_ros.daq.intake import Measurement
from pneumo_ros.daq.priority import freeze_startup_objects
from pneumo_ros.daq.reasons import Event, Reason
from pneumo_ros.daq.safety_config import load_safety
from pneumo_ros.estimation import half_car as estimation
from pneumo_ros.parameters import settings
from pneumo_ros.rig import load_rig

PERIOD = 2e-3  # s of estimator and controller
DECIMATION = 2  # samples a control period
STALL_NS = 12_000_000  # a thread or the board late by more: the computer, not the driver, is being measured
CALIBRATION = "appendix_c_corrected"


class Loop:
    """Estimator and controller, called with every measurement."""

    def __init__(self, controller: str = "first_order_smflc") -> None:
        rig = load_rig()
        self.estimator = estimation.build_estimator(rig, PERIOD, settings(estimation.PARAMETERS), "loop")
        values = settings(control.PARAMETERS, {"controller": controller})
        self.controller = control.build_controller(rig, PERIOD, values, "loop")
        self._sample = np.zeros(6)
        self.reset()
        self.step((0.03, 0.03, -0.016, -0.024, 2.7e5, 4.3e5, 7.9e5))  # compile before it matters
        self.reset()

    def reset(self) -> None:
        self._estimate: Any = None
        self._state: Any = None

    def step(self, values: Sequence[float]) -> list[float]:
        self._sample[:] = values[:6]
        if self._estimate is None:
            self._estimate = self.estimator.init(self._sample)
        self._estimate, estimate = self.estimator.step(self._estimate, self._sample)
        if self._state is None:
            self._state = self.controller.init(estimate)
        self._state, command, _ = self.controller.step(self._state, estimate)
        return command.tolist()  # type: ignore[no-any-return]


class SerialRig:
    """Context: emulator and driver; ``measurements`` and ``events`` collect what the driver gives out.

    Parameters
    ----------
    folder : for the link and the board's record
    faults : as for ``pneumo emulate --fault``
    arguments : further ones of ``pneumo emulate``
    loop : closes the loop; None leaves the valves alone
    """

    def __init__(
        self,
        folder: Path,
        faults: Sequence[str] = (),
        arguments: Sequence[str] = (),
        loop: Loop | None = None,
        calibration: str = CALIBRATION,
    ) -> None:
        self.link, self.record_path = folder / "rig", folder / "record.npz"
        self.loop = loop
        self.measurements: list[Measurement] = []
        self.events: list[Event] = []
        self.stalls_ns: list[int] = []
        self._words = [
            "--record", str(self.record_path), "--calibration", calibration,
            *(word for fault in faults for word in ("--fault", fault)), *arguments,
        ]  # fmt: skip
        self.driver = SerialDriver(
            str(self.link), load_safety(), load_calibration(calibration), load_rig(), self._on_measurement,
            self.events.append,
        )  # fmt: skip

    def __enter__(self) -> SerialRig:
        self.start_emulator()
        freeze_startup_objects()
        try:
            self.driver.open()
        except BaseException:
            self.stop_emulator()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.driver.close()
        self.stop_emulator()
        if kind is None:
            self.truth = Truth(self.record_path)

    def start_emulator(self) -> None:
        self._emulator = emulators.started(self.link, *self._words)

    def stop_emulator(self) -> None:
        emulators.ended(self._emulator)

    def arm(self, timeout: float = 15.0) -> None:
        """Arm as soon as nothing speaks against it."""
        assert self.wait(lambda core: not core.blockers(time.monotonic_ns()), timeout), self.driver.core.blockers(
            time.monotonic_ns()
        )
        if self.loop:
            self.loop.reset()
        assert self.driver.arm() == []

    def wait(self, condition: Callable[[DriverCore], bool], timeout: float) -> bool:
        return self.driver.wait_for(condition, timeout)

    def reasons(self) -> list[Reason]:
        return [event.reason for event in self.events]

    def trip(self, reason: Reason) -> Event:
        return next(event for event in self.events if event.reason is reason)

    def _on_measurement(self, measurement: Measurement) -> None:
        self.measurements.append(measurement)
        if self.loop and measurement.usable and measurement.sequence % DECIMATION == 0:
            self.driver.command(self.loop.step(measurement.values), measurement.stamp_ns)


class Truth:
    """What the board really did."""

    def __init__(self, path: Path) -> None:
        with np.load(path) as data:
            self.events: list[tuple[int, str, str]] = [tuple(e) for e in json.loads(str(data["events"]))]
            self.overruns = int(data["overruns"])
            self.time_ns, self.boot = data["time_ns"], data["boot"]
            self.sequence, self.counts, self.states = data["sequence"], data["counts"], data["states"]
            self.lateness_ns = data["lateness_ns"]
        self._rows = {(int(b), int(s)): i for i, (b, s) in enumerate(zip(self.boot, self.sequence, strict=True))}

    def when(self, kind: str, text: str) -> int:
        """First time of an event, monotonic ns."""
        return next(when for when, k, t in self.events if k == kind and t.startswith(text))

    def safe_after(self, start: int) -> float:
        """ms from ``start`` until the valves were safe."""
        return next(
            (when - start) / 1e6 for when, k, t in self.events if k == "valves" and t == "safe" and when >= start
        )

    def row(self, measurement: Measurement, boot: int = 1) -> int | None:
        """Where the record has a measurement's sample."""
        return self._rows.get((boot, measurement.sequence))

    def stamp_errors(self, measurements: Sequence[Measurement], boot: int = 1) -> np.ndarray:
        """Stamp minus true sample time, ns."""
        rows = [(m, self.row(m, boot)) for m in measurements]
        return np.array([m.stamp_ns - self.time_ns[row] for m, row in rows if row is not None])

    def wrong_values(self, measurements: Sequence[Measurement]) -> int:
        """Measurements whose counts are not those the board converted, in any of its boots."""
        wrong, boots = 0, sorted(set(self.boot.tolist()))
        for m in measurements:
            rows = [self._rows.get((boot, m.sequence)) for boot in boots]
            wrong += not any(row is not None and tuple(self.counts[row]) == m.counts for row in rows)
        return wrong

    def stalled(self, start: int, end: int) -> bool:
        """Whether the board itself was late between two times: then nothing about reaction times follows."""
        inside = (self.time_ns[: len(self.lateness_ns)] >= start) & (self.time_ns[: len(self.lateness_ns)] <= end)
        return bool((self.lateness_ns[: len(inside)][inside] > STALL_NS).any())
