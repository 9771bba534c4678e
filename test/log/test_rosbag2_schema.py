# SPDX-License-Identifier: Apache-2.0
"""A session's log field by field as rosbag2's MCAP storage reads it (its `ros2 bag` has no wheels to try it with).

The tables below are rosbag2_storage's YAML conversions (metadata version 9) and what its MCAP plugin takes from a file.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")
import yaml
from helpers import sessions
from mcap.reader import SeekingReader, make_reader
from rosbags.highlevel import AnyReader

from pneumo_ros.log.topics import TOPICS

UINT64 = range(2**64)
INFORMATION = {
    "version": int,
    "storage_identifier": str,
    "duration": {"nanoseconds": int},
    "starting_time": {"nanoseconds_since_epoch": int},
    "message_count": int,
    "topics_with_message_count": list,
    "compression_format": str,
    "compression_mode": str,
    "relative_file_paths": list,
    "files": list,
    "custom_data": type(None),
    "ros_distro": str,
}
FILE = {
    "path": str,
    "starting_time": {"nanoseconds_since_epoch": int},
    "duration": {"nanoseconds": int},
    "message_count": int,
}
TOPIC = {
    "topic_metadata": {
        "name": str, "type": str, "serialization_format": str, "offered_qos_profiles": list,
        "type_description_hash": str,
    },
    "message_count": int,
}  # fmt: skip
SPAN = {"sec": int, "nsec": int}
# The words that rmw turns into its enumerations; any other makes a player stop.
WORDS = {
    "history": {"system_default", "keep_last", "keep_all"},
    "reliability": {"system_default", "reliable", "best_effort", "best_available"},
    "durability": {"system_default", "volatile", "transient_local", "best_available"},
    "liveliness": {"system_default", "automatic", "manual_by_topic", "best_available"},
}
PROFILE = {
    "history": str, "depth": int, "reliability": str, "durability": str, "deadline": SPAN, "lifespan": SPAN,
    "liveliness": str, "liveliness_lease_duration": SPAN, "avoid_ros_namespace_conventions": bool,
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("bag")
    code, said = sessions.run("--duration", "1", "--output", str(made / "session.mcap"), "--single-process",
                              "--no-picture")  # fmt: skip
    assert code == 0, said
    return made


@pytest.fixture(scope="module")
def information(folder: Path) -> dict[str, Any]:
    document = yaml.safe_load((folder / "metadata.yaml").read_text(encoding="utf-8"))
    assert set(document) == {"rosbag2_bagfile_information"}
    found: dict[str, Any] = document["rosbag2_bagfile_information"]
    return found


@pytest.fixture(scope="module")
def reader(folder: Path) -> SeekingReader:
    made = make_reader((folder / "session.mcap").open("rb"), validate_crcs=True)
    assert isinstance(made, SeekingReader)
    return made


def fits(value: Any, shape: Any) -> bool:
    """Whether a value has exactly the keys and types of a table above; numbers as uint64."""
    if isinstance(shape, dict):
        return set(value) == set(shape) and all(fits(value[key], inner) for key, inner in shape.items())
    if shape is int:
        return type(value) is int and value in UINT64
    return isinstance(value, shape)


def is_profile(value: Any) -> bool:
    return fits(value, PROFILE) and all(value[policy] in words for policy, words in WORDS.items())


def test_metadata_has_every_field_and_no_other(information: dict[str, Any]) -> None:
    assert fits(information, INFORMATION)
    assert all(fits(file, FILE) for file in information["files"])
    assert all(fits(topic, TOPIC) for topic in information["topics_with_message_count"])
    for topic in information["topics_with_message_count"]:
        profiles = topic["topic_metadata"]["offered_qos_profiles"]
        assert profiles and all(is_profile(profile) for profile in profiles)


def test_a_missing_field_or_a_wrong_word_would_be_seen(information: dict[str, Any]) -> None:
    assert not fits({**information, "extra": 1}, INFORMATION)
    assert not fits({key: value for key, value in information.items() if key != "files"}, INFORMATION)
    profile = information["topics_with_message_count"][0]["topic_metadata"]["offered_qos_profiles"][0]
    assert not is_profile({**profile, "reliability": "RELIABLE"}) and not is_profile({**profile, "depth": "1"})


def test_metadata_says_what_the_file_holds(information: dict[str, Any], reader: SeekingReader, folder: Path) -> None:
    summary = reader.get_summary()
    assert summary is not None and summary.statistics is not None
    statistics = summary.statistics
    assert information["version"] == 9 and information["storage_identifier"] == "mcap"
    assert information["compression_format"] == information["compression_mode"] == ""  # the chunks' is MCAP's own
    assert information["ros_distro"] == "jazzy"
    assert information["relative_file_paths"] == ["session.mcap"] == [file["path"] for file in information["files"]]
    assert information["message_count"] == statistics.message_count == information["files"][0]["message_count"]
    start, duration = statistics.message_start_time, statistics.message_end_time - statistics.message_start_time
    assert information["starting_time"]["nanoseconds_since_epoch"] == start
    assert information["duration"]["nanoseconds"] == duration > 0
    counted = {t["topic_metadata"]["name"]: t["message_count"] for t in information["topics_with_message_count"]}
    by_channel = {c.topic: statistics.channel_message_counts.get(c.id, 0) for c in summary.channels.values()}
    assert counted == by_channel
    assert {t.name for t in TOPICS if t.recorded} <= set(counted)


def test_channels_and_schemas_are_what_the_plugin_reads(information: dict[str, Any], reader: SeekingReader) -> None:
    summary = reader.get_summary()
    assert summary is not None and reader.get_header().profile == "ros2"
    listed = {t["topic_metadata"]["name"]: t["topic_metadata"] for t in information["topics_with_message_count"]}
    for channel in summary.channels.values():
        topic, schema = listed[channel.topic], summary.schemas[channel.schema_id]
        assert channel.message_encoding == topic["serialization_format"] == "cdr"
        assert set(channel.metadata) == {"offered_qos_profiles", "topic_type_hash"}
        assert yaml.safe_load(channel.metadata["offered_qos_profiles"]) == topic["offered_qos_profiles"]
        assert channel.metadata["topic_type_hash"] == topic["type_description_hash"]
        assert re.fullmatch(r"RIHS01_[0-9a-f]{64}", topic["type_description_hash"])
        assert schema.name == topic["type"] and re.fullmatch(r"\w+/msg/\w+", schema.name)
        assert schema.encoding == "ros2msg" and schema.data
    assert len(summary.schemas) == len({schema.name for schema in summary.schemas.values()})


def test_the_file_alone_carries_the_same_record(information: dict[str, Any], reader: SeekingReader) -> None:
    """The plugin finds it through the summary's index, by the name rosbag2."""
    summary = reader.get_summary()
    assert summary is not None
    assert [index.name for index in summary.metadata_indexes].count("rosbag2") == 1
    record = next(m for m in reader.iter_metadata() if m.name == "rosbag2")
    assert set(record.metadata) == {"serialized_metadata"}
    assert yaml.safe_load(record.metadata["serialized_metadata"]) == information


def test_it_plays_in_the_order_of_receipt(folder: Path, reader: SeekingReader) -> None:
    """`ros2 bag play` asks for log-time order, which the plugin gives only of chunks with message indexes."""
    summary = reader.get_summary()
    assert summary is not None and summary.chunk_indexes
    assert all(index.message_index_length > 0 and index.compression == "zstd" for index in summary.chunk_indexes)
    times = [message.log_time for _, _, message in reader.iter_messages(log_time_order=True)]
    assert times == sorted(times)
    with AnyReader([folder]) as bag:
        assert [time for _, time, _ in bag.messages()] == times
