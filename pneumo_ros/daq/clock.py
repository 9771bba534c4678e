# SPDX-License-Identifier: Apache-2.0
"""Device clock to host clock: offset and drift from arrivals alone, refined by the round trip of commands.

An arrival is the sample time plus a delay that is never negative: the points (device time, arrival - device time) lie
above a line whose slope is the drift and whose height is the offset plus the smallest delay. The line is the edge of
their lower convex hull below the mean device time: of all lines under the points it is the one with the smallest sum of
distances, and late arrivals do not move it (Moon, Skelly and Towsley, "Estimation and removal of clock skew from
network delay measurements", IEEE INFOCOM 1999). What one direction cannot see, its smallest delay, is halved with the
help of the other one: the device says when it got a command, the host knows when it sent it.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import pairwise

WRAP_US = 1 << 32
MICRO = 1000  # ns
SECOND = 1_000_000_000  # ns


@dataclass(frozen=True)
class ClockSettings:
    """How the clock is estimated.

    Attributes
    ----------
    bin_ns : of each bin only the earliest arrival (relative to device time) is kept
    bins : length of the window, bins
    drift_after_ns : no drift is estimated from less than this; a stall of 1 ms in 1 s would look like 1000 ppm
    drift_limit : largest believable drift; crystals stay within 1e-4, ceramic resonators within 5e-3
    correction_limit_ns : half a round trip above this is not believed to be symmetric
    late_ns : longest that a frame is held up on its way, for telling a clock that runs on from one that began anew
    """

    bin_ns: int = SECOND // 10
    bins: int = 100
    drift_after_ns: int = 2 * SECOND
    drift_limit: float = 5e-3
    correction_limit_ns: int = 5_000_000
    late_ns: int = 2 * SECOND


class DeviceClock:
    """Running estimate of host time over device time. Host times are monotonic, ns."""

    def __init__(self, settings: ClockSettings | None = None) -> None:
        self.settings = settings or ClockSettings()
        self.reset()

    def reset(self) -> None:
        """Forget everything: the device was reset or another one was plugged in."""
        self.drift = 0.0
        self.samples = 0
        self._raw_us = 0
        self._device_ns = 0
        self._arrival_ns = 0
        self._origin_ns = 0
        self._offset_ns = 0.0
        self._reference_ns = 0
        self._correction_ns = 0.0
        self._bin = 0
        self._low: tuple[int, int] = (0, 0)
        self._lows: deque[tuple[int, int]] = deque(maxlen=self.settings.bins)
        self._receipts: deque[tuple[int, int]] = deque(maxlen=2 * self.settings.bins)

    @property
    def settled(self) -> bool:
        """Whether five bins are complete, so that one late start no longer shows."""
        return len(self._lows) >= 5

    @property
    def correction_ns(self) -> float:
        """Half the smallest round trip, taken off the uplink's envelope."""
        return self._correction_ns

    def add(self, device_us: int, arrival_ns: int) -> int:
        """Take one arrival; returns the device time without wraps, ns since the first sample.

        Parameters
        ----------
        device_us : the 32-bit counter as it came
        arrival_ns : when the frame was complete at the host
        """
        if self.samples == 0:
            self._raw_us, self._arrival_ns, self._origin_ns = device_us, arrival_ns, arrival_ns
            self._low = (0, arrival_ns)
            self._offset_ns = float(arrival_ns)
        device = self._unwrapped(device_us, arrival_ns)
        self.samples += 1
        self._raw_us, self._device_ns, self._arrival_ns = device_us, device, arrival_ns
        self._note(device, arrival_ns - device)
        return device

    def runs_on(self, device_us: int, now_ns: int) -> bool:
        """Whether a device time that was read about ``now_ns`` continues this clock, or the device has started anew.

        A clock that was set to zero looks like a wrap: 71 minutes that have not passed here.
        """
        ahead = self._unwrapped(device_us, now_ns) - self._device_ns - (now_ns - self._arrival_ns)
        return bool(self.samples) and abs(ahead) <= self.settings.late_ns

    def add_receipt(self, device_us: int, sent_ns: int) -> None:
        """The device got at ``device_us`` a command that the host had sent at ``sent_ns``."""
        if self.samples:
            behind = (self._raw_us - device_us + WRAP_US // 2) % WRAP_US - WRAP_US // 2
            device = self._device_ns - behind * MICRO
            self._receipts.append((device, sent_ns - device))

    def host_ns(self, device_ns: int) -> int:
        """Host time of an unwrapped device time."""
        estimate = self._offset_ns + self.drift * (device_ns - self._reference_ns)
        return device_ns + round(estimate - self._correction_ns)

    def _unwrapped(self, device_us: int, arrival_ns: int) -> int:
        """Continue the count; whole wraps that passed in silence are told by the host's clock."""
        step = (device_us - self._raw_us) % WRAP_US * MICRO
        silent = (arrival_ns - self._arrival_ns - step) / (WRAP_US * MICRO)
        return self._device_ns + step + max(0, round(silent)) * WRAP_US * MICRO

    def _note(self, device: int, difference: int) -> None:
        number = device // self.settings.bin_ns
        if number == self._bin:
            if difference < self._low[1]:
                self._low = (device, difference)
                self._lower_envelope_at_once(device, difference)
            return
        self._lows.append(self._low)
        self._bin, self._low = number, (device, difference)
        self._refit()

    def _lower_envelope_at_once(self, device: int, difference: int) -> None:
        """An arrival below the line proves the line too high: no need to wait for the bin's end."""
        if difference < self._offset_ns + self.drift * (device - self._reference_ns):
            self._offset_ns, self._reference_ns = float(difference), device

    def _refit(self) -> None:
        points = list(self._lows)
        if points[-1][0] - points[0][0] < self.settings.drift_after_ns:
            self.drift = 0.0
            self._reference_ns, self._offset_ns = points[-1][0], float(min(d for _, d in points))
        else:
            start, slope = _edge_below_mean(points)
            limit = self.settings.drift_limit
            self.drift = min(max(slope, -limit), limit)
            self._reference_ns, self._offset_ns = start[0], float(start[1])
        self._correct()

    def _correct(self) -> None:
        """Half the gap between the uplink's lower envelope and the downlink's upper one."""
        oldest = self._lows[0][0]
        gaps = [
            self._offset_ns + self.drift * (device - self._reference_ns) - difference
            for device, difference in self._receipts
            if device >= oldest
        ]
        # A negative gap would be a command that came before it was sent: a receipt noted late. It says nothing.
        believable = [gap for gap in gaps if gap >= 0.0]
        if believable:
            self._correction_ns = min(0.5 * min(believable), self.settings.correction_limit_ns)


def _edge_below_mean(points: list[tuple[int, int]]) -> tuple[tuple[int, int], float]:
    """The lower hull's edge below the mean abscissa: its left end and its slope. ``points`` ascend in abscissa."""
    hull: list[tuple[int, int]] = []
    for point in points:
        while len(hull) >= 2 and _is_above(hull[-2], hull[-1], point):
            hull.pop()
        hull.append(point)
    mean = sum(x for x, _ in points) / len(points)
    for left, right in pairwise(hull):
        if right[0] >= mean:
            return left, (right[1] - left[1]) / (right[0] - left[0])
    return hull[-1], 0.0


def _is_above(a: tuple[int, int], b: tuple[int, int], c: tuple[int, int]) -> bool:
    """Whether b lies on or above the line from a to c."""
    return (b[1] - a[1]) * (c[0] - a[0]) >= (c[1] - a[1]) * (b[0] - a[0])
