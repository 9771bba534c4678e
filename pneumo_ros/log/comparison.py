# SPDX-License-Identifier: Apache-2.0
"""Two logs side by side: what was recorded, with which rig and parameters, and how far the signals differ."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.log.decoded import CONFIG_TOPIC, Log
from pneumo_ros.log.inspection import final_parameters
from pneumo_ros.log.tables import Table, table
from pneumo_ros.log.topics import BY_NAME, ROAD, Topic

_KEYS = ("log_time_ns", "stamp_ns")
ROAD_STEP, MIN_ROAD = 2e-3, 100  # s and samples of a road that is compared
SAME_ROAD = 0.95  # correlation
# What every session has of its own, or says a second time: it differs in every log and tells nothing about the run.
OWN = ("session_id", "session", "output", "parameters")


@dataclass(frozen=True)
class Difference:
    """A setting that the logs do not share; None where a log does not have it."""

    where: str
    key: str
    first: Any
    second: Any


@dataclass(frozen=True)
class Signal:
    """One numeric column of both logs.

    Attributes
    ----------
    topic, column : what
    mean, std : of each log
    common : samples compared: those at equal times, or where hardly any are, all of the first log's in the overlap
    largest : largest difference over those, NaN if there are none
    rms : rms difference over those
    unit : of the column, where the table of topics states one
    """

    topic: str
    column: str
    mean: tuple[float, float]
    std: tuple[float, float]
    common: int
    largest: float
    rms: float
    unit: str = ""


@dataclass(frozen=True)
class Comparison:
    """Two logs side by side.

    Attributes
    ----------
    only_first, only_second : topics that one of them has
    counts : topic -> messages of each
    identical : topics whose serialised messages are equal, byte by byte
    settings : rig parameters, node parameters and metadata that differ
    signals : columns of the shared topics
    roads : "same", "two", or "" where a log has none that moves
    offset : s that the second log is shifted by, so that both meet the road at once
    """

    only_first: tuple[str, ...]
    only_second: tuple[str, ...]
    counts: dict[str, tuple[int, int]]
    identical: tuple[str, ...]
    settings: tuple[Difference, ...]
    signals: tuple[Signal, ...]
    roads: str = ""
    offset: float = 0.0


def compare(first: Log, second: Log) -> Comparison:
    """Compare two logs, each on its own time since its first sample, aligned by the road where it is the same.

    Raises
    ------
    InputError
        if a topic does not decode.
    """
    roads, offset = align(first, second)
    shared = [name for name in first.topics if name in second.topics]
    return Comparison(
        only_first=tuple(name for name in first.topics if name not in second.topics),
        only_second=tuple(name for name in second.topics if name not in first.topics),
        counts={name: (first.topics[name].count, second.topics[name].count) for name in shared},
        identical=tuple(name for name in shared if same_payload(first, second, name)),
        settings=tuple(_settings(first, second)),
        signals=tuple(s for name in shared for s in _signals(first, second, name, round(offset * 1e9))),
        roads=roads,
        offset=offset,
    )


def align(first: Log, second: Log) -> tuple[str, float]:
    """("same", "two" or "", s by which the second log is late) from the front road of both.

    A road is the same if, shifted to where both agree best, it correlates by :data:`SAME_ROAD`.
    """
    roads = [_road(log) for log in (first, second)]
    if any(len(road) < MIN_ROAD or np.std(road) == 0.0 for road in roads):
        return "", 0.0
    a, b = ((road - road.mean()) / np.std(road) for road in roads)
    size = 2 ** int(np.ceil(np.log2(len(a) + len(b))))
    agreement = np.fft.irfft(np.conj(np.fft.rfft(a, size)) * np.fft.rfft(b, size), size)
    lag = int(np.argmax(agreement))
    lag -= size if lag > size // 2 else 0
    overlap = min(len(a), len(b) - lag) - max(0, -lag)
    if agreement.max() < SAME_ROAD * max(overlap, 0.5 * min(len(a), len(b))):
        return "two", 0.0
    return "same", lag * ROAD_STEP


LONGEST_ROAD = 86400.0  # s; what claims to be longer is not laid over another


def _road(log: Log) -> NDArray[np.float64]:
    """The front road from the log's start on an even base of :data:`ROAD_STEP`."""
    if ROAD.name not in log.topics or log.topics[ROAD.name].count < MIN_ROAD:
        return np.empty(0)
    joint = log.select(ROAD.name, ["front"])
    time = (joint.stamp_ns - start_of(log)) * 1e-9
    if not 0.0 < time[-1] < LONGEST_ROAD:  # a stamp may say anything
        return np.empty(0)
    grid = np.arange(0.0, time[-1], ROAD_STEP)
    return np.asarray(np.interp(grid, time, np.nan_to_num(joint.position[:, 0])))


def same_payload(first: Log, second: Log, topic: str) -> bool:
    """Whether the serialised messages of a topic are equal, byte by byte (log times aside)."""
    a, b = first.records(topic), second.records(topic)
    return np.array_equal(a.offsets, b.offsets) and np.array_equal(a.data, b.data)


def _settings(first: Log, second: Log) -> Iterator[Difference]:
    yield from _differences("rig", _rig(first), _rig(second))
    ours, theirs = final_parameters(first), final_parameters(second)
    for node in sorted({*ours, *theirs}):
        yield from _differences(node, ours.get(node, {}), theirs.get(node, {}))
    metadata = [{f"{m.name}.{k}": v for m in log.metadata for k, v in m.metadata.items()} for log in (first, second)]
    for bulk in metadata:
        for name in ("rosbag2.serialized_metadata", *(f"pneumo_ros.{key}" for key in OWN)):
            bulk.pop(name, None)
    yield from _differences("metadata", *metadata)


def _rig(log: Log) -> dict[str, Any]:
    rig = log.config if CONFIG_TOPIC in log.topics else None
    if rig is None:
        return {}
    beyond = {"effects": "; ".join(rig.findings)} if rig.diagnosed else {}
    return {**{k: v["value"] if isinstance(v, dict) else v for k, v in rig.to_dict().items()}, **beyond}


def _differences(where: str, first: dict[str, Any], second: dict[str, Any]) -> Iterator[Difference]:
    for key in dict.fromkeys([*first, *second]):
        if key not in OWN and first.get(key) != second.get(key):
            yield Difference(where, key, first.get(key), second.get(key))


def _signals(first: Log, second: Log, topic: str, offset: int) -> Iterator[Signal]:
    infos = (first.topics[topic], second.topics[topic])
    if infos[0].type != infos[1].type or any(i.encoding != "cdr" or i.count < 2 for i in infos):
        return
    a, b = table(first, topic), table(second, topic)
    times = (a["stamp_ns"] - start_of(first), b["stamp_ns"] - start_of(second) - offset)
    known = BY_NAME.get(topic)
    for column in a:
        if column not in _KEYS and column in b and _numeric(a, column) and _numeric(b, column):
            yield _signal(topic, column, (a[column], b[column]), times, _unit(known, column))


def _unit(topic: Topic | None, column: str) -> str:
    name, _, kind = column.partition(".")
    units = dict(topic.fields) if topic is not None else {}
    unit = units.get(column) or units.get(kind) or units.get(name, "")
    return f"{unit}/s" if unit and "velocity" in column.split(".") else unit


@np.errstate(over="ignore", invalid="ignore")  # a log may hold any number, infinite ones too
def _signal(
    topic: str, column: str, values: tuple[NDArray[Any], NDArray[Any]], times: tuple[NDArray[Any], NDArray[Any]],
    unit: str,
) -> Signal:  # fmt: skip
    a, b = (np.asarray(one, dtype=float) for one in values)
    gap = _gap(a, b, *times)
    largest, rms = (float(gap.max()), float(np.sqrt(np.mean(gap**2)))) if len(gap) else (np.nan, np.nan)
    (mean_a, std_a), (mean_b, std_b) = _moments(a), _moments(b)
    return Signal(topic, column, (mean_a, mean_b), (std_a, std_b), len(gap), largest, rms, unit)


def _moments(values: NDArray[np.float64]) -> tuple[float, float]:
    there = values[np.isfinite(values)]
    return (float(np.mean(there)), float(np.std(there))) if len(there) else (float("nan"), float("nan"))


def _gap(a: NDArray[np.float64], b: NDArray[np.float64], at: NDArray[Any], bt: NDArray[Any]) -> NDArray[np.float64]:
    """Differences at equal times; where hardly any are equal, from the second log interpolated in the overlap."""
    rows_a, rows_b = _common(at, bt)
    if 2 * len(rows_a) >= min(len(a), len(b)):
        gap = np.abs(a[rows_a] - b[rows_b])
    else:
        inside = (at >= bt.min()) & (at <= bt.max())
        order = np.argsort(bt, kind="stable")
        gap = np.abs(a[inside] - np.interp(at[inside], bt[order], b[order]))
    return np.asarray(gap[np.isfinite(gap)])


def _numeric(content: Table, column: str) -> bool:
    return content[column].dtype.kind in "biuf"


def start_of(log: Log) -> int:
    """The first stamp of the periodic topics, ns: every log's time is told from there."""
    stamps = [
        int(log.columns(name).stamp_ns.min())
        for name, info in log.topics.items()
        if info.encoding == "cdr" and info.count >= 2 and "header.stamp.sec" in log.columns(name).arrays
    ]
    return min(stamps, default=0)


def _common(a: NDArray[np.int64], b: NDArray[np.int64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows of both that have equal times; the first of repeated times."""
    _, rows_a, rows_b = np.intersect1d(a, b, return_indices=True)
    return rows_a, rows_b
