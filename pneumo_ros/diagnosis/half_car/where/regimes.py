# SPDX-License-Identifier: Apache-2.0
"""When the gap shows: by velocity, opening, flow direction, height, contact, time, frequency and harmonic."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.diagnosis.half_car.where.design import Design
from pneumo_ros.diagnosis.half_car.where.features import End
from pneumo_ros.diagnosis.half_car.where.weak import EQUATIONS, UNITS

BANDS: Final = (0.0, 1.0, 4.0, 7.0, 12.0, 25.0, 60.0)  # Hz: drift, body, between, wheel hop, above [physics]
LIGHT: Final = 0.3  # share of the mean tyre load below which contact is light [taste]
MIN_WINDOWS: Final = 8  # windows of a regime at least [numerics]
PERIODIC: Final = 0.9  # share of the road's power in one line and its neighbours from which it is one sine [taste]

# Equation in which a place's fault shows most sharply, and its end (None: take the equation with the largest
# residual) [definition]
SHOWS_IN: Final = {
    "front_force": "front_axle", "rear_force": "rear_axle", "front_air": "front_air", "rear_air": "rear_air",
    "front_tyre": "front_axle", "rear_tyre": "rear_axle", "body_heave": "heave", "body_pitch": "pitch",
    "road_input": "front_axle", "supply": "front_air",
}  # fmt: skip


@dataclass(frozen=True)
class Regime:
    """What an equation misses in one regime.

    Attributes
    ----------
    equation, unit : whose residual
    kind, label : for example "velocity" and "fast compression"
    time_share, gap_share : of the windows, and of the squared residual, that fall into the regime
    mean : mean residual in ``unit``
    level : rms residual in null standard deviations
    """

    equation: str
    unit: str
    kind: str
    label: str
    time_share: float
    gap_share: float
    mean: float
    level: float

    @property
    def concentration(self) -> float:
        """How much more of the gap than of the time falls into the regime."""
        return self.gap_share / max(self.time_share, 1e-9)


@dataclass(frozen=True)
class Harmonics:
    """Amplitudes of an error at multiples of a periodic excitation, per channel unit.

    Attributes
    ----------
    frequency : of the excitation, Hz
    amplitudes : (M, C) at 1, 2, ... M times it
    odd, even : rms of the odd multiples above one, and of the even ones, over that of the first; all channels
        normalised
    """

    frequency: float
    amplitudes: Array
    odd: float
    even: float


def regimes(design: Design, residual: Array, equation: str) -> list[Regime]:
    """Split one equation's residual by what the rig was doing.

    Parameters
    ----------
    design : the log's problem (windows, features, weights)
    residual : (K, 6) in null standard deviations, refitted or corrected
    equation : one of :data:`~pneumo_ros.diagnosis.half_car.where.weak.EQUATIONS`
    """
    e = EQUATIONS.index(equation)
    real = design.weight[:, e] > 0
    series, null = residual[:, e], design.null[e]
    total = float((series[real] ** 2).sum()) or 1.0
    out = []
    for kind, label, mask in _masks(design, e):
        inside = mask & real
        if np.count_nonzero(inside) < MIN_WINDOWS:
            continue
        part = series[inside]
        shares = (float(inside.sum() / real.sum()), float((part**2).sum() / total))
        mean, level = float(part.mean() * null), float(np.sqrt(np.mean(part**2)))
        out.append(Regime(equation, UNITS[e], kind, label, *shares, mean, level))
    return out


def sharpest(found: list[Regime]) -> Regime | None:
    """The regime that holds most of the gap in the least of the time; None if it is spread evenly."""
    telling = [r for r in found if r.gap_share > 0.5 and r.concentration > 1.5]
    # When it happened says less than what the rig did: a sweep turns any dependence on frequency into one on time.
    return max(telling, key=lambda r: (r.kind != "time", r.gap_share * r.concentration), default=None)


def shows_in(place: str, residual: Array, weight: Array) -> str:
    """The equation that shows a place's fault; for sensors the one with the largest residual (K, 6)."""
    if place in SHOWS_IN:
        return SHOWS_IN[place]
    return EQUATIONS[int(np.argmax((weight * residual**2).sum(axis=0)))]


def _masks(design: Design, e: int) -> Iterator[tuple[str, str, Mask]]:
    at, features = design.windows.centres, design.features
    ends = features.ends if e < 2 else (features.ends[e % 2],)
    end = ends[0]
    speed = np.mean([one.travel_rate[at] for one in ends], axis=0)
    fast = np.abs(speed) > np.median(np.abs(speed))
    yield "velocity", "fast compression", fast & (speed < 0)
    yield "velocity", "slow compression", ~fast & (speed < 0)
    yield "velocity", "slow extension", ~fast & (speed >= 0)
    yield "velocity", "fast extension", fast & (speed >= 0)
    yield "velocity", "fast motion", fast
    yield "velocity", "slow motion", ~fast
    yield from _thirds("height", ("spring short", "spring at middle height", "spring long"), end.travel[at])
    yield from _thirds("opening", ("inlet nearly closed", "inlet half open", "inlet wide open"), end.inlet[at])
    yield from _flow_masks(end, at)
    yield from _contact_masks(end, at)
    yield from _thirds("time", ("first third", "second third", "last third"), at.astype(float))


def _thirds(kind: str, labels: tuple[str, str, str], values: Array) -> Iterator[tuple[str, str, Mask]]:
    if np.ptp(values) <= 0.0:
        return
    low, high = np.quantile(values, [1 / 3, 2 / 3])
    yield kind, labels[0], values <= low
    yield kind, labels[1], (values > low) & (values <= high)
    yield kind, labels[2], values > high


def _flow_masks(end: End, at: NDArray[np.intp]) -> Iterator[tuple[str, str, Mask]]:
    net = (end.inlet * end.per_inlet - end.outlet * end.per_outlet)[at]
    yield "flow", "filling", net > 0
    yield "flow", "venting", net <= 0


def _contact_masks(end: End, at: NDArray[np.intp]) -> Iterator[tuple[str, str, Mask]]:
    load = end.squeeze[at] / end.squeeze.mean()
    yield "contact", "tyre nearly off the ground", load < LIGHT
    yield "contact", "tyre loaded", load >= LIGHT


def bands(error: Array, period: float) -> list[tuple[float, float, float]]:
    """(low, high, share) of the squared error (N, C), channels already normalised, by frequency band in Hz."""
    window = np.hanning(len(error))[:, None]
    power = np.abs(np.fft.rfft((error - error.mean(axis=0)) * window, axis=0)) ** 2
    frequency = np.fft.rfftfreq(len(error), period)
    total = float(power.sum()) or 1.0
    edges = [edge for edge in BANDS if edge < 0.5 / period]
    uppers = [*edges[1:], 0.5 / period + 1.0]
    return [
        (low, min(high, 0.5 / period), float(power[(frequency >= low) & (frequency < high)].sum()) / total)
        for low, high in zip(edges, uppers, strict=True)
    ]


def over_time(error: Array, period: float, block: float = 1.0) -> Array:
    """Rms of an error (N, C) in consecutive blocks of ``block`` seconds, (M,)."""
    rows = max(1, round(block / period))
    count = len(error) // rows
    return np.asarray(np.sqrt((error[: count * rows] ** 2).reshape(count, -1).mean(axis=1)))


def harmonics(road: Array, error: Array, period: float, orders: int = 6) -> Harmonics | None:
    """Odd and even harmonics of an error (N, C) where the road (N, 2) is one sine; None if it is not.

    Odd harmonics point to symmetric laws (friction, end stops both ways), even ones to one-sided laws (lift-off, check
    valves, a stop on one side).
    """
    line = _line(road[:, 0] + road[:, 1], period)
    if line is None:
        return None
    t = np.arange(len(error)) * period
    angles = 2.0 * np.pi * line * np.outer(t, np.arange(1, orders + 1))
    basis = np.column_stack([np.ones_like(t), np.cos(angles), np.sin(angles)])
    fitted = np.linalg.lstsq(basis, error, rcond=None)[0]
    amplitudes = np.hypot(fitted[1 : orders + 1], fitted[orders + 1 :])
    size = amplitudes / np.maximum(error.std(axis=0), 1e-12)
    first = float(np.sqrt((size[0] ** 2).sum())) or 1.0
    odd, even = (float(np.sqrt((size[k::2] ** 2).sum())) / first for k in (2, 1))
    return Harmonics(line, amplitudes, odd, even)


def _line(road: Array, period: float) -> float | None:
    window = np.hanning(len(road))
    power = np.abs(np.fft.rfft((road - road.mean()) * window)) ** 2
    peak = int(np.argmax(power))
    near = power[max(peak - 2, 0) : peak + 3].sum()
    if peak < 3 or power.sum() <= 0.0 or near < PERIODIC * power.sum():
        return None
    around = np.log(np.maximum(power[peak - 1 : peak + 2], 1e-300))
    shift = 0.5 * (around[0] - around[2]) / (around[0] - 2.0 * around[1] + around[2])
    return float((peak + shift) / (len(road) * period))
