"""Two logs side by side: what was recorded, with which rig and parameters, and how far the signals differ."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.log.inspection import final_parameters
from pneumo_ros.log.reading import CONFIG_TOPIC, Log
from pneumo_ros.log.tables import Table, table

_KEYS = ("log_time_ns", "stamp_ns")


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
    common : messages at equal time since the logs' start
    largest : largest difference over those, NaN if there are none
    rms : rms difference over those
    """

    topic: str
    column: str
    mean: tuple[float, float]
    std: tuple[float, float]
    common: int
    largest: float
    rms: float


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
    """

    only_first: tuple[str, ...]
    only_second: tuple[str, ...]
    counts: dict[str, tuple[int, int]]
    identical: tuple[str, ...]
    settings: tuple[Difference, ...]
    signals: tuple[Signal, ...]


def compare(first: Log, second: Log) -> Comparison:
    """Compare two logs, each on its own time since its first message.

    Raises
    ------
    InputError
        if a topic does not decode.
    """
    shared = [name for name in first.topics if name in second.topics]
    return Comparison(
        only_first=tuple(name for name in first.topics if name not in second.topics),
        only_second=tuple(name for name in second.topics if name not in first.topics),
        counts={name: (first.topics[name].count, second.topics[name].count) for name in shared},
        identical=tuple(name for name in shared if same_payload(first, second, name)),
        settings=tuple(_settings(first, second)),
        signals=tuple(s for name in shared for s in _signals(first, second, name)),
    )


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
    for bulk in metadata:  # rosbag2's own description differs in every file and says nothing about the run
        bulk.pop("rosbag2.serialized_metadata", None)
    yield from _differences("metadata", *metadata)


def _rig(log: Log) -> dict[str, Any]:
    rig = log.config if CONFIG_TOPIC in log.topics else None
    if rig is None:
        return {}
    beyond = {"effects": "; ".join(rig.findings)} if rig.diagnosed else {}
    return {**{k: v["value"] if isinstance(v, dict) else v for k, v in rig.to_dict().items()}, **beyond}


def _differences(where: str, first: dict[str, Any], second: dict[str, Any]) -> Iterator[Difference]:
    for key in dict.fromkeys([*first, *second]):
        if first.get(key) != second.get(key):
            yield Difference(where, key, first.get(key), second.get(key))


def _signals(first: Log, second: Log, topic: str) -> Iterator[Signal]:
    infos = (first.topics[topic], second.topics[topic])
    if infos[0].type != infos[1].type or any(i.encoding != "cdr" or i.count < 2 for i in infos):
        return
    a, b = table(first, topic), table(second, topic)
    rows_a, rows_b = _common(a["stamp_ns"] - _start(first), b["stamp_ns"] - _start(second))
    for column in a:
        if column not in _KEYS and column in b and _numeric(a, column) and _numeric(b, column):
            yield _signal(topic, column, a[column], b[column], rows_a, rows_b)


def _signal(
    topic: str,
    column: str,
    a: NDArray[Any],
    b: NDArray[Any],
    rows_a: NDArray[np.intp],
    rows_b: NDArray[np.intp],
) -> Signal:
    gap = np.abs(a[rows_a].astype(float) - b[rows_b].astype(float))
    largest, rms = (float(gap.max()), float(np.sqrt(np.mean(gap**2)))) if len(gap) else (np.nan, np.nan)
    mean, std = (float(np.mean(a)), float(np.mean(b))), (float(np.std(a)), float(np.std(b)))
    return Signal(topic, column, mean, std, len(gap), largest, rms)


def _numeric(content: Table, column: str) -> bool:
    return content[column].dtype.kind in "biuf"


def _start(log: Log) -> int:
    """The first stamp of the periodic topics, ns: both logs start at 0 s."""
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
