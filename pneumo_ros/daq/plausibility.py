# SPDX-License-Identifier: Apache-2.0
"""Whether a sensor can be believed: rail, range, rate, stuck, and displacement against pressure.

A reading that fails is withheld from the first sample on; a channel that keeps failing becomes a finding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from pneumo_ros.daq.calibration import SENSORS
from pneumo_ros.daq.reasons import Finding, Reason
from pneumo_ros.daq.safety_config import Plausibility
from pneumo_ros.daq.scaling import InputScale
from pneumo_ros.plant.air_spring import AreaSurface, effective_area
from pneumo_ros.plant.half_car import BUMP_STOP_HEIGHT
from pneumo_ros.rig import Rig
from pneumo_ros.units import GRAVITY

DISPLACEMENTS = 4  # the first four of SENSORS
BALANCE_EVERY = 20  # samples between looks at the force balance, which changes slowly


def stuck_after(noise: float, count: float, probability: float) -> float:
    """Readings in a row that a healthy sensor repeats with less than ``probability``; infinite if it may well do so.

    Parameters
    ----------
    noise : standard deviation of the sensor's noise
    count : what one count is worth, same unit
    probability : of a false alarm in any one run
    """
    # The worst case is a constant signal in the middle of a count.
    same = math.erf(0.5 * count / (noise * math.sqrt(2.0))) if noise > 0.0 else 1.0
    return math.inf if same >= 1.0 else math.ceil(math.log(probability) / math.log(same)) + 1


class PlausibilityMonitor:
    """Judges each channel of each sample.

    Parameters
    ----------
    config : thresholds
    scale : of the board, which gives rails and the worth of a count
    rig : declared sensor noise, and the loads of the springs
    period : s between samples
    surface : effective area
    """

    def __init__(self, config: Plausibility, scale: InputScale, rig: Rig, period: float, surface: AreaSurface) -> None:
        self.config, self._scale, self._period = config, scale, period
        noises = [rig.displacement_noise.value] * DISPLACEMENTS + [rig.pressure_noise.value] * 3
        runs = [
            stuck_after(noise, abs(slope), config.stuck_probability)
            for noise, slope in zip(noises, scale.slopes, strict=True)
        ]
        self.stuck_runs = [run if run * period <= config.stuck_at_most else math.inf for run in runs]
        ranges = [config.displacement_range] * DISPLACEMENTS + [config.pressure_range] * 3
        rates = [config.displacement_rate] * DISPLACEMENTS + [config.pressure_rate] * 3
        self._bounds = [(*r, rate) for r, rate in zip(ranges, rates, strict=True)]
        self.balance = ForceBalance(rig, config.force_balance, config.force_balance_window, surface)
        self.reset()

    @property
    def unwatched(self) -> list[str]:
        """Channels on which a stuck sensor cannot be told in time."""
        return [name for name, run in zip(SENSORS, self.stuck_runs, strict=True) if math.isinf(run)]

    def reset(self) -> None:
        """Forget the past: after a gap in the samples."""
        self._last = [math.nan] * len(SENSORS)
        self._age = [0.0] * len(SENSORS)
        self._counts: list[int | None] = [None] * len(SENSORS)
        self._runs = [0] * len(SENSORS)
        self._bad = [0] * len(SENSORS)
        self._looks = 0
        self.balance.reset()

    def step(self, counts: Sequence[int], values: Sequence[float], dt: float) -> tuple[tuple[bool, ...], list[Finding]]:
        """(valid, findings) of one sample.

        Parameters
        ----------
        counts, values : (7,) raw and SI in the order of SENSORS
        dt : s since the sample before
        """
        found: list[Finding] = []
        valid = tuple([self._channel(i, counts[i], values[i], dt, found) for i in range(len(SENSORS))])
        self._looks += 1
        if self._looks % BALANCE_EVERY == 0 and all(valid):
            found += self.balance.step(values, BALANCE_EVERY * self._period)
        return valid, found

    def _channel(self, i: int, count: int, value: float, dt: float, found: list[Finding]) -> bool:
        self._age[i] += dt
        reason = self._doubt(i, count, value)
        if reason is None:
            self._last[i], self._age[i], self._bad[i] = value, 0.0, 0
            return True
        self._bad[i] += 1
        if reason is Reason.SENSOR_STUCK or self._bad[i] >= self.config.bad_samples:
            found.append(Finding(reason, SENSORS[i], f"{SENSORS[i]} reads {value:.5g} ({count} counts)"))
        return False

    def _doubt(self, i: int, count: int, value: float) -> Reason | None:
        self._runs[i] = self._runs[i] + 1 if count == self._counts[i] else 1
        self._counts[i] = count
        if not self._scale.low < count < self._scale.high:
            return Reason.SENSOR_RAIL
        low, high, rate = self._bounds[i]
        if not low <= value <= high:
            return Reason.SENSOR_RANGE
        if abs(value - self._last[i]) > rate * self._age[i]:  # false before the first value, which is NaN
            return Reason.SENSOR_RATE
        return Reason.SENSOR_STUCK if self._runs[i] >= self.stuck_runs[i] else None


class ForceBalance:
    """Displacement against pressure: over a second, each spring's mean force is the load it carries.

    The force follows from pressure and height through the effective area, the load from mass and arms. Over a window w
    the mean acceleration is the change of velocity over w, a few percent of g on this rig's roads. Not judged while a
    spring sits on its bump stop, which then carries part of the load.
    """

    def __init__(self, rig: Rig, tolerance: float, window: float, surface: AreaSurface) -> None:
        self._tolerance, self._window = tolerance, window
        self._surface = surface
        self._ambient, self._area_scale = rig.ambient_pressure.value, rig.effective_area_scale.value
        weight, base = rig.sprung_mass.value * GRAVITY, rig.wheelbase
        self._loads = (weight * rig.rear_arm.value / base, weight * rig.front_arm.value / base)
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self.ratios = [1.0, 1.0]
        self._seen = 0.0

    def step(self, values: Sequence[float], dt: float) -> list[Finding]:
        """Findings after ``dt`` s; ``values`` (7,) SI in the order of SENSORS."""
        heights = (values[0] - values[2], values[1] - values[3])
        if min(heights) <= BUMP_STOP_HEIGHT:
            self.reset()
            return []
        share = dt / (self._window + dt)
        for side, height in enumerate(heights):
            gauge = values[4 + side] - self._ambient
            force = gauge * self._area_scale * float(effective_area(height, gauge, self._surface))
            self.ratios[side] += (force / self._loads[side] - self.ratios[side]) * share
        self._seen += dt
        if self._seen < 2.0 * self._window:
            return []
        return [
            Finding(Reason.SENSOR_DISAGREE, f"{name}_spring", f"{name} spring force is {ratio:.0%} of its load")
            for name, ratio in zip(("front", "rear"), self.ratios, strict=True)
            if abs(ratio - 1.0) > self._tolerance
        ]
