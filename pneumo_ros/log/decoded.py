# SPDX-License-Identifier: Apache-2.0
"""A log in memory: messages serialised, decoded by topic and by channel name when asked for."""

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
from pneumo_ros.log.generic import columns_of, joints_of
from pneumo_ros.log.layouts import Layout, UnfitError, decode, lacks_standard_fields, layout_of, type_store
from pneumo_ros.log.records import Records
from pneumo_ros.log.topic_data import Columns, Joint, Scalar, TopicInfo
from pneumo_ros.rig import Rig, parse_rig

JOINT_STATE = "sensor_msgs/msg/JointState"
FLUID_PRESSURE = "sensor_msgs/msg/FluidPressure"
STRING = "std_msgs/msg/String"
DIAGNOSTIC_ARRAY = "diagnostic_msgs/msg/DiagnosticArray"
READ_BY_FIELD = (JOINT_STATE, FLUID_PRESSURE, STRING, DIAGNOSTIC_ARRAY)
CONFIG_TOPIC = "/rig/config"
STAMP = ("header.stamp.sec", "header.stamp.nanosec")
SECOND = 1_000_000_000  # ns
# What rosbags' generated readers raise for bytes that are not the type's.
BROKEN = (SerdeError, LookupError, AssertionError, ValueError, TypeError, OverflowError, MemoryError, struct.error)


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
    span_ns : log time of the first and last message, kept or not; None where a file does not say
    """

    path: Path
    profile: str
    library: str
    topics: dict[str, TopicInfo]
    metadata: tuple[Metadata, ...]
    attachments: tuple[Attachment, ...]
    unprotected: bool
    span_ns: tuple[int, int] | None
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
        self._check_fields(topic)
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
        self._check_fields(topic)
        return self.columns(topic)

    def _check_fields(self, topic: str) -> None:
        """What is read by its fields' names has them: a definition may say anything below a standard name."""
        info = self.info(topic)
        if info.type not in READ_BY_FIELD or info.encoding != "cdr":
            return
        if lacks_standard_fields(type_store(info.type, info.schema_encoding, info.schema), info.type):
            raise self._broken(topic, f"the log's definition of {info.type} is not the standard one")

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


def _stamps(arrays: dict[str, NDArray[Any]], log_time_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    second, nano = arrays.get("header.stamp.sec"), arrays.get("header.stamp.nanosec")
    if second is None or nano is None:
        return log_time_ns
    return second.astype(np.int64) * 1_000_000_000 + nano.astype(np.int64)


def _optional(values: NDArray[Any], count: int) -> NDArray[np.float64] | None:
    return values if values.ndim == 2 and values.shape[1] == count and count > 0 else None
