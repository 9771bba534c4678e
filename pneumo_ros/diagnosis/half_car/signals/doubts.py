# SPDX-License-Identifier: Apache-2.0
"""Mistakes of whole topics that would otherwise look like an effect: gauge pressure, a clock set, a wrong unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.signals.types import BUSY, Limitation, TopicData
from pneumo_ros.errors import InputError
from pneumo_ros.plant.air_spring import effective_area, load_surface
from pneumo_ros.rig import Rig
from pneumo_ros.units import GRAVITY

ROAD_LIMIT: Final = 0.5  # m; the exciter moves by centimetres [physics]
# s by which a topic's delay may move against the others: a stalled recorder delays all alike [taste]
CLOCK_STEP: Final = 0.05
# Share of a sample's period by which a hardware log's stamps may be off before that is told: half a millisecond at 500
# Hz moves a wheel on a class D road by 0.05 mm, five times its sensor's noise [physics]
OFF_PACE: Final = 0.25
ONE_IN: Final = 0.01  # share of the openings whose delay is told [taste]
# Periods between openings, in the slowest of which the loop has fallen behind by a whole one [physics]
UNEVEN: Final = 2.0
MOVED: Final = 0.2  # openings for each sample from which a log is one of valves at work [taste]
PIECES: Final = 3  # the delay of the first third is compared with the last third's [numerics]
# Spring force over static load at the middle of a log that is right: an area or a load off by a tenth at both ends
# stays outside [physics]
CARRIED: Final = (0.9, 1.1)
# The same of gauge pressures read as absolute, at most: an atmosphere is 0.6 of the front and 0.3 of the rear gauge
# pressure, so that they carry about 0.56 and 0.77 [physics]
NOT_CARRIED: Final = 0.85


def check_road_unit(heights: Array, log: str) -> None:
    """Refuse a road (N, 2) that cannot be in metres."""
    largest = float(np.max(np.abs(heights)))
    if largest > ROAD_LIMIT:
        raise InputError(
            "road height not in metres", where=f"{log}, /road/profile", value=round(largest, 6),
            allowed=f"up to {ROAD_LIMIT} m", remedy="convert the log (mm or in to m)",
        )  # fmt: skip


def check_clocks(topics: Mapping[str, TopicData], log: str) -> list[Limitation]:
    """Refuse a log in which one topic's stamps moved against the others' while it ran; say which only came late.

    The delay from stamp to log time is compared between the first and the last third of each topic, relative to the
    middle of all topics, so that a recorder that stalls and a log that was written slowly do no harm. Where the stamps
    go on in even steps and it is the arrival that jumped, the messages were delayed on their way: their time is right.
    """
    moved = {topic: _delay_change(data) for topic, data in topics.items() if _judged(data)}
    if len(moved) < PIECES:
        return []
    common = float(np.median(list(moved.values())))
    late = {topic: change - common for topic, change in moved.items() if abs(change - common) > CLOCK_STEP}
    moved_clock = {topic: change for topic, change in late.items() if not _came_late(topics[topic])}
    if moved_clock:
        worst = max(moved_clock, key=lambda topic: abs(moved_clock[topic]))
        raise InputError(
            "the clock of some topics was set while the log ran, so the topics share no time base",
            where=f"{log}, {', '.join(sorted(moved_clock))}", value=f"{-moved_clock[worst]:.3g} s",
            remedy="cut the log before the jump, or record it again",
        )  # fmt: skip
    return [
        Limitation("delayed", f"{topic} arrived {abs(change):.3g} s {'later' if change > 0.0 else 'earlier'} towards "
                              "the end; its stamps are even, so they are used as they are.")
        for topic, change in late.items()
    ]  # fmt: skip


def check_pace(road: TopicData, measured: TopicData, applied: TopicData, log: str) -> list[Limitation]:
    """What is said of a hardware log whose stamps do not keep the board's pace: it samples evenly, the road begins with
    its first sample, and the openings come as evenly as the samples that they answer. A computer that was busy stamps
    late what it hears late, and what it sends reaches the board when the board's line gets to it.
    """
    steps = np.diff(measured.stamp)
    period = float(np.median(steps))
    found = []
    late = float(road.stamp[0] - measured.stamp[0])
    if late > OFF_PACE * period:
        text = (
            f"/road/profile begins {1e3 * late:.2g} ms after the rig's first sample, with which it is played: {BUSY}, "
            "and what is said of road and tyres may come from that. Record it again."
        )
        found.append(Limitation("road_late", text, (), 0.5))
    counted = np.concatenate([[0.0], np.cumsum(np.maximum(1.0, np.round(steps / period)))])
    even = np.polynomial.Polynomial.fit(counted, measured.stamp, 1)
    off = float(np.max(np.abs(measured.stamp - even(counted))))
    if off > OFF_PACE * period:
        text = (
            f"The stamps of {log} leave the board's even pace by up to {1e3 * off:.2g} ms: {BUSY} while it learnt the "
            "board's clock. Effects that are smaller than this delay are not told from it."
        )
        found.append(Limitation("off_pace", text, (), 0.8))
    return [*found, *_check_openings(applied, period, len(measured.stamp))]


def _check_openings(applied: TopicData, period: float, samples: int) -> list[Limitation]:
    openings = np.column_stack(list(applied.channels.values()))
    moved = np.any(np.diff(openings, axis=0) != 0.0, axis=1)
    if np.count_nonzero(moved) < MOVED * samples:
        return []
    slowest = float(np.quantile(np.diff(applied.stamp)[moved], 1.0 - ONE_IN))
    if slowest <= UNEVEN * period:
        return []
    text = (
        f"One opening in {1.0 / ONE_IN:.0f} went to the valves {1e3 * slowest:.2g} ms or more after the one before, "
        f"not {1e3 * period:.2g} ms: {BUSY}, and when the valves acted is not known to a sample. What is said of air "
        "and valves may come from that; record it again on a quiet computer."
    )
    return [Limitation("openings_uneven", text, (), 0.5)]


def _came_late(data: TopicData) -> bool:
    """Whether the delay changed by jumps of the arrival while the stamps went on evenly."""
    assert data.received is not None
    steps, arrivals = np.diff(data.stamp), np.diff(data.received)
    jumps = arrivals - steps
    at_arrival = (np.abs(jumps) > CLOCK_STEP / 5) & (np.abs(steps - np.median(steps)) < 0.5 * np.abs(jumps))
    return bool(abs(jumps[at_arrival].sum()) > 0.5 * abs(_delay_change(data)))


def _judged(data: TopicData) -> bool:
    return data.received is not None and len(data.stamp) >= 10 * PIECES


def _delay_change(data: TopicData) -> float:
    assert data.received is not None
    delay = data.received - data.stamp
    piece = len(delay) // PIECES
    return float(np.median(delay[-piece:]) - np.median(delay[:piece]))


def check_gauge(heights: Array, pressures: Array, rig: Rig, log: str) -> None:
    """Refuse pressures that carry the body only when they are read as gauge.

    Parameters
    ----------
    heights, pressures : (2,) medians of both springs, m and Pa; NaN where either was not measured
    """
    known = np.isfinite(heights + pressures)
    if known.any() and all(_reads_as_gauge(heights[k], pressures[k], rig, k) for k in np.flatnonzero(known).tolist()):
        raise InputError(
            "pressures look like gauge, not absolute: read as absolute they do not carry the body", where=log,
            value=", ".join(f"{p:.0f} Pa" for p in pressures[known]), remedy="add the ambient pressure to the log's",
        )  # fmt: skip


def _reads_as_gauge(height: float, pressure: float, rig: Rig, end: int) -> bool:
    a, b = rig.front_arm.value, rig.rear_arm.value
    load = rig.sprung_mass.value * GRAVITY * (b, a)[end] / (a + b)
    absolute, gauge = (_force(height, over, rig) / load for over in (pressure - rig.ambient_pressure.value, pressure))
    return absolute < NOT_CARRIED and CARRIED[0] < gauge < CARRIED[1]


def _force(height: float, gauge: float, rig: Rig) -> float:
    return gauge * rig.effective_area_scale.value * float(effective_area(height, gauge, load_surface()))
