# SPDX-License-Identifier: Apache-2.0
"""Does a log keep the contract? One finding a line: what was looked at, whether it holds, and why not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.log.decoded import CONFIG_TOPIC, Log
from pneumo_ros.log.inspection import CONTRACT_TOPICS, Timing, measure_timing
from pneumo_ros.log.topics import JOINT, Topic
from pneumo_ros.rig import LIMITS, Rig, load_rig

Level = Literal["ok", "note", "warning", "error"]

# Physically possible ranges, wide enough for any rig of this kind: what lies outside is a wrong unit or a bad sensor.
_OUT_OF_ORDER = 0.1  # s; a safe command sent in between may carry a later stamp than the command that follows it
_HEIGHT = 0.5  # m; the springs work within 0.06 m
_LOWEST_PRESSURE = 50e3  # Pa absolute; a gauge reading in Pa of a slack spring would pass, one in psi or bar cannot
_SUPPLY_MARGIN = 1.5  # spring pressure over supply pressure
_AREA_MARGIN = 1.01  # commanded area over the valve's largest


@dataclass(frozen=True)
class Finding:
    """One line: level, what it is about, and the finding."""

    level: Level
    about: str
    text: str


def check_conformance(log: Log) -> list[Finding]:
    """Every line of the contract, kept or not.

    Returns
    -------
    findings in the contract's order; those of level ``error`` break it, a ``warning`` makes a verdict doubtful,
    a ``note`` is only unusual.
    """
    found = [*_container(log), *_config(log)]
    rig = _rig_or_nominal(log)
    for topic in CONTRACT_TOPICS:
        if topic.name not in log.topics:
            found.append(Finding("error", topic.name, "the topic is missing"))
        elif topic.name != CONFIG_TOPIC:
            found += _topic(log, topic, rig)
    extra = sorted(set(log.topics) - {t.name for t in CONTRACT_TOPICS})
    if extra:
        found.append(Finding("ok", "extra topics", ", ".join(extra)))
    return [*found, *_together(log)]


def breaks_contract(findings: list[Finding]) -> bool:
    """Whether one of them is an error."""
    return any(finding.level == "error" for finding in findings)


def _container(log: Log) -> Iterator[Finding]:
    yield Finding("ok", "profile", log.profile)
    for info in log.topics.values():
        if info.encoding != "cdr":
            yield Finding("warning", info.name, f"message encoding {info.encoding!r}, expected cdr")
        if info.schema_encoding not in ("ros2msg", ""):
            yield Finding("note", info.name, f"schema encoding {info.schema_encoding!r}, expected ros2msg")
    if log.unprotected:
        yield Finding("warning", "checksums", "some content carries no CRC: damage in it cannot be seen")
    else:
        yield Finding("ok", "checksums", "every chunk's CRC holds")


def _rig_or_nominal(log: Log) -> Rig:
    try:
        return log.config or load_rig()
    except InputError:
        return load_rig()


def _config(log: Log) -> Iterator[Finding]:
    if CONFIG_TOPIC not in log.topics:
        return
    try:
        texts = log.texts(CONFIG_TOPIC)
        rig = log.config
    except InputError as error:
        yield Finding("error", CONFIG_TOPIC, str(error))
        return
    if rig is None:
        yield Finding("error", CONFIG_TOPIC, "no message")
        return
    yield Finding("ok", CONFIG_TOPIC, f"rig {rig.name!r}, {len(LIMITS)} parameters")
    missing = list(rig.assumed)
    if missing:
        yield Finding("warning", CONFIG_TOPIC, f"leaves out {', '.join(missing)}: nominal values are taken")
    if len(set(texts)) > 1:
        yield Finding(
            "warning", CONFIG_TOPIC, f"{len(set(texts))} different configurations in one log; the last counts"
        )


def _topic(log: Log, topic: Topic, rig: Rig) -> Iterator[Finding]:
    info = log.topics[topic.name]
    if info.type != topic.type:
        yield Finding("error", topic.name, f"type {info.type}, expected {topic.type}")
        return
    if info.count < 2:
        yield Finding("error", topic.name, f"{info.count} messages")
        return
    try:
        stamps, logged, values = _values(log, topic)
    except InputError as error:
        yield Finding("error", topic.name, str(error))
        return
    faults = [*_values_sound(topic, values, rig), *_stamps_sound(stamps, logged)]
    for level, text in faults:
        yield Finding(level, topic.name, text)
    if not faults:
        timing = measure_timing(stamps, logged)
        yield Finding("ok", topic.name, f"{info.count} messages at {timing.rate_hz:.6g} Hz, {', '.join(topic.names)}")


def _values(log: Log, topic: Topic) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Stamps, log times and values (N, K) in the table's order."""
    if topic.type == JOINT:
        joint = log.select(topic.name, topic.names)
        return joint.stamp_ns, joint.log_time_ns, joint.position
    scalar = log.pressure(topic.name)
    return scalar.stamp_ns, scalar.log_time_ns, scalar.value[:, None]


def _values_sound(topic: Topic, values: NDArray[np.float64], rig: Rig) -> Iterator[tuple[Level, str]]:
    low, high, unit = _range(topic, rig)
    for column, name in zip(values.T, topic.names, strict=False):
        broken = np.flatnonzero(~np.isfinite(column))
        if len(broken):
            yield "error", f"{name}: {len(broken)} values are not finite, the first is message {broken[0]}"
        outside = np.flatnonzero((column < low) | (column > high))
        if len(outside):
            worst = column[outside[np.argmax(np.abs(column[outside]))]]
            yield (
                "error",
                (
                    f"{name}: {len(outside)} values outside {low:g} to {high:g} {unit}, first in message {outside[0]},"
                    f" the worst {worst:g}: wrong unit or broken sensor"
                ),
            )
        if len(column) > 100 and np.ptp(column) == 0.0 and topic is not topics.COMMAND:
            yield "warning", f"{name}: never changes from {column[0]:g} {unit}: stuck sensor or no excitation"


def _range(topic: Topic, rig: Rig) -> tuple[float, float, str]:
    if topic.type != JOINT:
        return _LOWEST_PRESSURE, rig.supply_pressure.value * _SUPPLY_MARGIN, "Pa absolute"
    if topic is topics.COMMAND:
        return 0.0, rig.inlet_area_max.value * _AREA_MARGIN, "m2"
    return -_HEIGHT, _HEIGHT, "m"


def _stamps_sound(stamps: NDArray[np.int64], logged: NDArray[np.int64]) -> Iterator[tuple[Level, str]]:
    timing: Timing = measure_timing(stamps, logged)
    if timing.backward:
        worst = float(-np.diff(stamps).min()) * 1e-9
        text = f"{timing.backward} stamps run backwards, by {worst:.4g} s at most"
        yield ("error" if worst > _OUT_OF_ORDER else "warning"), text
    if timing.repeated:
        yield "warning", f"{timing.repeated} stamps are equal to their predecessor"
    if timing.jumps:
        yield "warning", f"a clock was set {timing.jumps} times (delay changes by more than 0.1 s)"
    if timing.missing:
        yield "warning", timing.gaps_in_words


def _together(log: Log) -> Iterator[Finding]:
    """All measured topics must overlap in time."""
    names = [t.name for t in CONTRACT_TOPICS if t.name in log.topics and t.name != CONFIG_TOPIC]
    spans = []
    for name in names:
        if log.topics[name].count >= 2 and log.topics[name].encoding == "cdr":
            stamps, _ = log.stamps(name)
            spans.append((int(stamps.min()), int(stamps.max())))
    if len(spans) < 2:
        return
    overlap = (min(s[1] for s in spans) - max(s[0] for s in spans)) * 1e-9
    whole = (max(s[1] for s in spans) - min(s[0] for s in spans)) * 1e-9
    if overlap <= 0:
        yield Finding("error", "time base", "the topics do not overlap in time: different clocks?")
    elif overlap < 0.95 * whole:
        yield Finding("warning", "time base", f"all topics together cover {overlap:.4g} s of {whole:.4g} s")
    else:
        yield Finding("ok", "time base", f"all topics together cover {overlap:.4g} s")
