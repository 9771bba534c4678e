# SPDX-License-Identifier: Apache-2.0
"""A calibration line from measured points, as Appendix C made its own: repeated readings averaged, then regressed."""

from __future__ import annotations

import csv
import math
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.daq.calibration import SENSORS, SensorCalibration, units_of
from pneumo_ros.errors import InputError

MIN_POINTS = 4  # distinct references: a line takes two degrees of freedom, its interval needs some left
CONFIDENCE = 0.95
SPREAD = 20.0  # voltage span of the points against the scatter of repeated readings, at least
REVERSAL = 3.0  # standard errors by which neighbouring mean voltages may run against the trend


@dataclass(frozen=True)
class Points:
    """Measured points of one channel.

    Attributes
    ----------
    channel : one of SENSORS
    unit : of the references
    reference : (N,) ascending, distinct
    volts : (N,) mean reading at each
    repeats : (N,) readings averaged
    scatter : standard deviation of single readings about their mean, V; 0 if nothing was repeated
    """

    channel: str
    unit: str
    reference: NDArray[np.float64]
    volts: NDArray[np.float64]
    repeats: NDArray[np.int64]
    scatter: float


@dataclass(frozen=True)
class Fit:
    """Result of the regression reference = gain * volt + offset.

    ``gain_half`` and ``offset_half`` are half widths of the 95 % intervals; ``residuals`` (N,) and ``rms`` are in the
    unit of the references, ``rms`` with N - 2 degrees of freedom.
    """

    points: Points
    gain: float
    offset: float
    gain_half: float
    offset_half: float
    residuals: NDArray[np.float64]
    rms: float

    @property
    def nonlinearity(self) -> float:
        """Largest residual as a share of the span of the references."""
        return float(np.max(np.abs(self.residuals)) / np.ptp(self.points.reference))

    def calibration(self, date: str, source: str) -> SensorCalibration:
        """The line as a calibration entry."""
        return SensorCalibration(
            self.gain, self.offset, self.points.unit, 0.0, date, self.rms, self.gain_half, source
        )  # fmt: skip


def read_points(path: str | Path) -> list[Points]:
    """Read a CSV with the columns ``channel``, ``reference``, ``unit`` and ``volts``, a row a reading.

    Raises
    ------
    InputError
        naming file, line and what is wrong.
    """
    source = Path(path)
    try:
        with source.open(newline="", encoding="utf-8") as handle:
            rows = list(csv.DictReader(handle))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"cannot read the points ({error})", where=source, remedy="give a readable CSV file"
        ) from error
    wanted = ("channel", "reference", "unit", "volts")
    if not rows or not set(wanted) <= set(rows[0]):
        raise InputError(
            "not a table of points", where=source, allowed=f"a header {','.join(wanted)} and rows below it"
        )
    readings: dict[tuple[str, str], dict[float, list[float]]] = defaultdict(lambda: defaultdict(list))
    for line, row in enumerate(rows, start=2):
        place = f"{source}, line {line}"
        channel, unit = _channel(row["channel"], row["unit"], place)
        readings[channel, unit][_number(row["reference"], "reference", place)].append(
            _number(row["volts"], "volts", place)
        )
    channels = [channel for channel, _ in readings]
    for channel in channels:
        if channels.count(channel) > 1:
            raise InputError("one channel in two units", where=source, key=channel, remedy="use one unit a channel")
    return [_averaged(channel, unit, groups) for (channel, unit), groups in readings.items()]


def fit_points(points: Points, where: object = None) -> Fit:
    """The line through averaged points.

    Raises
    ------
    InputError
        for too few points, no spread or readings that do not run one way, saying which.
    """
    from scipy import stats  # here: a second of imports that a missing file need not wait for

    _refuse_bad(points, where)
    line = stats.linregress(points.volts, points.reference)
    freedom = len(points.volts) - 2
    t = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, freedom))
    residuals = points.reference - (line.slope * points.volts + line.intercept)
    rms = math.sqrt(float(residuals @ residuals) / freedom)
    return Fit(
        points, float(line.slope), float(line.intercept), t * float(line.stderr), t * float(line.intercept_stderr),
        residuals, rms,
    )  # fmt: skip


def _refuse_bad(points: Points, where: object) -> None:
    count, key = len(points.reference), points.channel
    if count < MIN_POINTS:
        raise InputError(
            "too few points for a line with an interval", where=where, key=key, value=count,
            allowed=f"at least {MIN_POINTS} different references", remedy="measure more",
        )  # fmt: skip
    span = float(np.ptp(points.volts))
    if span <= SPREAD * points.scatter or span == 0.0:
        raise InputError(
            f"no spread: the voltages span {span:.3g} V with a scatter of {points.scatter:.3g} V", where=where, key=key,
            allowed=f"a span of more than {SPREAD:g} times the scatter", remedy="use references further apart",
        )  # fmt: skip
    steps = np.diff(points.volts)
    errors = points.scatter * np.sqrt(1.0 / points.repeats[1:] + 1.0 / points.repeats[:-1])
    against = steps * -np.sign(points.volts[-1] - points.volts[0])
    worst = int(np.argmax(against - REVERSAL * errors))
    if against[worst] > REVERSAL * errors[worst]:
        low, high = points.reference[worst], points.reference[worst + 1]
        raise InputError(
            f"not monotone: from {low:g} to {high:g} {points.unit} the voltage runs back by {against[worst]:.3g} V",
            where=where, key=key, remedy="check the wiring, the sensor's range and the typed values",
        )  # fmt: skip


def _averaged(channel: str, unit: str, groups: dict[float, list[float]]) -> Points:
    references = sorted(groups)
    repeats = np.array([len(groups[r]) for r in references])
    means = np.array([float(np.mean(groups[r])) for r in references])
    squares = sum(float(np.var(groups[r])) * len(groups[r]) for r in references)
    freedom = int(repeats.sum()) - len(references)
    scatter = math.sqrt(squares / freedom) if freedom else 0.0
    return Points(channel, unit, np.array(references), means, repeats, scatter)


def _channel(name: str | None, unit: str | None, place: str) -> tuple[str, str]:
    if name not in SENSORS:
        raise InputError("unknown channel", where=place, value=name, allowed=", ".join(SENSORS))
    if unit not in units_of(name):
        raise InputError("unknown unit", where=place, key=name, value=unit, allowed=", ".join(units_of(name)))
    return name, unit


def _number(text: str | None, key: str, place: str) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError("not a finite number", where=place, key=key, value=text, allowed="a finite number")
    return value
