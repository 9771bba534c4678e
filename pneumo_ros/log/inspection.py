# SPDX-License-Identifier: Apache-2.0
"""What a log holds and how regular it is: rates, gaps, jitter, clock jumps, delays, and what explains the run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.documents import parse_yaml
from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.log.decoded import CONFIG_TOPIC, DIAGNOSTIC_ARRAY, Log
from pneumo_ros.rig import load_rig

SECOND = 1e9  # ns
GAP_FACTOR = 1.5  # a pause longer than this many periods is a gap: half way to one missed sample
JUMP = 0.1  # s; delays that change by more from one message to the next mean that a clock was set
_PERIODIC = 10  # fewer messages say nothing about a rate
PARAMETER_EVENT = "rcl_interfaces/msg/ParameterEvent"
_IRREGULAR = (DIAGNOSTIC_ARRAY, PARAMETER_EVENT)


@dataclass(frozen=True)
class Gap:
    """A pause in a topic: where it begins (stamp, ns), how long, s, and how many samples are missing in it."""

    start_ns: int
    length: float
    missing: int


@dataclass(frozen=True)
class Timing:
    """Regularity of one topic, from its stamps.

    Attributes
    ----------
    rate_hz : one over the median period
    period_p99, period_max : s
    jitter : 99th percentile of the period's distance from its median, s
    gaps : pauses longer than 1.5 periods, longest first
    missing : samples missing in all gaps
    backward : stamps before their predecessor
    repeated : stamps equal to their predecessor
    delay_p50, delay_p99, delay_max : log time less stamp, s; meaningless across unsynchronised clocks
    jumps : changes of that delay by more than 0.1 s between neighbours: a clock was set
    disordered : messages recorded before their predecessor
    """

    rate_hz: float
    period_p99: float
    period_max: float
    jitter: float
    gaps: tuple[Gap, ...]
    missing: int
    backward: int
    repeated: int
    delay_p50: float
    delay_p99: float
    delay_max: float
    jumps: int
    disordered: int

    @property
    def gaps_in_words(self) -> str:
        """``17 samples missing in 16 gaps, the longest 0.006 s``; '' where none is missing."""
        samples = f"{self.missing} sample" + ("s" if self.missing != 1 else "")
        return f"{samples} missing {self.where_missing}" if self.gaps else ""

    @property
    def where_missing(self) -> str:
        """``in 16 gaps, the longest 0.006 s``; '' where none is missing."""
        if not self.gaps:
            return ""
        gaps = f"{len(self.gaps)} gap" + ("s" if len(self.gaps) != 1 else "")
        return f"in {gaps}, the longest {self.gaps[0].length:.4g} s"


@dataclass(frozen=True)
class TopicReport:
    """One topic: how much, from when to when (stamps, ns), how regular (None for rare topics)."""

    name: str
    type: str
    count: int
    first_ns: int
    last_ns: int
    qos: str
    timing: Timing | None

    @property
    def duration(self) -> float:
        """From the first stamp to the last, s."""
        return (self.last_ns - self.first_ns) / SECOND


@dataclass(frozen=True)
class Event:
    """An entry of /rig/events: log time in ns, level, node, reason code, text, further values; header's instant, ns."""

    time_ns: int
    level: int
    source: str
    code: str
    message: str
    values: dict[str, str]
    stamp_ns: int = 0

    @property
    def is_trip(self) -> bool:
        """Whether something was stopped by it: an error or worse, by the levels of diagnostic_msgs."""
        return self.level >= 2


@dataclass(frozen=True)
class Setup:
    """Parameters a node ran with from this log time on, ns."""

    time_ns: int
    node: str
    parameters: dict[str, Any]


class Told(NamedTuple):
    """Settings for people: from which log time on, ns, of which node, whether it ``began`` with them, which."""

    time_ns: int
    node: str
    began: bool
    parameters: dict[str, Any]


def told_settings(setups: Sequence[Setup]) -> list[Told]:
    """All at the start, later only what changed; what every node began with alike stands once, as of ``every node``.

    A node's copy of the session's metadata (``session``) is left to the metadata.
    """
    began: dict[str, dict[str, Any]] = {}
    for setup in setups:
        began[setup.node] = setup.parameters | began.get(setup.node, {})
    first, *others = began.values() or ({},)
    shared = {k: v for k, v in first.items() if others and all(k in own and own[k] == v for own in others)}
    told = [Told(setups[0].time_ns, "every node", True, shared)] if shared else []
    known: dict[str, dict[str, Any]] = {node: dict(shared) for node in began}
    for setup in setups:
        own = known[setup.node]
        new = {k: v for k, v in setup.parameters.items() if k != "session" and (k not in own or own[k] != v)}
        if new:
            told.append(Told(setup.time_ns, setup.node, not own.keys() & new.keys(), new))
        own.update(new)
    return told


@dataclass(frozen=True)
class Report:
    """Everything ``pneumo log info`` shows."""

    path: str
    library: str
    unprotected: bool
    topics: tuple[TopicReport, ...]
    missing_topics: tuple[str, ...]
    rig: str | None
    changed_parameters: dict[str, tuple[float, float]]
    found_in_rig: tuple[str, ...]
    metadata: tuple[tuple[str, dict[str, str]], ...]
    setups: tuple[Setup, ...]
    calibrations: tuple[tuple[int, str], ...]
    events: tuple[Event, ...]
    attachments: tuple[tuple[str, int], ...]

    @property
    def count(self) -> int:
        """Messages in all."""
        return sum(t.count for t in self.topics)

    @property
    def start_ns(self) -> int:
        """The first stamp of any periodic topic, ns: every time that people read is told from there."""
        return min((t.first_ns for t in self.topics if t.timing is not None), default=0)

    @property
    def duration(self) -> float:
        """From the first stamp of any periodic topic to the last, s."""
        timed = [t for t in self.topics if t.timing is not None]
        return (max(t.last_ns for t in timed) - min(t.first_ns for t in timed)) / SECOND if timed else 0.0


CONTRACT_TOPICS = (
    topics.ROAD, topics.DISPLACEMENT, topics.FRONT_PRESSURE, topics.REAR_PRESSURE, topics.COMMAND, topics.CONFIG,
)  # fmt: skip
"""What any log of this rig carries."""


def inspect_log(log: Log) -> Report:
    """Look at every topic of a log.

    Raises
    ------
    InputError
        if a message does not decode as its type.
    """
    rig = log.config if CONFIG_TOPIC in log.topics else None
    return Report(
        path=str(log.path),
        library=log.library,
        unprotected=log.unprotected,
        topics=tuple(inspect_topic(log, name) for name in log.topics),
        missing_topics=tuple(t.name for t in CONTRACT_TOPICS if t.name not in log.topics),
        rig=rig.name if rig else None,
        changed_parameters=_changed(log),
        found_in_rig=log.config.findings if log.config is not None else (),
        metadata=tuple((m.name, dict(m.metadata)) for m in log.metadata),
        setups=tuple(read_setups(log)),
        calibrations=tuple(read_calibrations(log)),
        events=tuple(read_events(log)),
        attachments=tuple((a.name, len(a.data)) for a in log.attachments),
    )


def inspect_topic(log: Log, name: str) -> TopicReport:
    """One topic; topics that are not CDR are timed by their log times."""
    info = log.info(name)
    if info.encoding == "cdr" and info.count:
        stamps, logged = log.stamps(name)
    else:
        stamps = logged = log.records(name).log_time_ns
    # Events, health and parameters come from several nodes at once, openings when they change: no stamps of a rate.
    periodic = len(stamps) >= _PERIODIC and info.type not in _IRREGULAR and name != topics.APPLIED.name
    timing = measure_timing(stamps, logged, log.records(name).disordered) if periodic else None
    first, last = (int(stamps.min()), int(stamps.max())) if len(stamps) else (0, 0)
    return TopicReport(name, info.type, info.count, first, last, info.qos, timing)


def measure_timing(stamp_ns: NDArray[np.int64], log_time_ns: NDArray[np.int64], disordered: int = 0) -> Timing:
    """Regularity of a topic from its stamps and log times, each (N,), N >= 2."""
    periods = np.diff(stamp_ns) / SECOND
    forward = periods[periods > 0]
    median = float(np.median(forward)) if len(forward) else float("nan")
    at = np.flatnonzero(periods > GAP_FACTOR * median)
    gaps = [Gap(int(stamp_ns[i]), float(periods[i]), round(float(periods[i]) / median) - 1) for i in at]
    delay = (log_time_ns - stamp_ns) / SECOND
    p50, p99 = np.percentile(delay, [50, 99])
    return Timing(
        rate_hz=1.0 / median,
        period_p99=float(np.percentile(periods, 99)),
        period_max=float(periods.max()),
        jitter=float(np.percentile(np.abs(periods - median), 99)),
        gaps=tuple(sorted(gaps, key=lambda gap: -gap.length)),
        missing=sum(gap.missing for gap in gaps),
        backward=int(np.count_nonzero(periods < 0)),
        repeated=int(np.count_nonzero(periods == 0)),
        delay_p50=float(p50),
        delay_p99=float(p99),
        delay_max=float(delay.max()),
        jumps=int(np.count_nonzero(np.abs(np.diff(delay)) > JUMP)),
        disordered=disordered,
    )


def _changed(log: Log) -> dict[str, tuple[float, float]]:
    """Rig parameters that differ from the nominal ones: name -> (nominal, this log's)."""
    rig = log.config
    if rig is None:
        return {}
    ours, nominal = rig.to_dict(), load_rig().to_dict()
    pairs = {key: (nominal[key]["value"], ours[key]["value"]) for key in nominal if key != "name"}
    return {key: pair for key, pair in pairs.items() if pair[0] != pair[1]}


def read_setups(log: Log) -> Iterator[Setup]:
    """Parameters of the nodes at start and at each change, in log order; texts that are not such YAML are skipped."""
    if topics.SETUP.name not in log.topics or log.topics[topics.SETUP.name].type != topics.SETUP.type:
        return
    name = topics.SETUP.name
    for time_ns, message in log.messages(name):
        try:
            document = parse_yaml(message.data, name)
        except InputError:
            continue
        if isinstance(document, Mapping) and "node" in document:
            rest = {str(k): v for k, v in document.items() if k not in ("node", "time_ns", "parameters")}
            given = document.get("parameters")
            yield Setup(time_ns, str(document["node"]), {**(given if isinstance(given, Mapping) else {}), **rest})


def end_of_session(log: Log) -> tuple[bool, str]:
    """(whether the recorder calls the session complete, why not); a log of another recorder is."""
    ends = [dict(one.metadata) for one in log.metadata if one.name == "session" and "complete" in one.metadata]
    last = ends[-1] if ends else {"complete": "true"}
    return last["complete"] == "true", str(last.get("reason", ""))


def read_calibrations(log: Log) -> Iterator[tuple[int, str]]:
    """(log time in ns, YAML) of each calibration that was in force, in log order."""
    name = topics.CALIBRATION.name
    if name in log.topics and log.topics[name].type == topics.CALIBRATION.type:
        yield from ((time_ns, message.data) for time_ns, message in log.messages(name))


def read_events(log: Log) -> Iterator[Event]:
    """Entries of /rig/events in log order."""
    name = topics.EVENTS.name
    if name not in log.topics or log.topics[name].type != DIAGNOSTIC_ARRAY:
        return
    for time_ns, message in log.messages(name):
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            code = values.pop("code", "")
            yield Event(time_ns, int(status.level), status.name, code, status.message, values, stamp)


def seed_of(log: Log) -> dict[str, Any]:
    """Seeds by node, as the setups state them."""
    return {s.node: s.parameters["seed"] for s in read_setups(log) if "seed" in s.parameters}


def final_parameters(log: Log) -> dict[str, dict[str, Any]]:
    """The parameters each node ended with."""
    out: dict[str, dict[str, Any]] = {}
    for setup in read_setups(log):
        out.setdefault(setup.node, {}).update(setup.parameters)
    return out
