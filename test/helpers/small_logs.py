# SPDX-License-Identifier: Apache-2.0
"""Logs of a few messages as any MCAP writer makes them, and what other readers say of a log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.reader import read_ros2_messages
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

from pneumo_ros.log.decoded import FLUID_PRESSURE, JOINT_STATE, STRING, Log
from pneumo_ros.log.reading import read_log
from pneumo_ros.rig import load_rig

PERIOD = 2_000_000  # ns
T0 = 10**9  # ns, stamp of the first message
VALVES = ("front_inlet", "rear_inlet", "front_outlet", "rear_outlet")
STORE = get_typestore(Stores.ROS2_JAZZY)
NAMES = ("sprung_front", "sprung_rear", "unsprung_front", "unsprung_rear")
Message = tuple[str, str, int, object]  # topic, type, log time in ns, message


def header(stamp_ns: int, frame: str = "ground") -> object:
    stamp = STORE.types["builtin_interfaces/msg/Time"](sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    return STORE.types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def joint(
    stamp_ns: int, position: Sequence[float], names: Sequence[str] = NAMES, velocity: Sequence[float] = ()
) -> object:
    arrays = (np.array(position, float), np.array(velocity, float), np.empty(0))
    return STORE.types[JOINT_STATE](header(stamp_ns), list(names), *arrays)


def pressure(stamp_ns: int, value: float) -> object:
    return STORE.types[FLUID_PRESSURE](header(stamp_ns), value, 2.5)


def text(value: str) -> object:
    return STORE.types[STRING](value)


def write(
    path: Path, messages: Sequence[Message], metadata: Mapping[str, dict[str, str]] | None = None, **options: object
) -> Path:
    """A log as any MCAP writer makes it."""
    with path.open("wb") as stream:
        writer = Writer(stream, **options)  # type: ignore[arg-type]
        writer.start("ros2", "test")
        channels: dict[str, int] = {}
        for i, (topic, kind, time, message) in enumerate(messages):
            if topic not in channels:
                definition, _ = STORE.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", definition.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema, {"offered_qos_profiles": "[]"})
            data = bytes(STORE.serialize_cdr(message, kind))
            writer.add_message(channels[topic], time, data, time, i)
        for name, entries in (metadata or {}).items():
            writer.add_metadata(name, entries)
        writer.finish()
    return path


def session(count: int = 200) -> list[Message]:
    rng = np.random.default_rng(7)
    messages: list[Message] = [("/rig/config", STRING, 0, text(load_rig().to_yaml()))]
    for i in range(count):
        time = i * 2_000_000
        messages.append(("/rig/displacement", JOINT_STATE, time + 5, joint(time, rng.normal(size=4))))
        messages.append(
            ("/road/profile", JOINT_STATE, time + 6, joint(time, rng.normal(size=2), ("front", "rear"), (1.0, i)))
        )
        messages.append(("/rig/front/pressure", FLUID_PRESSURE, time + 7, pressure(time, rng.normal())))
    return messages


def assert_equals_mcap_ros2(path: Path, log: Log) -> None:
    seen: dict[str, list[object]] = {}
    for message in read_ros2_messages(str(path)):
        seen.setdefault(message.channel.topic, []).append(message)
    assert {name: info.count for name, info in log.topics.items()} == {k: len(v) for k, v in seen.items()}
    for topic, found in seen.items():
        theirs = [m.ros_msg for m in found]  # type: ignore[attr-defined]
        log_time = [m.log_time_ns for m in found]  # type: ignore[attr-defined]
        info = log.info(topic)
        assert np.array_equal(log.columns(topic).log_time_ns, log_time)
        if info.type == STRING:
            assert log.texts(topic) == [m.data for m in theirs]
            continue
        stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in theirs]
        assert np.array_equal(log.columns(topic).stamp_ns, stamps)
        if info.type == JOINT_STATE:
            ours = log.joint(topic)
            assert list(ours.names) == theirs[0].name
            assert np.array_equal(ours.position, [m.position for m in theirs])
            empty = len(theirs[0].velocity) == 0
            assert ours.velocity is None if empty else np.array_equal(ours.velocity, [m.velocity for m in theirs])
            assert ours.effort is None
        else:
            assert np.array_equal(log.pressure(topic).value, [m.fluid_pressure for m in theirs])
            assert np.array_equal(log.pressure(topic).variance, [m.variance for m in theirs])


def contract_log(count: int = 300, gain: float = 1.0) -> list[Message]:
    """A session that keeps the contract; start at 1 s, log time 1 ms after the stamp."""
    rng = np.random.default_rng(5)
    out: list[Message] = [("/rig/config", STRING, 10**9, text(load_rig().to_yaml()))]
    for i in range(count):
        t = 10**9 + i * PERIOD
        log = t + 10**6
        z = 0.02 * np.array([1, -1, 0.5, 0.3]) + 1e-3 * gain * rng.normal(size=4)
        out.append(
            ("/road/profile", JOINT_STATE, log, joint(t, 1e-3 * rng.normal(size=2), ("front", "rear"), (0.0, 0.1)))
        )
        out.append(("/rig/displacement", JOINT_STATE, log, joint(t, z)))
        out.append(("/rig/front/pressure", FLUID_PRESSURE, log, pressure(t, 2.7e5 + rng.normal())))
        out.append(("/rig/rear/pressure", FLUID_PRESSURE, log, pressure(t, 4.3e5 + rng.normal())))
        out.append(("/valve/command", JOINT_STATE, log, joint(t, np.full(4, 1e-6), VALVES)))
    return out


def split_bag(folder: Path) -> Path:
    """A folder as rosbag2 writes it: recorded in two files, listed in metadata.yaml."""
    with BagWriter(folder, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        for name, kind in (("/rig/displacement", JOINT_STATE), ("/rosout_like", STRING)):
            connection = bag.add_connection(name, kind, typestore=STORE)
            for i in range(50):
                message = joint(i, [i, 1, 2, 3]) if kind == JOINT_STATE else text(f"line {i}")
                bag.write(connection, i, STORE.serialize_cdr(message, kind))
    return folder


def assert_accepted_by_other_readers(path: Path, count: int) -> None:
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert sum(1 for _ in reader.iter_messages()) == count
    with AnyReader([path]) as reader:
        assert sum(1 for _ in reader.messages()) == count
    assert_equals_mcap_ros2(path, read_log(path))
