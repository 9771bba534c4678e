# SPDX-License-Identifier: Apache-2.0
"""The fixed-layout codecs against rclpy's own serialisation."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("rclpy")
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import FluidPressure, JointState

from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.log.cdr import (
    JointDecoder,
    JointEncoder,
    PressureEncoder,
    decode_pressure,
    encode_clock,
    stamp_of,
)

STAMP = 1_760_900_000_123_456_789
JOINTS = [topic for topic in topics.TOPICS if topic.type == topics.JOINT]


def message(topic: topics.Topic, values: list[float]) -> JointState:
    out = JointState(name=list(topic.names), position=values, velocity=values[::-1] if topic.rates else [])
    out.header.frame_id = topic.frame_id
    out.header.stamp.sec, out.header.stamp.nanosec = divmod(STAMP, 1_000_000_000)
    return out


@pytest.mark.parametrize("topic", JOINTS, ids=lambda t: t.name)
def test_joint_codec_agrees_with_rclpy(topic: topics.Topic) -> None:
    values = [0.25 + i for i in range(len(topic.names))]
    theirs = message(topic, values)
    data = JointEncoder(topic.frame_id, topic.names, topic.rates).encode(STAMP, values, values[::-1])
    assert deserialize_message(data, JointState) == theirs
    decoder = JointDecoder(topic.name, topic.names)
    assert decoder.decode(serialize_message(theirs)) == (STAMP, tuple(values))
    assert decoder.decode(data) == (STAMP, tuple(values))
    assert stamp_of(data) == STAMP
    stamp, array = decoder.decode_array(serialize_message(theirs))
    assert stamp == STAMP and array.flags.writeable
    np.testing.assert_array_equal(array, values)
    if not topic.rates:
        assert JointEncoder(topic.frame_id, topic.names).encode_array(STAMP, array) == data


def test_decoder_matches_by_name_and_follows_a_changed_order() -> None:
    decoder = JointDecoder("/t", ("a", "b"))
    for names, values in ((["a", "b"], [1.0, 2.0]), (["b", "a"], [2.0, 1.0]), (["x", "b", "a"], [9.0, 2.0, 1.0])):
        data = serialize_message(JointState(name=names, position=values))
        assert decoder.decode(data)[1] == (1.0, 2.0)
        np.testing.assert_array_equal(decoder.decode_array(data)[1], [1.0, 2.0])


@pytest.mark.parametrize("joint", [JointState(name=["a"], position=[1.0]), JointState(name=["a", "b"], position=[1.0])])
def test_decoder_refuses_missing_values(joint: JointState) -> None:
    with pytest.raises(InputError, match="/t"):
        JointDecoder("/t", ("a", "b")).decode(serialize_message(joint))


def test_decoder_refuses_any_truncation() -> None:
    data = JointEncoder("f", ("a", "b")).encode(STAMP, (1.0, 2.0))
    for size in range(4, len(data) - 12):
        with pytest.raises(InputError):
            JointDecoder("/t", ("a", "b")).decode(data[:size])


def test_pressure_and_clock_codecs_agree_with_rclpy() -> None:
    data = PressureEncoder("front_air_spring", 22500.0).encode(STAMP, 2.5e5)
    theirs = deserialize_message(data, FluidPressure)
    assert (theirs.fluid_pressure, theirs.variance, theirs.header.frame_id) == (2.5e5, 22500.0, "front_air_spring")
    assert decode_pressure(serialize_message(theirs)) == (STAMP, 2.5e5)
    clock = deserialize_message(encode_clock(STAMP), Clock)
    assert clock.clock.sec * 1_000_000_000 + clock.clock.nanosec == STAMP
