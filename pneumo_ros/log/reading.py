# SPDX-License-Identifier: Apache-2.0
"""Reading a session log into arrays: by topic and by channel name, whoever wrote it.

    log = read_log("run.mcap")
    road = log.joint("/road/profile")                    # stamps, names, positions (N, K)
    z = log.select("/rig/displacement", ["sprung_front", "sprung_rear"])
    front = log.pressure("/rig/front/pressure")
    rig = log.config

A log is an MCAP file or a bag folder (split files with metadata.yaml). Decoding is lazy and in
bulk: see :mod:`pneumo_ros.log.records` and :mod:`pneumo_ros.log.layouts`; messages that do not fit are
deserialised one by one by ``rosbags``, with equal results. Nothing here needs ROS.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Attachment, Metadata
from numpy.typing import NDArray
from rosbags.serde import SerdeError

from pneumo_ros.errors import InputError
from pneumo_ros.log.bags import Part, read_parts
from pneumo_ros.log.generic import columns_of, joints_of
from pneumo_ros.log.layouts import Layout, Text, UnfitError, decode, layout_of, type_store
from pneumo_ros.log.records import Records, join
from pneumo_ros.rig import Rig, parse_rig

JOINT_STATE = "sensor_msgs/msg/JointState"
FLUID_PRESSURE = "sensor_msgs/msg/FluidPressure"
STRING = "std_msgs/msg/String"
CONFIG_TOPIC = "/rig/config"
STAMP = ("header.stamp.sec", "header.stamp.nanosec")
SECOND = 1_000_000_000  # ns
# What rosbags' generated readers raise for bytes that are not the type's.
BROKEN = (SerdeError, LookupError, AssertionError, ValueError, TypeError, OverflowError, MemoryError, struct.error)


@dataclass(frozen=True)
class TopicInfo:
    """What the log says about a topic.

    Attributes
    ----------
    name, type : topic and message type, ``pkg/msg/Type``
    count : messages
    encoding : of the messages; only ``cdr`` can be decoded
    schema_encoding, schema : the type's definition as recorded
    qos : offered QoS profiles as the recorder noted them (YAML), or ""
    type_hash : RIHS01 hash of the type, or ""
    """

    name: str
    type: str
    count: int
    encoding: str
    schema_encoding: str
    schema: str
    qos: str
    type_hash: str


@dataclass(frozen=True)
class Joint:
    """A topic of named channels: N messages, K channels.

    Attributes
    ----------
    stamp_ns : (N,) the instant each value holds, ns
    log_time_ns : (N,) when it was recorded, ns
    names : the K channel names
    position : (N, K); its unit is the topic's (m for heights, m2 for areas), NaN where a message lacks the channel
    velocity, effort : (N, K), or None if the topic leaves them empty
    """

    stamp_ns: NDArray[np.int64]
    log_time_ns: NDArray[np.int64]
    names: tuple[str, ...]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64] | None
    effort: NDArray[np.float64] | None


@dataclass(frozen=True)
class Scalar:
    """A topic of one quantity: absolute pressure, Pa, and its variance, Pa2, each (N,)."""

    stamp_ns: NDArray[np.int64]
    log_time_ns: NDArray[np.int64]
    value: NDArray[np.float64]
    variance: NDArray[np.float64]


@dataclass(frozen=True)
class Columns:
    """Any topic as columns.

    Attributes
    ----------
    stamp_ns : (N,) header stamp; the log time for types without a header
    log_time_ns : (N,)
    arrays : by field path (``header.stamp.sec``, ``position``), (N,) or (N, K); object arrays where lengths vary
    texts : constant strings by path; strings that change are in ``arrays``
    """

    stamp_ns: NDArray[np.int64]
    log_time_ns: NDArray[np.int64]
    arrays: dict[str, NDArray[Any]]
    texts: dict[str, Text]


@dataclass
class Log:
    """A log in memory: messages serialised, decoded when asked for.

    Attributes
    ----------
    path : file or folder
    profile, library : of the first file's header
    topics : what was recorded, by name
    metadata : the file's metadata records, in order
    attachments : the file's attachments, in order
    unprotected : True if some content carries no checksum, so that damage in it cannot be seen
    """

    path: Path
    profile: str
    library: str
    topics: dict[str, TopicInfo]
    metadata: tuple[Metadata, ...]
    attachments: tuple[Attachment, ...]
    unprotected: bool
    _records: dict[str, Records] = field(repr=False)
    _columns: dict[str, Columns] = field(default_factory=dict, repr=False)

    def info(self, topic: str) -> TopicInfo:
        """The topic's entry.

        Raises
        ------
        InputError
            if the log has no such topic.
        """
        if topic not in self.topics:
            raise InputError(
                "the log has no such topic",
                where=self.path,
                key=topic,
                allowed=", ".join(sorted(self.topics)) or "none",
            )
        return self.topics[topic]

    def records(self, topic: str) -> Records:
        """The topic's serialised messages with log times and sequence numbers.

        Raises
        ------
        InputError
            if the log has no such topic.
        """
        self.info(topic)
        return self._records[topic]

    def joint(self, topic: str) -> Joint:
        """A JointState topic; channels in the first message's order, matched by name in every message.

        Raises
        ------
        InputError
            if the topic is missing, of another type or broken.
        """
        columns = self._typed(topic, JOINT_STATE)
        names = columns.texts.get("name")
        if names is None:
            return self._joint_slowly(topic, columns)
        position = columns.arrays["position"]
        if position.shape != (len(columns.stamp_ns), len(names)):
            raise self._broken(topic, f"{len(names)} names but {position.shape[1:]} positions")
        velocity, effort = (_optional(columns.arrays[key], len(names)) for key in ("velocity", "effort"))
        return Joint(columns.stamp_ns, columns.log_time_ns, tuple(names), position, velocity, effort)

    def select(self, topic: str, names: Sequence[str]) -> Joint:
        """The wanted channels of a JointState topic, in the wanted order.

        Raises
        ------
        InputError
            if a channel is missing.
        """
        joint = self.joint(topic)
        missing = [name for name in names if name not in joint.names]
        if missing:
            raise InputError(
                f"channel {missing[0]!r} is missing", where=self.path, key=topic, allowed=", ".join(joint.names)
            )
        order = [joint.names.index(name) for name in names]
        velocity, effort = (None if a is None else a[:, order] for a in (joint.velocity, joint.effort))
        return Joint(joint.stamp_ns, joint.log_time_ns, tuple(names), joint.position[:, order], velocity, effort)

    def pressure(self, topic: str) -> Scalar:
        """A FluidPressure topic.

        Raises
        ------
        InputError
            if the topic is missing, of another type or broken.
        """
        columns = self._typed(topic, FLUID_PRESSURE)
        value, variance = columns.arrays["fluid_pressure"], columns.arrays["variance"]
        return Scalar(columns.stamp_ns, columns.log_time_ns, value, variance)

    def columns(self, topic: str) -> Columns:
        """Any topic as columns, whatever its type.

        Raises
        ------
        InputError
            if the topic is missing, not CDR or broken.
        """
        if topic not in self._columns:
            self._columns[topic] = self._decode(topic)
        return self._columns[topic]

    def stamps(self, topic: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(stamp, log time) of each message, (N,) ns each: every message is checked, no other number is kept.

        Raises
        ------
        InputError
            if the topic is missing, not CDR or broken.
        """
        records = self.records(topic)
        if topic in self._columns:
            return self._columns[topic].stamp_ns, records.log_time_ns
        found = self._by_layout(topic, STAMP)
        if found is not None:
            return _stamps(found[1], records.log_time_ns), records.log_time_ns
        pairs = ((time, getattr(message, "header", None)) for time, message in self.messages(topic))
        stamps = (
            time if header is None else header.stamp.sec * SECOND + header.stamp.nanosec for time, header in pairs
        )
        return np.fromiter(stamps, np.int64, len(records)), records.log_time_ns

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """(log time in ns, message) one by one, as plain objects with the type's fields.

        Raises
        ------
        InputError
            if the topic is missing, not CDR or broken.
        """
        info = self.info(topic)
        if info.encoding != "cdr":
            raise self._broken(topic, f"message encoding {info.encoding!r} cannot be decoded")
        store = type_store(info.type, info.schema_encoding, info.schema)
        records = self._records[topic]
        for i, log_time in enumerate(records.log_time_ns.tolist()):
            try:
                yield log_time, store.deserialize_cdr(records.message(i), info.type)
            except BROKEN as error:
                raise self._broken(topic, f"message {i} does not decode as {info.type}") from error

    @property
    def config(self) -> Rig | None:
        """The rig that the log was made with, or None if it does not say.

        Raises
        ------
        InputError
            if the log's configuration is not a usable rig.
        """
        texts = self.texts(CONFIG_TOPIC) if CONFIG_TOPIC in self.topics else []
        return parse_rig(texts[-1], f"{self.path} {CONFIG_TOPIC}") if texts else None

    def texts(self, topic: str) -> list[str]:
        """The messages of a String topic.

        Raises
        ------
        InputError
            if the topic is missing, of another type or broken.
        """
        if self.info(topic).type != STRING:
            raise self._broken(topic, f"type {self.topics[topic].type}, expected {STRING}")
        return [message.data for _, message in self.messages(topic)]

    def _typed(self, topic: str, wanted: str) -> Columns:
        if self.info(topic).type != wanted:
            raise self._broken(topic, f"type {self.topics[topic].type}, expected {wanted}")
        if self.topics[topic].count == 0:
            raise self._broken(topic, "the topic holds no messages")
        return self.columns(topic)

    def _broken(self, topic: str, what: str) -> InputError:
        return InputError(what, where=self.path, key=topic)

    def _decode(self, topic: str) -> Columns:
        records, found = self._records[topic], self._by_layout(topic)
        if found is None:
            return self._decode_slowly(topic, records)
        layout, arrays = found
        return Columns(_stamps(arrays, records.log_time_ns), records.log_time_ns, arrays, dict(layout.texts))

    def _by_layout(
        self, topic: str, only: tuple[str, ...] | None = None
    ) -> tuple[Layout, dict[str, NDArray[Any]]] | None:
        """The topic's numbers in bulk, or None where its messages differ in more than their numbers."""
        info, records = self.info(topic), self._records[topic]
        rows = records.rows()
        if info.encoding != "cdr" or rows is None:
            return None
        store = type_store(info.type, info.schema_encoding, info.schema)
        layout = layout_of(store, info.type, records.message(0))
        arrays = decode(layout, rows, only) if layout else None
        return None if layout is None or arrays is None else (layout, arrays)

    def _decode_slowly(self, topic: str, records: Records) -> Columns:
        arrays, texts = columns_of(message for _, message in self.messages(topic))
        return Columns(_stamps(arrays, records.log_time_ns), records.log_time_ns, arrays, texts)

    def _joint_slowly(self, topic: str, columns: Columns) -> Joint:
        """Names that change from message to message."""
        try:
            names, fields = joints_of([message for _, message in self.messages(topic)])
        except UnfitError as error:
            raise self._broken(topic, str(error)) from error
        position = fields["position"]
        assert position is not None
        return Joint(columns.stamp_ns, columns.log_time_ns, names, position, fields["velocity"], fields["effort"])


def read_log(path: str | Path, topics: Sequence[str] | None = None) -> Log:
    """Read a log, checking every bound and checksum; a damaged one is refused.

    Parameters
    ----------
    path : an .mcap file, or a bag folder
    topics : keep only these (missing ones are not an error here); None keeps all

    Raises
    ------
    InputError
        not a log, another profile, truncated or damaged: with the byte it breaks at and the remedy.
    """
    return assemble(Path(path), read_parts(Path(path), topics))


def assemble(path: Path, parts: Sequence[Part]) -> Log:
    """One log of the files that were read.

    Raises
    ------
    InputError
        if a topic was recorded with different definitions.
    """
    found: dict[str, list[tuple[TopicInfo, Records]]] = {}
    for part in parts:
        for info, records in _topics_of(part):
            found.setdefault(info.name, []).append((info, records))
    infos, joined = {}, {}
    for name in sorted(found):
        infos[name], joined[name] = _merged(path, found.pop(name))
    contents = [part.contents for part in parts]
    return Log(
        path=path,
        profile=contents[0].header.profile,
        library=contents[0].header.library,
        topics=infos,
        metadata=tuple(m for c in contents for m in c.metadata),
        attachments=tuple(a for c in contents for a in c.attachments),
        unprotected=any(c.unprotected for c in contents),
        _records=joined,
    )


def _topics_of(part: Part) -> Iterator[tuple[TopicInfo, Records]]:
    for identity, records in part.records.items():
        channel = part.contents.channels[identity]
        schema = part.contents.schemas.get(channel.schema_id)
        yield (
            TopicInfo(
                channel.topic,
                _full_name(schema.name) if schema else "",
                len(records),
                channel.message_encoding,
                schema.encoding if schema else "",
                schema.data.decode("utf-8", "replace") if schema else "",
                channel.metadata.get("offered_qos_profiles", ""),
                channel.metadata.get("topic_type_hash", ""),
            ),
            records,
        )


def _full_name(name: str) -> str:
    parts = name.split("/")
    return f"{parts[0]}/msg/{parts[1]}" if len(parts) == 2 else name


def _merged(path: Path, entries: list[tuple[TopicInfo, Records]]) -> tuple[TopicInfo, Records]:
    infos = [info for info, _ in entries]
    if any((i.type, i.encoding, i.schema) != (infos[0].type, infos[0].encoding, infos[0].schema) for i in infos):
        kinds = ", ".join(sorted({i.type for i in infos}))
        raise InputError(f"recorded with different definitions ({kinds})", where=path, key=infos[0].name)
    records = join([r for _, r in entries])
    first = infos[0]
    qos, type_hash = first.qos, first.type_hash
    merged = TopicInfo(
        first.name, first.type, len(records), first.encoding, first.schema_encoding, first.schema, qos, type_hash
    )
    return merged, records


def _stamps(arrays: dict[str, NDArray[Any]], log_time_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    second, nano = arrays.get("header.stamp.sec"), arrays.get("header.stamp.nanosec")
    if second is None or nano is None:
        return log_time_ns
    return second.astype(np.int64) * 1_000_000_000 + nano.astype(np.int64)


def _optional(values: NDArray[Any], count: int) -> NDArray[np.float64] | None:
    return values if values.ndim == 2 and values.shape[1] == count and count > 0 else None
