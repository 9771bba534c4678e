# SPDX-License-Identifier: Apache-2.0
"""Samples of a board to measurements: continuity, host time, SI values, and what the monitors find."""

from __future__ import annotations

from collections import Counter, deque
from typing import NamedTuple

from pneumo_ros.daq.calibration import SENSORS, Calibration
from pneumo_ros.daq.clock import DeviceClock
from pneumo_ros.daq.frames import DeviceState, Hello, Sample, SampleFlag
from pneumo_ros.daq.limits import LimitMonitor
from pneumo_ros.daq.plausibility import PlausibilityMonitor
from pneumo_ros.daq.reasons import Finding, Reason
from pneumo_ros.daq.safety_config import SafetyConfig
from pneumo_ros.daq.scaling import input_scale
from pneumo_ros.plant.air_spring import AreaSurface
from pneumo_ros.rig import Rig

WRAP = 1 << 32
MAX_GAP = 1 << 31  # sequences further ahead than this are behind
MISFITS = 10  # samples in a row that do not continue the last good one: another board, or it has restarted
LATENCIES = 2000  # kept for the percentiles
LOSS_MEMORY = 40  # frames over which the recent loss forgets


class Measurement(NamedTuple):
    """One sample in SI.

    ``stamp_ns`` is the sample time on the host's monotonic clock, ``arrival_ns`` when its frame was complete;
    ``counts``, ``values`` (m, Pa absolute) and ``valid`` are in the order of SENSORS.
    """

    sequence: int
    stamp_ns: int
    arrival_ns: int
    counts: tuple[int, ...]
    values: tuple[float, ...]
    valid: tuple[bool, ...]
    state: DeviceState

    @property
    def usable(self) -> bool:
        """Whether every displacement and spring pressure can be believed."""
        return all(self.valid[:6])


class Intake:
    """Everything between a decoded SAMPLE and a measurement, for one board.

    Parameters
    ----------
    hello : the board
    calibration, safety, rig : configuration
    surface : effective area, already loaded: nothing may wait once the samples come
    clock : of this board as learnt before, if it has run on since
    """

    def __init__(
        self,
        hello: Hello,
        calibration: Calibration,
        safety: SafetyConfig,
        rig: Rig,
        surface: AreaSurface,
        clock: DeviceClock | None = None,
    ) -> None:
        self.hello, self.rig, self._safety, self._surface = hello, rig, safety, surface
        self.clock = clock or DeviceClock()
        self.limits = LimitMonitor(safety.limits)
        self.samples = self.lost = self.out_of_step = 0
        self.recent_loss = 0.0  # share of frames lost, exponentially forgotten
        self.rails: Counter[str] = Counter()
        self.latencies_ns: deque[int] = deque(maxlen=LATENCIES)
        self._last: Sample | None = None
        self._misfits = 0
        self._stamp_ns = 0
        self._failures = 0
        self.use(calibration)

    @property
    def in_step(self) -> bool:
        """False once the samples no longer continue what came before: shake hands again."""
        return self._misfits < MISFITS

    def use(self, calibration: Calibration) -> None:
        """Take another calibration, at once."""
        self.calibration = calibration
        self.scale = input_scale(calibration, self.hello, self.rig.ambient_pressure.value)
        period = self.hello.sample_period_us * 1e-6
        self.plausibility = PlausibilityMonitor(self._safety.plausibility, self.scale, self.rig, period, self._surface)
        self.limits.reset()

    def take(self, sample: Sample, arrival_ns: int) -> tuple[Measurement | None, list[Finding]]:
        """The measurement of a sample, None if it is out of step or was not converted, and the findings."""
        dt = self._elapsed(sample)
        if dt is None:
            return None, []
        stamp = self._stamp(sample.device_us, arrival_ns)
        if sample.flags & SampleFlag.CONVERTER_FAILED:
            return None, self._failed()
        self._failures = 0
        counts = self.scale.ordered(sample.counts)
        values = self.scale.values(counts)
        valid, found = self.plausibility.step(counts, values, dt)
        if all(valid):
            found += self.limits.step(values, dt)
        else:
            self._count_rails(counts)
        return Measurement(sample.sequence, stamp, arrival_ns, counts, values, valid, sample.state), found

    def _elapsed(self, sample: Sample) -> float | None:
        """Seconds since the sample before; None if sequence and device time do not fit it.

        A second look behind the CRC: what passes 16 bits by chance must also continue two counters.
        """
        last, period = self._last, self.hello.sample_period_us
        if last is None:
            self._accept(sample, 0)
            return period * 1e-6
        ahead = (sample.sequence - last.sequence) % WRAP
        elapsed = (sample.device_us - last.device_us) % WRAP
        if not 0 < ahead < MAX_GAP or abs(elapsed - ahead * period % WRAP) > 0.5 * period + 1e-3 * elapsed:
            self.out_of_step += 1
            self._misfits += 1
            return None
        self._accept(sample, ahead - 1)
        return elapsed * 1e-6

    def _accept(self, sample: Sample, lost: int) -> None:
        self._last, self._misfits = sample, 0
        kept = (1.0 - 1.0 / LOSS_MEMORY) ** min(lost, LOSS_MEMORY * 10)
        self.recent_loss = (1.0 - kept * (1.0 - self.recent_loss)) * (1.0 - 1.0 / LOSS_MEMORY)
        self.samples += 1
        self.lost += lost

    def _stamp(self, device_us: int, arrival_ns: int) -> int:
        """Host time of a sample; strictly increasing, also while the clock is being learnt."""
        device_ns = self.clock.add(device_us, arrival_ns)
        self._stamp_ns = max(self.clock.host_ns(device_ns), self._stamp_ns + 1)
        self.latencies_ns.append(arrival_ns - self._stamp_ns)
        return self._stamp_ns

    def _failed(self) -> list[Finding]:
        self._failures += 1
        if self._failures < self._safety.plausibility.bad_samples:
            return []
        return [Finding(Reason.CONVERTER, "converter", f"{self._failures} conversions in a row failed")]

    def _count_rails(self, counts: tuple[int, ...]) -> None:
        for name, count in zip(SENSORS, counts, strict=True):
            if not self.scale.low < count < self.scale.high:
                self.rails[name] += 1
