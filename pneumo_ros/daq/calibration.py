# SPDX-License-Identifier: Apache-2.0
"""Volts to SI and back: the calibration of each sensor and valve, read from config/calibration/*.yaml.

A sensor's value is ``gain * volt + offset`` in its own unit (Appendix C's form), converted to SI by name and shifted by
``zero``. Gauge pressures become absolute with the ambient pressure of the session.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from pneumo_ros.rig.channels import CHANNELS
from pneumo_ros.units import INCH, PSI, SQUARE_INCH

SENSORS = (*CHANNELS, "supply_pressure")
LENGTH_UNITS = {"m": 1.0, "mm": 1e-3, "in": INCH}
GAUGE_UNITS = {"psig": PSI, "Pa_gauge": 1.0, "bar_gauge": 1e5}
ABSOLUTE_UNITS = {"Pa": 1.0, "bar": 1e5, "psia": PSI}
PRESSURE_UNITS = {**GAUGE_UNITS, **ABSOLUTE_UNITS}
AREA_UNITS = {"m2": 1.0, "mm2": 1e-6, "in2": SQUARE_INCH}
DEFAULT = "appendix_c"


def units_of(channel: str) -> dict[str, float]:
    """Units a sensor may be calibrated in, with their factor to SI."""
    return PRESSURE_UNITS if channel.endswith("pressure") else LENGTH_UNITS


@dataclass(frozen=True)
class SensorCalibration:
    """One sensor's straight line.

    Attributes
    ----------
    gain : unit per volt
    offset : unit, at 0 V
    unit : of the line; see :func:`units_of`
    zero : m or Pa, added after conversion (set at run time)
    date : ISO date of the measurement, None if unknown
    residual : rms of the fit, in ``unit``; None if unknown
    interval : half width of the 95 % interval of the gain, unit per volt; None if unknown
    source : where the line comes from
    """

    gain: float
    offset: float
    unit: str
    zero: float = 0.0
    date: str | None = None
    residual: float | None = None
    interval: float | None = None
    source: str = ""

    @property
    def factor(self) -> float:
        """``unit`` to SI."""
        return LENGTH_UNITS.get(self.unit) or PRESSURE_UNITS[self.unit]

    def line(self, ambient: float) -> tuple[float, float]:
        """(slope, intercept) of SI value over volts: m or Pa absolute; ``ambient`` in Pa."""
        base = ambient if self.unit in GAUGE_UNITS else 0.0
        return self.gain * self.factor, self.offset * self.factor + base + self.zero

    def value(self, volts: float, ambient: float) -> float:
        """SI value, m or Pa absolute, from volts; ``ambient`` in Pa."""
        slope, intercept = self.line(ambient)
        return slope * volts + intercept

    def volts(self, value: float, ambient: float) -> float:
        """Inverse of :meth:`value`."""
        slope, intercept = self.line(ambient)
        return (value - intercept) / slope


@dataclass(frozen=True)
class ValveCalibration:
    """One valve's straight line: area = gain * volt + offset in ``unit``."""

    gain: float
    offset: float
    unit: str
    source: str = ""

    def area(self, volts: float) -> float:
        """Orifice area, m2, never negative."""
        return max(0.0, (self.gain * volts + self.offset) * AREA_UNITS[self.unit])

    def volts(self, area: float) -> float:
        """Volts for an area, m2."""
        return (area / AREA_UNITS[self.unit] - self.offset) / self.gain


@dataclass(frozen=True)
class Calibration:
    """All sensors by :data:`SENSORS` name and all valves by :data:`~pneumo_ros.rig.channels.VALVES` name."""

    name: str
    sensors: Mapping[str, SensorCalibration]
    valves: Mapping[str, ValveCalibration]

    def zeroed(self, readings: Mapping[str, float], references: Mapping[str, float]) -> Calibration:
        """Shift each named sensor so that its mean reading becomes its reference, both m or Pa absolute."""
        sensors = dict(self.sensors)
        for channel, reference in references.items():
            old = sensors[channel]
            sensors[channel] = replace(old, zero=old.zero + reference - readings[channel])
        return replace(self, sensors=sensors)

    def spanned(
        self, channel: str, low: tuple[float, float], high: tuple[float, float], ambient: float, date: str
    ) -> Calibration:
        """The line through two (volts, SI reference) points, in the sensor's own unit; ``zero`` becomes 0.

        ``low`` and ``high`` must differ in volts; the caller sees to it that they differ enough.
        """
        old = self.sensors[channel]
        base = ambient if old.unit in GAUGE_UNITS else 0.0
        gain = (high[1] - low[1]) / (high[0] - low[0]) / old.factor
        offset = (low[1] - base) / old.factor - gain * low[0]
        line = replace(
            old, gain=gain, offset=offset, zero=0.0, date=date, residual=None, interval=None,
            source=f"two-point span, {low[1]:.6g} and {high[1]:.6g} (SI)",
        )  # fmt: skip
        return replace(self, sensors={**self.sensors, channel: line})
