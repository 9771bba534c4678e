# SPDX-License-Identifier: Apache-2.0
"""Stepped replay: recorded measurements through today's estimator and controller, compared with the recorded outputs.

Lossless and deterministic: every sample that the running node took is stepped once, in order, as fast as the machine
allows. With the code and parameters of the session the outputs are equal to the recorded ones byte by byte. With other
parameters it answers *what would have been commanded on these measurements*; the plant does not react to it. For an
answer with a plant that does, see :mod:`pneumo_ros.session.rerun`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.control.half_car import PARAMETERS as CONTROL_PARAMETERS
from pneumo_ros.control.half_car import PROFILE
from pneumo_ros.errors import InputError
from pneumo_ros.estimation.half_car import PARAMETERS as ESTIMATION_PARAMETERS
from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointEncoder
from pneumo_ros.log.decoded import Log
from pneumo_ros.log.inspection import Setup, read_setups
from pneumo_ros.log.records import Records
from pneumo_ros.log.topic_data import TopicInfo
from pneumo_ros.log.topics import Topic
from pneumo_ros.log.writing import interface
from pneumo_ros.parameters import Parameter, Value, settings
from pneumo_ros.rig import Rig, load_rig
from pneumo_ros.session.stages import ControllerStage, EstimatorStage, Progress, Stage, advance

TABLES: dict[str, tuple[Parameter, ...]] = {"estimator": ESTIMATION_PARAMETERS, "controller": CONTROL_PARAMETERS}
PATH = "valve_profile"  # the one parameter that names a file
ALIASES = {"lambda": "pole"}  # the thesis's letter for the triple pole
# A parameter change is logged when the recorder hears of it, a few samples off; within this the recorded outputs
# themselves show at which sample it took effect.
CHANGE_WINDOW_NS = 200_000_000
FASTEST = 1e5  # Hz
_DEFAULT_RATE = 500.0  # Hz

Overrides = Mapping[str, Mapping[str, Value]]
Build = Callable[[Mapping[str, Value]], Stage]


@dataclass(frozen=True)
class Track:
    """A topic's values by stamp: (N,) ns ascending, (N, K)."""

    stamp_ns: NDArray[np.int64]
    values: NDArray[np.float64]


@dataclass(frozen=True)
class Agreement:
    """A replayed topic against the recorded one.

    Attributes
    ----------
    topic : name
    compared : samples that both have
    equal : of these, messages equal byte by byte
    first_difference_ns : stamp of the first that is not, or None
    names, largest, rms : difference by channel, SI
    """

    topic: str
    compared: int
    equal: int
    first_difference_ns: int | None
    names: tuple[str, ...]
    largest: tuple[float, ...]
    rms: tuple[float, ...]

    @property
    def identical(self) -> bool:
        """Whether every compared message is equal byte by byte."""
        return self.compared > 0 and self.equal == self.compared


@dataclass(frozen=True)
class Replayed:
    """Outputs of a stepped replay.

    Attributes
    ----------
    estimate, command, sliding : replayed topics
    recorded : the recorded ones, by topic name, where the log has them
    agreements : each replayed topic against its recording
    parameters : node -> values at the start, with the changes of the caller
    overridden : what the caller changed
    samples : complete measurements in the log; ``skipped`` of them the running estimator never took
    notes : doubts, one line each
    """

    estimate: Track
    command: Track
    sliding: Track
    recorded: dict[str, Track]
    agreements: tuple[Agreement, ...]
    parameters: dict[str, dict[str, Value]]
    overridden: dict[str, dict[str, Value]]
    samples: int
    skipped: int
    notes: tuple[str, ...]


@dataclass
class Plan:
    """A node's parameters through the session: at the start, and changes with the time they were logged, ns."""

    start: dict[str, Value]
    changes: list[tuple[int, dict[str, Value]]] = field(default_factory=list)


def replay(
    log: Log, overrides: Overrides | None = None, rig: Rig | None = None, valves: Path | None = None
) -> Replayed:
    """Step a log's measurements through estimator and controller.

    Parameters
    ----------
    log : with /rig/displacement and both pressures
    overrides : node -> parameter -> value, over the recorded parameters for the whole session
    rig : that estimator and controller believe, in place of the log's
    valves : the profile that the session played, if it played one

    Raises
    ------
    InputError
        if the measurements are missing, or a parameter is unknown or out of range.
    """
    given = {node: dict(values) for node, values in (overrides or {}).items()}
    notes: list[str] = []
    setups = list(read_setups(log))
    rig, period = rig or log.config or load_rig(), control_period(log, setups, notes)
    plans = {node: plan(setups, node, given.get(node, {}), notes, valves) for node in TABLES}
    measured = measurements(log)
    recorded = {t.name: track(log, t) for t in (topics.ESTIMATE, topics.COMMAND, topics.SLIDING) if has(log, t)}
    taken = _only(measured, recorded.get(topics.ESTIMATE.name))
    # With other parameters the recorded outputs cannot show when a change took effect.
    period_ns = round(period * 1e9)
    estimates = None if given.get("estimator") else _payloads(log, topics.ESTIMATE)
    estimate, _ = _run(
        _build(EstimatorStage, rig, period), plans["estimator"], taken, estimates, topics.ESTIMATE, period_ns
    )
    heard = _only(estimate, recorded.get(topics.COMMAND.name))
    commands = None if given else _payloads(log, topics.COMMAND)
    build = _build(ControllerStage, rig, period)
    command, telemetry = _run(build, plans["controller"], heard, commands, topics.COMMAND, period_ns)
    sliding = _only(telemetry, recorded.get(topics.SLIDING.name))
    replayed = {topics.ESTIMATE: estimate, topics.COMMAND: command, topics.SLIDING: sliding}
    agreements = tuple(_agreement(log, topic, found) for topic, found in replayed.items() if topic.name in recorded)
    return Replayed(
        estimate, command, sliding, recorded, agreements,
        {node: p.start for node, p in plans.items()}, given,
        len(measured.stamp_ns), len(measured.stamp_ns) - len(taken.stamp_ns), tuple(notes),
    )  # fmt: skip


def warm_up(log: Log) -> None:
    """Load the compiled estimator and controller, so that a measured replay does not count it."""
    rig = log.config or load_rig()
    for stage in (EstimatorStage(rig, 1e-3, {}), ControllerStage(rig, 1e-3, {})):
        stage.warm_up()


def has(log: Log, topic: Topic) -> bool:
    """Whether the log holds messages of this topic."""
    info = log.topics.get(topic.name)
    return info is not None and info.count > 0 and info.type == topic.type


def track(log: Log, topic: Topic) -> Track:
    """A JointState topic's values in the table's order."""
    joint = log.select(topic.name, topic.names)
    return Track(joint.stamp_ns, joint.position)


def measurements(log: Log) -> Track:
    """Samples (N, 6) for which all three measured topics have a message, m and Pa."""
    displacement = track(log, topics.DISPLACEMENT)
    pressures = [log.pressure(t.name) for t in (topics.FRONT_PRESSURE, topics.REAR_PRESSURE)]
    common = displacement.stamp_ns
    for scalar in pressures:
        common = common[np.isin(common, scalar.stamp_ns)]
    if len(common) == 0:
        raise InputError(
            "no sample has both displacements and pressures at one stamp",
            where=log.path,
            remedy="replay needs measurements that were taken together",
        )
    columns = [_at(common, displacement.stamp_ns, displacement.values)]
    columns += [_at(common, scalar.stamp_ns, scalar.value[:, None]) for scalar in pressures]
    return Track(common, np.hstack(columns))


def control_period(log: Log, setups: Sequence[Setup], notes: list[str]) -> float:
    """The session's control period, s: from its parameters, else from the measurements' stamps."""
    for setup in setups:
        if setup.node in TABLES and "rate_hz" in setup.parameters:
            return round(1e9 / _rate(setup)) * 1e-9
    steps = np.diff(log.joint(topics.DISPLACEMENT.name).stamp_ns)
    period = float(np.median(steps)) * 1e-9 if len(steps) else 1.0 / _DEFAULT_RATE
    notes.append(f"the log does not state its control rate; {1.0 / period:.6g} Hz is taken from its stamps")
    return period


def _rate(setup: Setup) -> float:
    rate = setup.parameters["rate_hz"]
    if isinstance(rate, int | float) and FASTEST >= rate > 1.0 / FASTEST:
        return float(rate)
    raise InputError("no control rate", where=setup.node, key="rate_hz", value=rate, allowed=f"up to {FASTEST:g} Hz")


def plan(
    setups: Sequence[Setup],
    node: str,
    overrides: Mapping[str, Value],
    notes: list[str],
    valves: Path | None = None,
) -> Plan:
    """What a node ran with, ``overrides`` laid over it throughout; a file that a log names is never taken from it.

    Raises
    ------
    InputError
        if an override is unknown or out of range, or a file is wanted that was not given.
    """
    table = TABLES[node]
    names = {parameter.name for parameter in table}
    given = settings(table, {ALIASES.get(k, k): v for k, v in overrides.items()}, "--set " + node)
    wanted = {name: given[name] for name in (ALIASES.get(k, k) for k in overrides)}
    own = [s for s in setups if s.node == node and names & set(s.parameters)]
    if not own:
        notes.append(f"the log does not state the parameters of {node}; today's defaults are taken")
        return Plan(settings(table, wanted))
    if valves is not None and PATH in names:
        wanted.setdefault(PATH, str(valves))
    steps = [_checked(table, setup, wanted) for setup in own]
    found = Plan(steps[0])
    for setup, values in zip(own[1:], steps[1:], strict=True):
        before = found.changes[-1][1] if found.changes else found.start
        if values != before:
            found.changes.append((setup.time_ns, values))
    return found


def _checked(table: Sequence[Parameter], setup: Setup, wanted: Mapping[str, Value]) -> dict[str, Value]:
    names = {parameter.name for parameter in table} - {PATH}
    found = settings(table, {**{k: v for k, v in setup.parameters.items() if k in names}, **wanted}, setup.node)
    if found.get("controller") == PROFILE and not found.get(PATH):
        raise InputError("the session played a valve profile, and a path that a log names is never opened",
                         where=setup.node, key=PATH, value=setup.parameters.get(PATH),
                         remedy="give the file: --valves FILE.csv")  # fmt: skip
    return found


def _build(kind: Callable[..., Stage], rig: Rig, period: float) -> Build:
    return lambda values: kind(rig, period, values)


def _only(found: Track, recorded: Track | None) -> Track:
    """Samples at which the running node spoke; all where it was not recorded."""
    if recorded is None:
        return found
    rows = np.isin(found.stamp_ns, recorded.stamp_ns)
    return Track(found.stamp_ns[rows], found.values[rows])


def _at(wanted: NDArray[np.int64], stamps: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows of ``values`` at the wanted stamps, all of which occur; the first of repeated ones."""
    unique, first = np.unique(stamps, return_index=True)
    rows: NDArray[np.float64] = values[first[np.searchsorted(unique, wanted)]]
    return rows


def _payloads(log: Log, topic: Topic) -> dict[int, bytes] | None:
    """Serialised messages by stamp."""
    if not has(log, topic):
        return None
    records = log.records(topic.name)
    return {stamp: records.message(i) for i, stamp in enumerate(log.columns(topic.name).stamp_ns.tolist())}


def _run(
    build: Build, wanted: Plan, given: Track, recorded: Mapping[int, bytes] | None, topic: Topic, period_ns: int
) -> tuple[Track, Track]:
    """Step every sample; (values, telemetry)."""
    encode = JointEncoder(topic.frame_id, topic.names).encode
    stage, waiting = build(wanted.start), list(wanted.changes)
    values, telemetry = [], []
    progress: Progress | None = None
    for stamp, sample in zip(given.stamp_ns.tolist(), given.values, strict=True):
        after, output = advance(stage, progress, stamp, sample, period_ns)
        if waiting and stamp >= waiting[0][0] - CHANGE_WINDOW_NS:
            said = recorded.get(stamp) if recorded is not None else None
            late = stamp >= waiting[0][0] + (CHANGE_WINDOW_NS if recorded is not None else 0)
            if late or (said is not None and said != encode(stamp, output.values.tolist())):
                stage = build(waiting.pop(0)[1])
                after, output = advance(stage, progress, stamp, sample, period_ns)
        progress = after
        values.append(output.values)
        telemetry.append(output.telemetry)
    shape = (len(values), -1)
    return (
        Track(given.stamp_ns, np.array(values).reshape(shape)),
        Track(given.stamp_ns, np.array(telemetry).reshape(shape)),
    )


@np.errstate(over="ignore", invalid="ignore")  # a log may hold any number, infinite ones too
def _agreement(log: Log, topic: Topic, found: Track) -> Agreement:
    encode = JointEncoder(topic.frame_id, topic.names).encode
    recorded, payloads = track(log, topic), _payloads(log, topic) or {}
    rows = np.flatnonzero(np.isin(found.stamp_ns, recorded.stamp_ns))
    stamps = found.stamp_ns[rows]
    same = [payloads[s] == encode(s, found.values[i].tolist()) for s, i in zip(stamps.tolist(), rows, strict=True)]
    gap = np.abs(found.values[rows] - _at(stamps, recorded.stamp_ns, recorded.values))
    first = next((int(s) for s, equal in zip(stamps, same, strict=True) if not equal), None)
    largest, rms = (gap.max(0), np.sqrt((gap**2).mean(0))) if len(rows) else (np.zeros(0), np.zeros(0))
    return Agreement(topic.name, len(rows), sum(same), first, topic.names, tuple(largest.tolist()), tuple(rms.tolist()))


def replayed_log(log: Log, result: Replayed) -> Log:
    """The log with the replayed topics in place of the recorded ones (or added, where there were none)."""
    infos, records = dict(log.topics), {name: log.records(name) for name in log.topics}
    found = {topics.ESTIMATE: result.estimate, topics.COMMAND: result.command, topics.SLIDING: result.sliding}
    for topic, values in found.items():
        if topic.names and values.values.shape == (len(values.stamp_ns), len(topic.names)):
            infos[topic.name], records[topic.name] = _encoded(topic, values, log.topics.get(topic.name))
    return replace(log, topics=dict(sorted(infos.items())), _records=records, _columns={})


def _encoded(topic: Topic, found: Track, like: TopicInfo | None) -> tuple[TopicInfo, Records]:
    encode = JointEncoder(topic.frame_id, topic.names).encode
    messages = [encode(s, row.tolist()) for s, row in zip(found.stamp_ns.tolist(), found.values, strict=True)]
    definition, type_hash = interface(topic.type)
    offsets = np.cumsum([0, *(len(m) for m in messages)]).astype(np.int64)
    data = np.frombuffer(b"".join(messages), np.uint8)
    info = TopicInfo(
        topic.name, topic.type, len(messages), "cdr", "ros2msg", definition, like.qos if like else "", type_hash
    )
    count = np.arange(len(messages), dtype=np.int64)
    return info, Records(found.stamp_ns, found.stamp_ns, count, offsets, data)
