"""Write a session log: raw CDR to MCAP in a thread of its own, complete or visibly not.

A zstd chunk takes milliseconds to compress (10 ms at 768 KiB), so nothing of it may happen in a callback. The file
grows as ``<name>.part`` and gets its name only when footer, metadata and index are in.
"""

from __future__ import annotations

import shutil
import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

from pneumo_ros import __version__
from pneumo_ros.errors import InputError

CHUNK_BYTES = 192 * 1024  # the writer closes a chunk after the message that exceeds this; every one stays below 256 KiB
FREE_BYTES_NEEDED = 64 * 1024 * 1024  # below this the file is finished while there is room for its index
DISK_CHECK_EVERY = 4096  # messages
BATCH_PERIOD = 0.05  # s between batches of the writing thread
ROSBAG2_VERSION = 9
PROFILE = "ros2"


@lru_cache(maxsize=64)
def interface(type_name: str) -> tuple[str, str]:
    """(full ros2msg definition, RIHS01 type hash) of an interface, for example ``sensor_msgs/msg/JointState``."""
    store = get_typestore(Stores.ROS2_JAZZY)
    return store.generate_msgdef(type_name, ros_version=2)[0], store.hash_rihs01(type_name)


@dataclass
class Channel:
    """A topic in the file: what is known of it and how much was written."""

    topic: str
    type: str
    qos: list[dict[str, Any]]
    number: int
    count: int = 0


@dataclass
class Written:
    """What a finished file holds."""

    path: Path
    counts: dict[str, int] = field(default_factory=dict)
    start_ns: int = 0
    end_ns: int = 0
    complete: bool = True
    reason: str = ""


class LogWriter:
    """A session log being written.

    Parameters
    ----------
    path : final name of the file (.mcap)
    metadata : name -> (key -> text) records that explain the run (config, seeds, versions ...); written first, so that
        a log whose recorder was killed still explains itself

    :meth:`write` only queues; a thread does the rest. :meth:`finish` must be called, also after an error.

    Raises
    ------
    InputError
        if the file exists or cannot be created.
    """

    def __init__(self, path: Path, metadata: Mapping[str, Mapping[str, str]] | None = None) -> None:
        self.path = path
        self.part = path.with_name(path.name + ".part")
        _refuse_bad_target(path)
        self._channels: dict[str, Channel] = {}
        self._stream = self.part.open("wb")
        self._writer = Writer(
            self._stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD, enable_data_crcs=True
        )
        self._writer.start(profile=PROFILE, library=f"pneumo_ros {__version__}")
        for name, values in (metadata or {}).items():
            self._writer.add_metadata(name, dict(values))
        self._stream.flush()
        self._queue: deque[tuple[Channel, bytes, int, int]] = deque()
        self._finishing = threading.Event()
        self._lock = threading.Lock()  # topics are registered by callbacks while the thread writes
        self._start, self._end, self._total = 0, 0, 0
        self._stopped = ""
        self.queued = 0
        self._thread = threading.Thread(target=self._drain, name="log-writer", daemon=True)
        self._thread.start()

    @property
    def stopped(self) -> str:
        """Why nothing is written any more ('' while all is well): disk full or an error of the file system."""
        return self._stopped

    def add_topic(self, topic: str, type_name: str, qos: list[dict[str, Any]] | None = None) -> Channel:
        """Register a topic before its first message; ``qos`` as the publisher offers it, rosbag2's keys."""
        definition, type_hash = interface(type_name)
        with self._lock:
            return self._register(topic, type_name, definition, type_hash, qos or [])

    def _register(
        self, topic: str, type_name: str, definition: str, type_hash: str, offered: list[dict[str, Any]]
    ) -> Channel:
        schema = self._writer.register_schema(type_name, "ros2msg", definition.encode())
        number = self._writer.register_channel(
            topic, "cdr", schema,
            {"offered_qos_profiles": yaml.safe_dump(offered, sort_keys=False), "topic_type_hash": type_hash},
        )  # fmt: skip
        self._channels[topic] = Channel(topic, type_name, offered, number)
        return self._channels[topic]

    def write(self, channel: Channel, data: bytes, log_ns: int, publish_ns: int) -> None:
        """Queue one serialised message; never blocks."""
        self.queued += 1
        self._queue.append((channel, data, log_ns, publish_ns))

    def finish(self, complete: bool = True, reason: str = "") -> Written:
        """Write what is queued, metadata and index, and give the file its name.

        ``complete=False`` is for a session that ended early; the file is whole, and its metadata says so.
        """
        self._finishing.set()
        self._thread.join()
        result = Written(self.path, {c.topic: c.count for c in self._channels.values()}, self._start, self._end,
                         complete and not self._stopped, reason or self._stopped)  # fmt: skip
        description = self._bag_description()
        text = yaml.safe_dump(description, sort_keys=False)
        end = {"complete": str(result.complete).lower(), "reason": result.reason}
        self._writer.add_metadata("session", end)
        self._writer.add_metadata("rosbag2", {"serialized_metadata": yaml.safe_dump(
            description["rosbag2_bagfile_information"], sort_keys=False)})  # fmt: skip
        self._writer.finish()
        self._stream.close()
        self.part.rename(self.path)
        _write_beside(self.path, text)
        return result

    def _drain(self) -> None:
        """Write in batches: a thread that woke for each message would fight the callbacks for the interpreter."""
        while not self._finishing.wait(BATCH_PERIOD):
            self._write_queued()
        self._write_queued()

    def _write_queued(self) -> None:
        while self._queue:
            channel, data, log_ns, publish_ns = self._queue.popleft()
            if self._stopped:
                continue
            try:
                if self._total % DISK_CHECK_EVERY == 0:
                    self._check_disk()
                with self._lock:
                    self._writer.add_message(channel.number, log_ns, data, publish_ns, channel.count)
            except OSError as error:
                self._stopped = f"the file system refused to write ({error})"
                continue
            channel.count += 1
            self._total += 1
            self._start = log_ns if self._total == 1 else min(self._start, log_ns)
            self._end = max(self._end, log_ns)

    def _check_disk(self) -> None:
        free = shutil.disk_usage(self.path.parent).free
        if free < FREE_BYTES_NEEDED:
            self._stopped = f"disk nearly full ({free / 1e6:.0f} MB left); the log ends here, control goes on"

    def _bag_description(self) -> dict[str, Any]:
        """rosbag2's metadata.yaml, version 9."""
        start, duration = {"nanoseconds_since_epoch": self._start}, {"nanoseconds": self._end - self._start}
        topics = [
            {
                "topic_metadata": {
                    "name": c.topic,
                    "type": c.type,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": c.qos,
                    "type_description_hash": interface(c.type)[1],
                },
                "message_count": c.count,
            }
            for c in self._channels.values()
        ]
        information = {
            "version": ROSBAG2_VERSION,
            "storage_identifier": "mcap",
            "duration": duration,
            "starting_time": start,
            "message_count": self._total,
            "topics_with_message_count": topics,
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [self.path.name],
            "files": [
                {"path": self.path.name, "starting_time": start, "duration": duration, "message_count": self._total}
            ],
            "custom_data": None,
            "ros_distro": "jazzy",
        }
        return {"rosbag2_bagfile_information": information}


def _refuse_bad_target(path: Path) -> None:
    if path.suffix != ".mcap":
        raise InputError("a log's name must end in .mcap", where=path, remedy="choose another name")
    if path.exists():
        raise InputError("the log exists already", where=path, remedy="choose another name or move it away")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot create the folder ({error})", where=path.parent) from error


def _write_beside(path: Path, text: str) -> None:
    """metadata.yaml makes the folder a bag; one that describes another log is left alone."""
    target = path.with_name("metadata.yaml")
    if target.exists() and path.name not in target.read_text(encoding="utf-8"):
        return
    part = target.with_name("metadata.yaml.part")
    part.write_text(text, encoding="utf-8")
    part.rename(target)
