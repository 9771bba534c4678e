# SPDX-License-Identifier: Apache-2.0
"""Topics whose clocks differ: offset and drift between them, from when the recorder received their messages.

A message is not received before it is sent, and some of any dozen come through without delay: the least of (received
minus stamped) over a stretch of the log is what the recorder's clock is ahead of the topic's, and a constant delay. Two
topics' difference of that is the difference of their clocks, free of the recorder's stalls, and a line through it is
offset and drift. A constant delay cannot be told from an offset: what either topic's delay could be is left as it was
stamped.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.signals.types import Limitation
from pneumo_ros.errors import InputError
from pneumo_ros.own_rig.tables import Sampled

STRETCHES, FEWEST = 20, 5  # of a log, each with its least delay
SAME = 0.02  # s that delays of two topics may differ by
WAIT = 0.5  # s that a message may be on its way on every occasion
HALF = 0.5  # of the fastest topic's interval: what is closer than that is the same instant
MOST = 90.0  # % of the stretches that lie within the scatter: something may be late in the others
CLEAR = 3.0  # scatters that a drift must make over the log


@dataclass(frozen=True)
class Apart:
    """How far a topic's clock is from another's.

    Attributes
    ----------
    offset, drift : s at ``start`` of the topic's own clock, and s/s, to be added to its times
    scatter : s about that line
    delays : s, least delays of the two topics
    """

    start: float
    offset: float
    drift: float
    scatter: float
    delays: tuple[float, float]


def apart(first: Sampled, other: Sampled) -> Apart | None:
    """How far the clock of ``other`` is from that of ``first``; None where they were not received at the same time."""
    assert first.received is not None and other.received is not None
    begin, end = (max(first.received[0], other.received[0]), min(first.received[-1], other.received[-1]))
    edges = np.linspace(begin, end, STRETCHES + 1)
    rows = [(a, b) for a, b in zip(_least(first, edges), _least(other, edges), strict=True) if a and b]
    if begin >= end or len(rows) < FEWEST:
        return None
    at = np.array([b[0] for _, b in rows]) - other.time[0]
    delays = np.array([(a[1], b[1]) for a, b in rows])
    gap = delays[:, 1] - delays[:, 0]
    slopes = [(q - p) / (t - s) for (s, p), (t, q) in combinations(zip(at, gap, strict=True), 2) if t > s]
    drift = float(np.median(slopes)) if slopes else 0.0
    offset = float(np.median(gap - drift * at))
    scatter = float(np.percentile(np.abs(gap - offset - drift * at), MOST))
    low = np.min(delays, axis=0)
    return Apart(float(other.time[0]), offset, drift, scatter, (float(low[0]), float(low[1])))


def _least(one: Sampled, edges: Array) -> list[tuple[float, float] | None]:
    """Stamp and delay of the message with the least delay in each stretch."""
    assert one.received is not None
    delay, ends = one.received - one.time, np.searchsorted(one.received, edges)
    ends[-1] = len(delay)
    found: list[tuple[float, float] | None] = []
    for a, b in pairwise(ends):
        k = int(a + np.argmin(delay[a:b])) if b > a else -1
        found.append((float(one.time[k]), float(delay[k])) if k >= 0 else None)
    return found


def on_one_clock(
    signals: Mapping[str, Sampled], topics: Mapping[str, str], where: Path
) -> tuple[dict[str, Sampled], tuple[Limitation, ...]]:
    """Signals of a bag on the clock of the first one's topic.

    Parameters
    ----------
    signals : by name; those of tables have no time of receipt and stay
    topics : of each signal

    Returns
    -------
    The signals, and what is to be said of their clocks.

    Raises
    ------
    InputError
        where a clock differs by what matters, and by how much cannot be known.
    """
    held = {topics[name]: one for name, one in signals.items() if one.received is not None}
    if len(held) < 2:
        return dict(signals), ()
    first = next(iter(held))
    near = HALF * min(float(np.median(np.diff(one.time))) for one in signals.values())
    found = {topic: apart(held[first], one) for topic, one in held.items() if topic != first}
    moves = {topic: _move(one, float(np.ptp(held[topic].time)), near, f"{where}, {topic}")
             for topic, one in found.items() if one is not None}  # fmt: skip
    out = {name: _moved(one, found.get(topics[name]), moves.get(topics[name])) for name, one in signals.items()}
    said = [_said(topic, first, one, moves[topic]) for topic, one in found.items() if one is not None]
    return out, tuple(Limitation("clock", text) for text in said if text)


def _move(one: Apart, span: float, near: float, where: str) -> tuple[float, float]:
    """Offset and drift to add to a topic's times; what does not matter, or may be a delay, is 0."""
    if one.scatter > max(near, SAME):
        raise InputError("the topic's clock does not keep to the others', and by how much cannot be known", where=where,
                         value=f"uncertain by {one.scatter:.2g} s", allowed=f"within {max(near, SAME):.2g} s",
                         remedy="record with clocks that agree, or cut the log where a clock was set")  # fmt: skip
    middle = one.offset + 0.5 * one.drift * span
    drift = one.drift if abs(one.drift) * span > max(near, CLEAR * one.scatter) else 0.0
    differs = abs(middle) > SAME and not _delayed(one, near)
    return (middle if differs else 0.0) - 0.5 * drift * span, drift


def _delayed(one: Apart, near: float) -> bool:
    """Whether what the topics differ by may be a delay of their messages."""
    return all(-near <= delay <= WAIT for delay in one.delays)


def _moved(one: Sampled, found: Apart | None, move: tuple[float, float] | None) -> Sampled:
    if found is None or move is None or move == (0.0, 0.0):
        return one
    return replace(one, time=one.time + move[0] + move[1] * (one.time - found.start))


def _said(topic: str, first: str, one: Apart, move: tuple[float, float]) -> str:
    if move == (0.0, 0.0):
        late = one.delays[1] - one.delays[0]
        if abs(late) <= SAME:
            return ""
        when = "later" if late > 0.0 else "earlier"
        return (f"{topic} arrives {abs(late):.2g} s {when} after its stamps than {first}: taken for a delay on its "
                "way, its stamps for true")  # fmt: skip
    parts = [f"is {abs(move[0]):.3g} s {'behind' if move[0] > 0.0 else 'ahead'}"] if abs(move[0]) > SAME else []
    if move[1] != 0.0:
        parts.append(f"runs {1e6 * abs(move[1]):.3g} ppm {'slow' if move[1] > 0.0 else 'fast'}")
    return f"the clock of {topic} {' and '.join(parts)} against that of {first}: its times were moved by that"
