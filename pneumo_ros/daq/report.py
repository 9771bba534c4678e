# SPDX-License-Identifier: Apache-2.0
"""The driver's health in words and figures, for /diagnostics (REP 107) and for people."""

from __future__ import annotations

import numpy as np

from pneumo_ros.daq.actuation import Mode
from pneumo_ros.daq.core import DriverCore
from pneumo_ros.daq.driver import SerialDriver
from pneumo_ros.daq.frames import Reject
from pneumo_ros.daq.link import Phase
from pneumo_ros.daq.reasons import Level


class LinkReport:
    """Turns counters into rates; call :meth:`values` about once a second."""

    def __init__(self, driver: SerialDriver) -> None:
        self._driver = driver
        self._before = (0, 0)

    def values(self, now: int) -> dict[str, str]:
        """Key figures; ``now`` monotonic ns."""
        core = self._driver.core
        out = {"link": core.phase.value, "mode": core.mode.value, "port": self._driver.port}
        out.update(self._line(core))
        if core.intake is not None:
            out.update(self._intake(core, now))
        if core.status is not None:
            out["frames the board dropped"] = str(core.status.bad_frames)
            out["commands the board refused"] = str(core.status.refused_commands)
        out["last trip"] = core.trip.message if core.trip else "none"
        return out

    def level(self) -> tuple[Level, str]:
        """Level and message."""
        core = self._driver.core
        if core.phase is not Phase.RUNNING:
            return Level.ERROR, f"link {core.phase.value}"
        if core.mode is Mode.ESTOP:
            return Level.ERROR, "emergency stop"
        if core.trip is not None:
            return Level.WARN, core.trip.message
        return Level.OK, core.mode.value

    def _line(self, core: DriverCore) -> dict[str, str]:
        damaged = core.decoder.bad
        return {
            "CRC errors": str(core.decoder.rejected[Reject.CRC]),
            "damaged frames": str(damaged),
            "lost frames": str(core.lost_frames),
            "frames not sent": str(self._driver.dropped_writes),
            "refused commands": str(core.actuation.refused),
        }

    def _intake(self, core: DriverCore, now: int) -> dict[str, str]:
        intake = core.intake
        assert intake is not None
        samples, when = self._before
        rate = (intake.samples - samples) / ((now - when) * 1e-9) if samples <= intake.samples and when else 0.0
        self._before = (intake.samples, now)
        p50, p99 = np.percentile(intake.latencies_ns or [0], [50, 99]) / 1e3
        rails = ", ".join(f"{name} {count}" for name, count in intake.rails.items())
        return {
            "board": intake.hello.serial_number,
            "frame rate (Hz)": f"{rate:.1f}",
            "latency p50 (us)": f"{p50:.0f}",
            "latency p99 (us)": f"{p99:.0f}",
            "clock drift (ppm)": f"{intake.clock.drift * 1e6:.1f}",
            "half round trip (us)": f"{intake.clock.correction_ns / 1e3:.0f}",
            "samples at a rail": rails or "none",
        }
