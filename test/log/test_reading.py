# SPDX-License-Identifier: Apache-2.0
"""The bulk reader agrees with independent readers, value by value, and refuses what is damaged."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import zstandard
from helpers.practice import OTHER_WRITER
from helpers.small_logs import (
    STORE,
    Message,
    assert_equals_mcap_ros2,
    header,
    joint,
    session,
    split_bag,
    text,
    write,
)
from mcap.writer import CompressionType, IndexType

from pneumo_ros.errors import InputError
from pneumo_ros.log.decoded import JOINT_STATE, STRING, Log
from pneumo_ros.log.layouts import layout_of
from pneumo_ros.log.reading import read_log


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.ZSTD, "chunk_size": 4096},
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE},
        {"use_chunking": False},
        {"index_types": IndexType.NONE, "use_statistics": False, "use_summary_offsets": False},
        {"enable_data_crcs": True},
        {"enable_crcs": False},
    ],
    ids=lambda o: ",".join(f"{k}={v}" for k, v in o.items()),
)
def test_any_container_reads_the_same(tmp_path: Path, options: dict[str, object]) -> None:
    path = write(tmp_path / "a.mcap", session(), **options)
    log = read_log(path)
    assert_equals_mcap_ros2(path, log)
    unprotected = options.get("enable_crcs") is False or options.get("use_chunking") is False
    assert log.unprotected == unprotected


def test_sample_log_reads_as_mcap_ros2_reads_it() -> None:
    log = read_log(OTHER_WRITER)
    assert_equals_mcap_ros2(OTHER_WRITER, log)
    assert log.config is not None and log.config.name == "half-car-2m2a"


def test_the_sample_log_takes_the_bulk_way(monkeypatch: pytest.MonkeyPatch) -> None:
    log = read_log(OTHER_WRITER)
    monkeypatch.setattr(Log, "_decode_slowly", lambda *_: pytest.fail("decoded one by one"))
    for topic, info in log.topics.items():
        if info.type != STRING:
            log.columns(topic)


def test_both_ways_of_decoding_agree(tmp_path: Path) -> None:
    log = read_log(write(tmp_path / "a.mcap", session()))
    for topic in ("/rig/displacement", "/rig/front/pressure"):
        quick, slow = log._decode(topic), log._decode_slowly(topic, log.records(topic))
        assert quick.arrays.keys() == slow.arrays.keys() and quick.texts == slow.texts
        for path, values in quick.arrays.items():
            assert np.array_equal(values, slow.arrays[path]), path


def test_channels_are_matched_by_name_when_their_order_changes(tmp_path: Path) -> None:
    messages: list[Message] = [
        ("/x", JOINT_STATE, 1, joint(1, [1.0, 2.0], ("front", "rear"), [5.0, 6.0])),
        ("/x", JOINT_STATE, 2, joint(2, [20.0, 10.0], ("rear", "front"), [60.0, 50.0])),
        ("/x", JOINT_STATE, 3, joint(3, [100.0, 300.0], ("front", "extra"))),
    ]
    read = read_log(write(tmp_path / "a.mcap", messages)).joint("/x")
    assert read.names == ("front", "rear", "extra")
    nan = np.nan
    np.testing.assert_array_equal(read.position, [[1, 2, nan], [10, 20, nan], [100, nan, 300]])
    assert read.velocity is not None
    np.testing.assert_array_equal(read.velocity, [[5, 6, nan], [50, 60, nan], [nan, nan, nan]])


def test_select_orders_by_name_and_names_what_is_missing(tmp_path: Path) -> None:
    log = read_log(write(tmp_path / "a.mcap", session(5)))
    whole, part = log.joint("/rig/displacement"), log.select("/rig/displacement", ["unsprung_rear", "sprung_front"])
    assert np.array_equal(part.position, whole.position[:, [3, 0]])
    with pytest.raises(InputError, match="'pitch' is missing"):
        log.select("/rig/displacement", ["pitch"])
    with pytest.raises(InputError, match="no such topic"):
        log.joint("/nowhere")
    with pytest.raises(InputError, match="expected sensor_msgs/msg/JointState"):
        log.joint("/rig/front/pressure")


def test_messages_come_in_log_time_order(tmp_path: Path) -> None:
    messages: list[Message] = [("/x", JOINT_STATE, t, joint(t, [float(t)], ("a",))) for t in (3, 1, 2, 5, 4)]
    log = read_log(write(tmp_path / "a.mcap", messages))
    assert log.joint("/x").position[:, 0].tolist() == [1, 2, 3, 4, 5]
    assert log.records("/x").disordered == 2


def test_topics_can_be_chosen(tmp_path: Path) -> None:
    log = read_log(write(tmp_path / "a.mcap", session(5)), topics=["/road/profile", "/absent"])
    assert list(log.topics) == ["/road/profile"] and log.config is None


def test_any_type_decodes_in_bulk(tmp_path: Path) -> None:
    """Nested messages, arrays of structures, bool, small integers and big-endian data."""
    kind = "diagnostic_msgs/msg/DiagnosticArray"
    key = STORE.types["diagnostic_msgs/msg/KeyValue"]
    status = STORE.types["diagnostic_msgs/msg/DiagnosticStatus"]

    def message(i: int) -> object:
        entries = [status(i % 3, "valve", "ok", "id", [key("a", "b")]), status(2, "supply", "", "", [])]
        return STORE.types[kind](header(i), entries)

    log = read_log(write(tmp_path / "a.mcap", [("/d", kind, i, message(i)) for i in range(9)]))
    columns = log._decode("/d")
    assert columns.arrays["status[0].level"].tolist() == [i % 3 for i in range(9)]
    assert columns.texts["status[1].name"] == "supply" and columns.texts["status[0].values[0].key"] == "a"
    slow = log._decode_slowly("/d", log.records("/d"))
    assert all(np.array_equal(values, slow.arrays[path]) for path, values in columns.arrays.items())
    big = bytes(STORE.serialize_cdr(joint(77, [1.5, 2.5], ("a", "b")), JOINT_STATE, little_endian=False))
    layout = layout_of(STORE, JOINT_STATE, big)
    assert layout is not None and layout.texts["name"] == ("a", "b")


def test_texts_that_change_become_a_column(tmp_path: Path) -> None:
    log = read_log(write(tmp_path / "a.mcap", [("/s", STRING, i, text("x" * (i + 1))) for i in range(3)]))
    assert log.columns("/s").arrays["data"].tolist() == ["x", "xx", "xxx"]
    same = read_log(write(tmp_path / "b.mcap", [("/s", STRING, i, text("xyz"[i])) for i in range(3)]))
    assert same.columns("/s").arrays["data"].tolist() == ["x", "y", "z"]


def test_a_bag_folder_reads(tmp_path: Path) -> None:
    log = read_log(split_bag(tmp_path / "bag"))
    assert log.joint("/rig/displacement").position[:, 0].tolist() == list(range(50))
    assert log.texts("/rosout_like")[-1] == "line 49"


def test_split_files_are_joined_in_the_listed_order(tmp_path: Path) -> None:
    write(tmp_path / "bag_1.mcap", [("/x", JOINT_STATE, t, joint(t, [t], ("a",))) for t in (1, 2)])
    write(tmp_path / "bag_0.mcap", [("/x", JOINT_STATE, t, joint(t, [t], ("a",))) for t in (3, 4)])
    assert read_log(tmp_path).joint("/x").position[:, 0].tolist() == [1, 2, 3, 4]
    listed = "rosbag2_bagfile_information: {relative_file_paths: [bag_1.mcap, bag_0.mcap]}"
    (tmp_path / "metadata.yaml").write_text(listed)
    assert read_log(tmp_path).joint("/x").position[:, 0].tolist() == [1, 2, 3, 4]


@pytest.mark.parametrize("listed", ["", "rosbag2_bagfile_information: {relative_file_paths: [monday.mcap]}"])
def test_a_folder_of_several_logs_asks_which(tmp_path: Path, listed: str) -> None:
    for name in ("monday", "tuesday"):
        write(tmp_path / f"{name}.mcap", [("/x", JOINT_STATE, t, joint(t, [t], ("a",))) for t in (1, 2)])
    if listed:
        (tmp_path / "metadata.yaml").write_text(listed)
    with pytest.raises(InputError, match=r"several logs; allowed: monday.mcap, tuesday.mcap; say which, for example "):
        read_log(tmp_path)
    assert read_log(tmp_path / "tuesday.mcap").topics["/x"].count == 2


def test_other_storages_of_ros2_bag(tmp_path: Path) -> None:
    """Packed as a whole: read. Message by message, or SQLite: refused by name, with what to do."""
    path = write(tmp_path / "a.mcap", session(20))
    whole = read_log(path)
    (tmp_path / "packed").mkdir()
    packed = tmp_path / "packed" / "a.mcap.zstd"
    packed.write_bytes(zstandard.compress(path.read_bytes()))
    log = read_log(packed.parent)
    assert np.array_equal(log.joint("/road/profile").position, whole.joint("/road/profile").position)
    packed.write_bytes(packed.read_bytes()[:200])
    with pytest.raises(InputError):
        read_log(packed.parent)
    metadata = tmp_path / "metadata.yaml"
    metadata.write_text("rosbag2_bagfile_information: {relative_file_paths: [a.mcap], compression_mode: MESSAGE}")
    with pytest.raises(InputError, match="compressed by itself"):
        read_log(tmp_path)
    metadata.write_text("rosbag2_bagfile_information: {relative_file_paths: [a.db3]}")
    with pytest.raises(InputError, match="SQLite"):
        read_log(tmp_path)
    metadata.write_text("rosbag2_bagfile_information: 7")
    with pytest.raises(InputError, match=r"metadata\.yaml cannot be read"):
        read_log(tmp_path)


def cut(data: bytes) -> bytes:
    return data[: len(data) // 2]


def flip(data: bytes) -> bytes:
    middle = len(data) // 3
    return data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :]


@pytest.mark.parametrize(
    ("damage", "word"),
    [
        (lambda d: b"", "empty"),
        (lambda d: b"hello" * 9, "not an MCAP"),
        (cut, "pneumo log recover"),
        (flip, "pneumo log recover"),
        (lambda d: d[:-60], "pneumo log recover"),
        (lambda d: d.replace(b"ros2", b"ros1", 1), "allowed: ros2"),
    ],
)
def test_damage_is_named(tmp_path: Path, damage: Callable[[bytes], bytes], word: str) -> None:
    path = write(tmp_path / "a.mcap", session(50))
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(InputError, match=word):
        read_log(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_log(tmp_path / "none.mcap")
    with pytest.raises(InputError, match=r"holds no \.mcap"):
        read_log(tmp_path)
