# SPDX-License-Identifier: Apache-2.0
"""The limits table at work: a quantity outside its range for longer than its persistence becomes a finding."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pneumo_ros.daq.reasons import Finding, Level, Reason
from pneumo_ros.daq.safety_config import MEASURED, Limit

RATE_FILTER = 0.005  # s, first-order low-pass of the height rates: one noisy count must not look like motion
WARN_HOLD = 1.0  # s back inside before a warning ends; a quantity that hovers at its limit is one warning, not a flood


class LimitMonitor:
    """Watches the measured quantities of the safety configuration; call :meth:`step` with every valid sample."""

    def __init__(self, limits: Mapping[str, Limit]) -> None:
        self._limits = [limits[name] for name in MEASURED]
        self.reset()

    def reset(self) -> None:
        """Forget the past: after a gap in the samples."""
        self._outside = [0.0] * len(MEASURED)
        self._warned = [False] * len(MEASURED)
        self._inside = [0.0] * len(MEASURED)
        self._heights: tuple[float, float] | None = None
        self._rates = [0.0, 0.0]
        self.quantities: tuple[float, ...] = ()

    def step(self, values: Sequence[float], dt: float) -> list[Finding]:
        """Findings of one sample.

        Parameters
        ----------
        values : (7,) SI in the order of SENSORS
        dt : s since the sample before
        """
        self.quantities = self._quantities(values, dt)
        found: list[Finding] = []
        for index, (quantity, limit) in enumerate(zip(self.quantities, self._limits, strict=True)):
            if limit.warn_low <= quantity <= limit.warn_high and not self._warned[index]:
                self._outside[index] = 0.0
                continue
            self._judge(index, quantity, limit, dt, found)
        return found

    def _judge(self, index: int, quantity: float, limit: Limit, dt: float, found: list[Finding]) -> None:
        name = MEASURED[index]
        inside = limit.warn_low <= quantity <= limit.warn_high
        self._inside[index] = self._inside[index] + dt if inside else 0.0
        if (self._inside[index] >= WARN_HOLD) if self._warned[index] else not inside:
            self._warned[index] = not inside
            reason = Reason.LIMIT_CLEAR if inside else Reason.LIMIT_WARN
            text = f"{name} {quantity:.4g}, warning limits {limit.warn_low:.4g} to {limit.warn_high:.4g}"
            found.append(Finding(reason, name, text, Level.OK if inside else Level.WARN))
        if limit.trip_low <= quantity <= limit.trip_high:
            self._outside[index] = 0.0
            return
        self._outside[index] += dt
        if self._outside[index] >= limit.persistence:
            text = f"{name} {quantity:.4g} outside {limit.trip_low:.4g} to {limit.trip_high:.4g}"
            found.append(Finding(Reason.LIMIT_TRIP, name, text, Level.ERROR, limit.estop))

    def _quantities(self, values: Sequence[float], dt: float) -> tuple[float, ...]:
        front, rear = values[0] - values[2], values[1] - values[3]
        if self._heights is not None and dt > 0.0:
            share = 1.0 / (RATE_FILTER + dt)
            self._rates[0] += (front - self._heights[0] - self._rates[0] * dt) * share
            self._rates[1] += (rear - self._heights[1] - self._rates[1] * dt) * share
        self._heights = (front, rear)
        return (front, rear, self._rates[0], self._rates[1], values[4], values[5], values[6])


def command_finding(areas: Sequence[float], limit: Limit) -> Finding | None:
    """Why a command must be refused: an area that is not finite or outside the valves' range (m2)."""
    if all(limit.trip_low <= area <= limit.trip_high for area in areas):  # a NaN compares false
        return None
    text = ", ".join(f"{area:.4g}" for area in areas)
    allowed = f"{limit.trip_low:.4g} to {limit.trip_high:.4g} m2"
    return Finding(Reason.COMMAND_INVALID, "command_area", f"areas {text} m2, allowed {allowed}", estop=limit.estop)
