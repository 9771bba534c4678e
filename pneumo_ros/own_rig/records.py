# SPDX-License-Identifier: Apache-2.0
"""Any log on one time base: a record that the diagnosis can fit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.diagnosis.fit.pace import Pace, pace_of_signals
from pneumo_ros.diagnosis.signals.noise import white_noise
from pneumo_ros.diagnosis.signals.types import Limitation, TopicTiming
from pneumo_ros.errors import InputError
from pneumo_ros.own_rig.clocks import on_one_clock
from pneumo_ros.own_rig.description import Description, SignalSpec
from pneumo_ros.own_rig.tables import Sampled, sampled

COARSE = 1e-9  # of an interval, to which a time must be told
LARGEST = 1e100  # beyond it squares are no numbers
FEWEST = 40  # rows below which nothing can be said
MOST = 400_000
GAP = 2.5  # median intervals that interpolation bridges
SLOWER = 1.5  # of the base's interval: a channel that is sampled no faster counts where it was sampled only
MISSING = 0.5  # share of rows without a sample of a channel that is too much
SHARP = 8.0  # standard errors by which the slope must change where a rig begins to move
FIRST = (5, 41)  # rows that a first value is fitted to
WINDOWS = 7  # lengths tried between them


@dataclass(frozen=True)
class OwnRecord:
    """A log of one's own rig, N rows, SI.

    Attributes
    ----------
    name, rig_name : of the log and of the rig
    names : of the channels
    period : s between rows
    measured, weight : (N, C); weight 1 where a real sample stands behind the value
    inputs : (N, U); linear between rows, or held
    noise : (C,)
    slow_noise : (C,) part of it that wanders: what is stated beyond the white noise that the data show
    since : s from the beginning of its log to row 0
    pace : lengths, of the whole log
    model_form : share of each channel's std that the maker holds the model form to be worth
    """

    name: str
    rig_name: str
    names: tuple[str, ...]
    period: float
    measured: Array
    weight: Array
    inputs: Array
    noise: Array
    slow_noise: Array
    since: float
    pace: Pace
    model_form: float = 0.0
    topics: tuple[TopicTiming, ...] = ()
    limitations: tuple[Limitation, ...] = ()

    @property
    def time(self) -> Array:
        """(N,) s from row 0."""
        return np.asarray(np.arange(len(self.measured)) * self.period, dtype=float)

    @property
    def usable(self) -> Mask:
        """(C,) channels that carry anything."""
        return np.asarray(self.weight.any(axis=0))

    @property
    def scale(self) -> Array:
        """(C,) standard deviation over the real samples."""
        total = np.maximum(self.weight.sum(axis=0), 1.0)
        mean = (self.weight * self.measured).sum(axis=0) / total
        std = np.sqrt((self.weight * (self.measured - mean) ** 2).sum(axis=0) / total)
        return np.where(std > 0.0, std, np.maximum(self.noise, 1e-12))

    @property
    def blocked(self) -> bool:
        """Whether a limitation forbids a verdict."""
        return any(one.cap <= 0.0 for one in self.limitations)

    def slice(self, first: int, last: int) -> OwnRecord:
        """Rows ``first`` to ``last`` (excluded)."""
        rows = slice(first, last)
        return replace(self, measured=self.measured[rows], weight=self.weight[rows], inputs=self.inputs[rows],
                       since=self.since + first * self.period)  # fmt: skip


def read_record(path: Path, rig: Description) -> OwnRecord:
    """Read a log as a rig file describes it.

    Raises
    ------
    InputError
        saying in one line what cannot be used.
    """
    clean = {spec.name: _clean(sampled(path, spec, rig), path, spec) for spec in _logged(rig)}
    held, limitations = on_one_clock(clean, {spec.name: spec.topic for spec in _logged(rig)}, path)
    for spec in (*rig.channels.values(), *rig.inputs.values()):
        if spec.rate_of:
            held[spec.name] = _rate(held[_source(spec, held, rig)])
    base = _base(path, rig, held)
    columns = [_on(base, held[name], spec.noise) for name, spec in rig.channels.items()]
    measured, weight = (np.column_stack([c[k] for c in columns]) for k in (0, 1))
    inputs = [_driven(base, held[name], spec.hold) for name, spec in rig.inputs.items()]
    period = float(base[1] - base[0])
    noises = [_noise(spec, held[name].values, path) for name, spec in rig.channels.items()]
    noise, slow = (np.array([one[k] for one in noises]) for k in (0, 1))
    _check_moves(path, rig, measured, weight)
    whole = np.column_stack(inputs) if inputs else np.zeros((len(base), 0))
    return OwnRecord(path.name if path.is_dir() else path.stem, rig.name, tuple(rig.channels), period, measured, weight,
                     whole, noise, slow, 0.0, pace_of_signals(measured, period, noise), rig.model_form,
                     tuple(_timing(name, held[name], base[0]) for name in rig.channels), limitations)  # fmt: skip


def _logged(rig: Description) -> list[SignalSpec]:
    return [spec for spec in (*rig.channels.values(), *rig.inputs.values()) if not spec.rate_of]


def _source(spec: SignalSpec, held: dict[str, Sampled], rig: Description) -> str:
    if spec.rate_of not in held:
        raise InputError("the rate of a signal that is not there", where=rig.path, key=spec.name, value=spec.rate_of,
                         allowed=", ".join(held))  # fmt: skip
    return spec.rate_of


def _clean(one: Sampled, path: Path, spec: SignalSpec) -> Sampled:
    """Samples that are numbers, their times increasing."""
    numbers = np.isfinite(one.time)
    if len(numbers) and not numbers.any():
        raise InputError("too few samples whose time is a number", where=path, key="time", value=0,
                         allowed="seconds, or dates such as 2026-03-01 10:15:30.25")  # fmt: skip
    kept = numbers & np.isfinite(one.values)
    if np.count_nonzero(kept) < FEWEST:
        raise InputError("too few samples that are numbers", where=path, key=spec.name,
                         value=f"{np.count_nonzero(kept)} of {len(kept)} rows", allowed=f"at least {FEWEST}",
                         remedy="record longer, or check the field")  # fmt: skip
    if np.max(np.abs(one.values[kept])) > LARGEST:
        raise InputError("a value beyond any measurement", where=path, key=spec.name,
                         value=float(np.max(np.abs(one.values[kept]))), allowed=f"up to {LARGEST:g}")  # fmt: skip
    time, values = one.time[kept], one.values[kept]
    received = None if one.received is None else one.received[kept]
    later = np.concatenate([[True], np.diff(np.maximum.accumulate(time)) > 0.0])
    if np.count_nonzero(~later) > MISSING * len(time):
        raise InputError("the time does not increase", where=path, key=spec.name, remedy="check the time's field")
    return Sampled(time[later], values[later], None if received is None else received[later])


def _base(path: Path, rig: Description, held: dict[str, Sampled]) -> Array:
    """Uniform times of the rows: of the fastest channel, where every signal is there."""
    intervals = {name: _interval(held[name].time) for name in rig.channels}
    period = min(intervals.values())
    first = max(one.time[0] for one in held.values()) + rig.start
    last = min(one.time[-1] for one in held.values()) - rig.end
    if rig.start_when:
        first = max(first, begins(held[rig.start_when], rig.channels[rig.start_when].noise))
    rows = int(np.floor((last - first) / period * (1.0 + 1e-9))) + 1
    if rows < FEWEST:
        raise InputError("too few rows in which every signal is there", where=path, value=max(rows, 0),
                         allowed=f"at least {FEWEST}", remedy="check start, end and the signals' times")  # fmt: skip
    if rows > MOST:
        raise InputError("too many rows", where=path, value=rows, allowed=f"up to {MOST}", remedy="cut the log")
    return np.asarray(first + period * np.arange(rows))


def _interval(time: Array) -> float:
    """Median interval, s; of times since 1970, whose steps are told to 0.2 us only, as the whole log has it."""
    median, told = float(np.median(np.diff(time))), float(np.spacing(np.abs(time).max()))
    mean = float(time[-1] - time[0]) / (len(time) - 1)
    return mean if told > COARSE * median and abs(mean - median) <= told else median


def begins(one: Sampled, noise: float | None) -> float:
    """When a signal that has rested begins to move: where its slope changes abruptly; its first time if nowhere.

    Slopes before and after each row are fitted over a fiftieth of the log; the change must be :data:`SHARP` standard
    errors, in the first half, with no motion before it.
    """
    t, y = one.time, one.values
    width = max(10, len(t) // 50)
    if len(t) < 6 * width:
        return float(t[0])
    sigma = noise or max(white_noise(y, np.ones_like(y)), 1e-12)
    k = np.arange(width) - 0.5 * (width - 1)
    slope = np.convolve(y, k[::-1], mode="valid") / float(k @ k)  # of rows i to i + width
    error = sigma / np.sqrt(float(k @ k))
    change = np.abs(slope[width:] - slope[:-width]) / (np.sqrt(2.0) * error)
    moved = np.flatnonzero(np.abs(slope) > 0.5 * SHARP * error)
    if change[: len(t) // 2].max() < SHARP or not len(moved) or moved[0] == 0:
        return float(t[0])
    still = y[: moved[0] + width // 2]
    level, spread = float(np.median(still)), max(sigma, float(np.std(still[: max(5, len(still) // 2)])))
    away = np.flatnonzero(np.abs(y - level) > 6.0 * spread)
    return float(t[away[0]]) if len(away) and away[0] < len(t) // 2 else float(t[0])


def _on(base: Array, one: Sampled, noise: float | None) -> tuple[Array, Array]:
    """Values on the base, and where a real sample stands behind them."""
    period, own = float(base[1] - base[0]), float(np.median(np.diff(one.time)))
    values = np.interp(base, one.time, one.values)
    after = np.clip(np.searchsorted(one.time, base - 1e-6 * period, side="left"), 1, len(one.time) - 1)
    gap = one.time[after] - one.time[after - 1]
    if own <= SLOWER * period:
        there = (gap <= GAP * own) | (np.abs(one.time[after] - base) < 0.5 * period)
        return np.asarray(values), np.asarray(there, dtype=float)
    nearest = np.where(base - one.time[after - 1] < one.time[after] - base, after - 1, after)
    there = np.abs(one.time[nearest] - base) <= 0.5 * period
    return np.where(there, one.values[nearest], values), there.astype(float)


def _driven(base: Array, one: Sampled, hold: bool) -> Array:
    if not hold:
        return np.asarray(np.interp(base, one.time, one.values))
    return np.asarray(one.values[np.clip(np.searchsorted(one.time, base, side="right") - 1, 0, len(one.time) - 1)])


def _noise(spec: SignalSpec, values: Array, path: Path) -> tuple[float, float]:
    """Standard deviation of a channel's noise, and of the part of it that wanders."""
    white = white_noise(values, np.ones_like(values))
    found = white if spec.noise is None else spec.noise
    if not np.isfinite(found):
        raise InputError("the noise cannot be told from the data", where=path, key=spec.name,
                         remedy="state it: noise: 0.002 mm")  # fmt: skip
    slow = np.sqrt(max(found**2 - white**2, 0.0)) if np.isfinite(white) else 0.0
    return max(float(found), 1e-6 * float(np.std(values)), 1e-15), float(slow)


def _check_moves(path: Path, rig: Description, measured: Array, weight: Array) -> None:
    for k, name in enumerate(rig.channels):
        if np.mean(weight[:, k]) < 1.0 - MISSING and np.count_nonzero(weight[:, k]) < FEWEST:
            raise InputError("too few samples", where=path, key=name, value=int(weight[:, k].sum()),
                             allowed=f"at least {FEWEST}")  # fmt: skip
        if float(np.ptp(measured[:, k])) == 0.0:
            raise InputError("the channel does not move", where=path, key=name, value=float(measured[0, k]),
                             remedy="check its field, or leave it out")  # fmt: skip


def _rate(one: Sampled) -> Sampled:
    """Rate of change of a signal, smoothed as far as its noise asks for."""
    period = float(np.median(np.diff(one.time)))
    time = one.time[0] + period * np.arange(int((one.time[-1] - one.time[0]) / period) + 1)
    values = np.interp(time, one.time, one.values)
    rate = savgol_filter(values, smoothing(values), 3, deriv=1, delta=period)
    return Sampled(np.asarray(time), np.asarray(rate))


def smoothing(values: Array) -> int:
    """Rows of the longest cubic smoothing whose residual is still the noise's."""
    sigma = white_noise(values, np.ones_like(values))
    best = 5
    for width in (7, 9, 13, 17, 23, 31, 41, 55, 73):
        if width > len(values) // 4 or not np.isfinite(sigma):
            break
        left = values - savgol_filter(values, width, 3)
        if float(np.sqrt(np.mean(left**2))) > 1.15 * sigma:
            break
        best = width
    return best


def _timing(name: str, one: Sampled, start: float) -> TopicTiming:
    steps = np.diff(one.time)
    median = float(np.median(steps))
    missing = int(np.sum(np.maximum(np.round(steps / median) - 1.0, 0.0)))
    jitter = 1.4826 * float(np.median(np.abs(steps - median)))
    first, last = float(one.time[0] - start), float(one.time[-1] - start)
    return TopicTiming(
        name, len(one.time), 1.0 / median, first, last, jitter, missing, float(steps.max()), float("nan")
    )


def first_values(record: OwnRecord, column: Array, noise: float) -> tuple[Array, Array]:
    """Value and rate of a column (N,) at row 0 with their standard deviations: a parabola through the first rows.

    Through how many is what the data say: few rows leave the noise, many bend more than a parabola. The window is the
    one whose rate has the least of both; the bend is what a cubic says instead.
    """
    most = min(int(np.clip(round(record.pace.settle / record.period), *FIRST)), len(column))
    steps = np.abs(np.diff(column[:most]))
    noise = max(noise, float(np.min(steps, where=steps > 0.0, initial=np.inf)) / np.sqrt(12.0) if steps.any() else 0.0)
    sizes = np.unique(np.geomspace(min(FIRST[0], most), most, WINDOWS).round().astype(int))
    bends, windows = np.zeros(2), []
    for rows in sizes:
        with np.errstate(over="ignore", invalid="ignore"):  # what a wild sensor error makes of a log
            found, white, bend, doubt = _at_first_row(column[:rows], noise, record.period)
            # The longest may agree by chance: what bent less rows beyond their noise counts.
            bends = np.maximum(bends, np.maximum(bend - 2.0 * doubt, 0.0))
            windows.append((found, np.hypot(white, np.maximum(bends, bend))))
    return min(windows, key=lambda window: float(window[1][1]))


def _at_first_row(rows: Array, noise: float, period: float) -> tuple[Array, Array, Array, Array]:
    """Value and rate at the first of some rows, their standard deviations, how far a cubic differs, and the standard
    deviation of that.
    """
    plain, apart, misfit, spare = _polynomials(len(rows))
    scale = np.array([1.0, 1.0 / max((len(rows) - 1) * period, 1e-12)])
    noise = max(noise, float(np.sqrt(np.sum((misfit @ rows) ** 2) / spare)))
    white, doubt = (noise * np.sqrt(np.sum(one**2, axis=1)) * scale for one in (plain, apart))
    return plain @ rows * scale, white, np.abs(apart @ rows) * scale, doubt


@lru_cache(maxsize=64)
def _polynomials(rows: int) -> tuple[Array, Array, Array, int]:
    """Of a parabola through so many rows, as matrices: value and rate over the whole length at the first row (2, rows),
    how far those of a cubic differ, and what it leaves (rows, rows); and how many rows are more than it needs.
    """
    degree = min(2, rows - 2)
    A = np.vander(np.linspace(0.0, 1.0, rows), degree + 2, increasing=True)
    plain, cubic = np.linalg.pinv(A[:, :-1]), np.linalg.pinv(A)
    misfit = np.asarray(np.eye(rows) - A[:, :-1] @ plain)
    return np.asarray(plain[:2]), np.asarray(cubic[:2] - plain[:2]), misfit, max(rows - degree - 1, 1)
