# SPDX-License-Identifier: Apache-2.0
"""Signals from a log file of the contract, whoever wrote it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.diagnosis.half_car.signals.interruptions import LoggedEvent
from pneumo_ros.diagnosis.half_car.signals.prepare import APPLIED, DISPLACEMENT, PRESSURE, ROAD, VALVE, prepare
from pneumo_ros.diagnosis.half_car.signals.types import Signals
from pneumo_ros.diagnosis.signals.types import TopicData
from pneumo_ros.errors import InputError
from pneumo_ros.log.decoded import CONFIG_TOPIC, Log
from pneumo_ros.log.inspection import read_events
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.topics import EVENTS
from pneumo_ros.rig import Rig, parse_rig


def read_signals(path: str | Path, rig: Rig | None = None) -> Signals:
    """Read a log and bring it onto one time base; ``rig`` replaces the log's own config.

    Raises
    ------
    InputError
        if the file is not a readable log, or cannot be diagnosed at all (one line: what, where, remedy).
    """
    wanted = (ROAD, VALVE, APPLIED, DISPLACEMENT, *PRESSURE.values(), CONFIG_TOPIC, EVENTS.name)
    log = read_log(path, wanted)
    own = rig or own_rig(log)
    topics, origin = topics_of(log)
    return prepare(topics, own, Path(path).name, origin, events_of(log, origin))


def own_rig(log: Log) -> Rig:
    """The rig of the log's own config.

    Raises
    ------
    InputError
        if the log has none, or it changes during the log.
    """
    texts = log.texts(CONFIG_TOPIC) if CONFIG_TOPIC in log.topics else []
    if not texts:
        raise InputError(f"no {CONFIG_TOPIC} in the log", where=log.path, remedy="give the rig with --rig FILE.yaml")
    rigs = [parse_rig(text, f"{log.path}, {CONFIG_TOPIC}") for text in dict.fromkeys(texts)]
    if any(other != rigs[0] for other in rigs[1:]):
        raise InputError(
            "the config changes during the log: two rigs are mixed", where=log.path,
            remedy="cut the log, or give the rig with --rig FILE.yaml",
        )  # fmt: skip
    return rigs[0]


def topics_of(log: Log) -> tuple[dict[str, TopicData], float]:
    """The diagnosis's topics of a log, stamps in s from the returned origin (s since the epoch)."""
    joints = [topic for topic in (ROAD, VALVE, APPLIED, DISPLACEMENT) if _holds(log, topic)]
    scalars = [topic for topic in PRESSURE.values() if _holds(log, topic)]
    raw: dict[str, tuple[NDArray[np.int64], NDArray[np.int64], dict[str, NDArray[np.float64]]]] = {}
    for topic in joints:
        joint = log.joint(topic)
        columns = {name: joint.position[:, i].astype(float) for i, name in enumerate(joint.names)}
        raw[topic] = (joint.stamp_ns, joint.log_time_ns, columns)
    for topic in scalars:
        scalar = log.pressure(topic)
        raw[topic] = (scalar.stamp_ns, scalar.log_time_ns, {"pressure": scalar.value.astype(float)})
    origin = min((int(stamp[0]) for stamp, _, _ in raw.values()), default=0)
    topics = {
        topic: TopicData(_seconds(stamp, origin), columns, _seconds(received, origin))
        for topic, (stamp, received, columns) in raw.items()
    }
    return topics, origin * 1e-9


def events_of(log: Log, origin: float) -> list[LoggedEvent]:
    """The log's events, with times in s from ``origin`` (s since the epoch)."""
    return [LoggedEvent(e.stamp_ns * 1e-9 - origin, e.level, e.source, e.code) for e in read_events(log)]


def _seconds(stamp_ns: NDArray[np.int64], origin_ns: int) -> NDArray[np.float64]:
    return np.asarray((stamp_ns - origin_ns) * 1e-9, dtype=float)


def _holds(log: Log, topic: str) -> bool:
    return topic in log.topics and log.topics[topic].count > 0
