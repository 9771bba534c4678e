# SPDX-License-Identifier: Apache-2.0
"""Messages in a parcel: the same bytes come out, rclpy reads it as the message it says it is, and faults are told."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy")
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import UInt8MultiArray

from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointEncoder, PressureEncoder
from pneumo_ros.log.parcel import pack, unpack
from pneumo_ros.nodes.interfaces import message_class

SAMPLE = [
    (topics.DISPLACEMENT.name, JointEncoder("ground", topics.DISPLACEMENT.names).encode(7, [0.1, 0.2, 0.3, 0.4])),
    (topics.FRONT_PRESSURE.name, PressureEncoder("front_air_spring", 4.0).encode(7, 2e5)),
    ("/äußeres", b"\x00\x01\x00\x00abc"),
]


@pytest.mark.parametrize("messages", [[], SAMPLE[:1], SAMPLE, SAMPLE * 100])
def test_the_same_bytes_in_the_same_order(messages: list[tuple[str, bytes]]) -> None:
    assert list(unpack(pack(messages), "/t")) == messages


def test_rclpy_reads_and_writes_the_same_message() -> None:
    assert message_class(topics.PARCEL) is UInt8MultiArray
    packed = pack(SAMPLE)
    theirs = deserialize_message(packed, UInt8MultiArray)
    assert not theirs.layout.dim and bytes(theirs.data) == packed[16:]
    for padding in (b"", b"\x00", b"\x00\x00\x00"):  # the middleware fills up to four bytes
        assert list(unpack(serialize_message(theirs) + padding, "/t")) == SAMPLE


def test_a_cut_or_spoiled_parcel_is_refused() -> None:
    packed = pack(SAMPLE)
    for size in range(len(packed)):
        with pytest.raises(InputError, match="/t: not a parcel"):
            list(unpack(packed[:size], "/t"))
    too_long = bytearray(packed)
    too_long[20] += 1  # 65,536 bytes more of the first message
    dimension = bytearray(packed)
    dimension[4] = 1
    name = bytearray(packed)
    name[22] = 0xFF
    for spoiled in (too_long, dimension, name):
        with pytest.raises(InputError, match="/t: not a parcel"):
            list(unpack(bytes(spoiled), "/t"))


@pytest.mark.parametrize("sender", topics.SENDERS)
def test_parcels_reach_who_acts_on_what_they_hold(sender: str) -> None:
    held = [topic for topic in topics.IN_PARCELS if topic.publisher == sender]
    acting = {taker for topic in held for taker in topic.subscribers} - {"daq"}
    assert held and set(topics.FOR_NEXT[sender].subscribers) == acting
    assert topics.FOR_LOG[sender].subscribers == ("session_recorder",) and all(topic.recorded for topic in held)
    assert not topics.FOR_NEXT[sender].recorded and not topics.FOR_LOG[sender].recorded


def test_every_stream_of_a_session_s_nodes_is_in_parcels() -> None:
    streams = {
        t for t in topics.TOPICS
        if t.publisher in topics.SENDERS and t.flow is topics.Flow.STREAM and t.type != topics.PARCEL
    }  # fmt: skip
    assert streams == set(topics.IN_PARCELS)
