# SPDX-License-Identifier: Apache-2.0
"""Write a session log: raw CDR to MCAP in a thread of its own, complete or visibly not.

A zstd chunk takes milliseconds to compress (10 ms at 768 KiB), so nothing of it may happen in a callback. The file
grows as ``<name>.part`` and gets its name only when footer, metadata and index are in.
"""

from __future__ import annotations

import os
import shutil
import struct
import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from io import FileIO
from pathlib import Path
from typing import Any

import yaml
from rosbags.typesys import Stores, get_typestore

from pneumo_ros import __version__
from pneumo_ros.errors import InputError
from pneumo_ros.files import new_file
from pneumo_ros.log.cdr import stamp_of
from pneumo_ros.log.chunks import ChunkedWriter

CHUNK_BYTES = 192 * 1024  # the writer closes a chunk after the message that exceeds this; every one stays below 256 KiB
FREE_BYTES_NEEDED = 64 * 1024 * 1024  # below this the file is finished while there is room for its index
RESERVED = 1 << 20  # bytes; the index of an hour takes half of it
DISK_CHECK_EVERY = 4096  # messages
BATCH_PERIOD = 0.05  # s between batches of the writing thread
ROSBAG2_VERSION = 9
PROFILE = "ros2"
UNWRITTEN = 0  # number of a channel that the file system refused
AT_STAMP = -1  # as a log time: the message's own header.stamp
AT_LATEST = -2  # as a log time: that of the message before it


@lru_cache(maxsize=64)
def interface(type_name: str) -> tuple[str, str]:
    """(full ros2msg definition, RIHS01 type hash) of an interface, for example ``sensor_msgs/msg/JointState``."""
    store = get_typestore(Stores.ROS2_JAZZY)
    return store.generate_msgdef(type_name, ros_version=2)[0], store.hash_rihs01(type_name)


@dataclass(frozen=True)
class Channel:
    """A topic in the file."""

    topic: str
    type: str
    qos: list[dict[str, Any]]
    number: int


@dataclass
class Written:
    """What a finished file holds."""

    path: Path
    counts: dict[str, int] = field(default_factory=dict)
    start_ns: int = 0
    end_ns: int = 0
    complete: bool = True
    reason: str = ""


class _Written(yaml.SafeDumper):
    """YAML that says everything where it belongs: our own reader refuses aliases."""

    def ignore_aliases(self, data: object) -> bool:
        """A value that occurs twice is written twice."""
        return True


class LogWriter:
    """A session log being written.

    Parameters
    ----------
    path : final name of the file (.mcap)
    metadata : name -> (key -> text) records that explain the run (config, seeds, versions ...); written first, so that
        a log whose recorder was killed still explains itself
    bag_folder : write rosbag2's metadata.yaml beside it, so that ``ros2 bag`` takes the folder of a session. The file
        itself carries the same record, which is all that a lone .mcap needs: False where the folder is not the log's

    :meth:`write` only queues; a thread does the rest. :meth:`finish` must be called, also after an error.

    Raises
    ------
    InputError
        if the file exists or cannot be created.
    """

    def __init__(
        self, path: Path, metadata: Mapping[str, Mapping[str, str]] | None = None, bag_folder: bool = True
    ) -> None:
        self.path, self.bag_folder = path, bag_folder
        self.part = path.with_name(path.name + ".part")
        _refuse_bad_target(path)
        self._channels: dict[str, Channel] = {}
        self._schemas: dict[str, int] = {}
        self._stream = _new_stream(self.part)
        self._reserve = path.with_name(f".{path.name}.reserve")
        _reserve(self._reserve)
        self._writer = ChunkedWriter(self._stream, PROFILE, f"pneumo_ros {__version__}", CHUNK_BYTES)
        for name, values in (metadata or {}).items():
            self._writer.add_metadata(name, values)
        self._writer.flush()
        self._queue: deque[tuple[Channel, bytes, int]] = deque()
        self._finishing = threading.Event()
        self._lock = threading.Lock()  # topics are registered by callbacks while the thread writes
        self._total = self._latest = 0
        self._stopped = self._disorder = ""
        self._steps: dict[int, int] = {}
        self._stamps: dict[int, int] = {}
        self._thread = threading.Thread(target=self._drain, name="log-writer", daemon=True)
        self._thread.start()

    @property
    def stopped(self) -> str:
        """Why nothing is written any more ('' while all is well): disk full or an error of the file system."""
        return self._stopped

    @property
    def disorder(self) -> str:
        """Which topic's stamps first failed to rise as they must ('' while all do)."""
        return self._disorder

    def add_topic(
        self, topic: str, type_name: str, qos: list[dict[str, Any]] | None = None, step_ns: int | None = None
    ) -> Channel:
        """Register a topic before its first message.

        ``qos`` as the publisher offers it, rosbag2's keys; ``step_ns`` for messages with a header whose stamps must
        rise: by exactly so much, or by any amount if 0 (:attr:`disorder`). What repeats or goes back is not written.
        """
        definition, type_hash = interface(type_name)
        with self._lock:
            channel = self._register(topic, type_name, definition, type_hash, qos or [])
            if step_ns is not None:
                self._steps[channel.number] = step_ns
            return channel

    def _register(
        self, topic: str, type_name: str, definition: str, type_hash: str, offered: list[dict[str, Any]]
    ) -> Channel:
        described = {
            "offered_qos_profiles": yaml.safe_dump(offered, sort_keys=False),
            "topic_type_hash": type_hash,
        }
        number = UNWRITTEN
        try:
            if type_name not in self._schemas:
                self._schemas[type_name] = self._writer.add_schema(type_name, "ros2msg", definition.encode())
            number = self._writer.add_channel(topic, "cdr", self._schemas[type_name], described)
        except OSError as error:  # the session learns it from :attr:`stopped`, and goes on or ends as it is told to
            self._stopped = self._stopped or f"the file system refused to write ({error})"
        self._channels[topic] = Channel(topic, type_name, offered, number)
        return self._channels[topic]

    @property
    def received(self) -> int:
        """Messages taken so far, written or waiting."""
        return self._total + len(self._queue)

    def write(self, channel: Channel, data: bytes, log_ns: int = AT_STAMP) -> None:
        """Queue one serialised message; never blocks. ``log_ns`` may be :data:`AT_STAMP` or :data:`AT_LATEST`."""
        self._queue.append((channel, data, log_ns))

    def taker(self, channel: Channel, log_ns: int) -> Callable[[bytes], None]:
        """A callback that queues what it is given; the least that can be done with a message."""
        append = self._queue.append
        return lambda data: append((channel, data, log_ns))

    def finish(self, complete: bool = True, reason: str = "") -> Written:
        """Write what is queued, metadata and index, and give the file its name.

        ``complete=False`` is for a session that ended early; the file is whole, and its metadata says so.
        """
        self._finishing.set()
        self._thread.join()
        self._reserve.unlink(missing_ok=True)
        self._attempt(self._writer.flush)
        counts = self._writer.counts
        result = Written(
            self.path,
            {c.topic: counts[c.number] for c in self._channels.values() if c.number != UNWRITTEN},
            *self._writer.span_ns,
            complete and not self._stopped,
            reason or self._stopped,
        )
        description = self._bag_description(result)
        text = yaml.dump(description, Dumper=_Written, sort_keys=False)
        end = {"complete": str(result.complete).lower(), "reason": result.reason}
        own = yaml.dump(description["rosbag2_bagfile_information"], Dumper=_Written, sort_keys=False)
        self._attempt(lambda: self._writer.add_metadata("session", end))
        self._attempt(lambda: self._writer.add_metadata("rosbag2", {"serialized_metadata": own}))
        if self._attempt(self._writer.finish):  # a file without its end keeps the name of an unfinished one
            self._attempt(self._name)
        self._stream.close()
        if not self.path.exists():
            remedy = f"pneumo log recover {self.part.name} keeps what is readable"
            return replace(result, path=self.part, complete=False, reason=f"{result.reason or self._stopped}; {remedy}")
        if self.bag_folder and not self._stopped:
            _write_beside(self.path, text)
        if self._stopped:
            return replace(result, complete=False, reason=result.reason or self._stopped)
        return result

    def _attempt(self, step: Callable[[], object]) -> bool:
        """Whether a step that the file system may refuse was done: what is written stays, and the reason is kept."""
        try:
            step()
        except OSError as error:
            self._stopped = self._stopped or f"the file system refused to write ({error})"
            return False
        return True

    def _name(self) -> None:
        """Give the file its name; one whose folder was removed meanwhile is written again from what is still open."""
        try:
            self.part.rename(self.path)
        except FileNotFoundError:
            self._stopped = self._stopped or "the folder was removed while the log was written; it was made anew"
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._stream.seek(0)
            with new_file(self.path) as part, part.open("wb") as copy:
                shutil.copyfileobj(self._stream, copy)

    def _drain(self) -> None:
        """Write in batches: a thread that woke for each message would fight the callbacks for the interpreter."""
        try:
            while not self._finishing.wait(BATCH_PERIOD):
                self._write_queued()
            self._write_queued()
        except Exception as error:  # whatever ends this thread ends the log: it must not look complete
            self._stopped = f"writing failed ({error!r}); the log ends here, control goes on"
            raise

    def _write_queued(self) -> None:
        queue, add = self._queue, self._writer.add_message
        with self._lock:
            while queue:
                channel, data, log_ns = queue.popleft()
                self._total += 1
                stepped = channel.number in self._steps
                try:
                    stamp = stamp_of(data) if stepped or log_ns == AT_STAMP else 0
                except struct.error:  # any process may send bytes of whatever length
                    self._disorder = self._disorder or f"a message of {channel.topic} ends before its stamp does"
                    continue
                if log_ns == AT_STAMP:
                    log_ns = stamp
                elif log_ns == AT_LATEST:
                    log_ns = self._latest
                self._latest = log_ns
                if stepped and not self._in_order(channel, stamp):
                    continue
                if self._total % DISK_CHECK_EVERY == 1:
                    self._check_disk()
                if self._stopped:
                    continue
                try:
                    add(channel.number, log_ns, data, log_ns)
                except OSError as error:
                    self._stopped = f"the file system refused to write ({error})"
                    self._reserve.unlink(missing_ok=True)

    def _in_order(self, channel: Channel, stamp: int) -> bool:
        """Whether a message is later than the one before it; one that is not has another sender, and is not written.

        After a gap the log goes on: what was lost is no reason to lose the rest.
        """
        last, step = self._stamps.get(channel.number), self._steps[channel.number]
        later = last is None or stamp > last
        if later:
            self._stamps[channel.number] = stamp
        if not self._disorder and last is not None and (stamp != last + step if step else not later):
            what = "leaves a gap" if later else "repeats" if stamp == last else "goes back"
            self._disorder = f"the stamp of {channel.topic} {what}: {stamp} ns after {last} ns"
        return later

    def _check_disk(self) -> None:
        try:
            free = shutil.disk_usage(self.path.parent).free
        except OSError as error:
            self._stopped = f"the folder is gone ({error}); the log ends here, control goes on"
            return
        if free < FREE_BYTES_NEEDED:
            self._stopped = f"disk nearly full ({free / 1e6:.0f} MB left); the log ends here, control goes on"

    def _bag_description(self, written: Written) -> dict[str, Any]:
        """rosbag2's metadata.yaml, version 9."""
        start = {"nanoseconds_since_epoch": written.start_ns}
        duration = {"nanoseconds": written.end_ns - written.start_ns}
        total = sum(written.counts.values())
        topics = [
            {
                "topic_metadata": {
                    "name": c.topic,
                    "type": c.type,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": c.qos,
                    "type_description_hash": interface(c.type)[1],
                },
                "message_count": written.counts[c.topic],
            }
            for c in self._channels.values()
            if c.topic in written.counts
        ]
        information = {
            "version": ROSBAG2_VERSION,
            "storage_identifier": "mcap",
            "duration": duration,
            "starting_time": start,
            "message_count": total,
            "topics_with_message_count": topics,
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [self.path.name],
            "files": [{"path": self.path.name, "starting_time": start, "duration": duration, "message_count": total}],
            "custom_data": None,
            "ros_distro": "jazzy",
        }
        return {"rosbag2_bagfile_information": information}


def _new_stream(part: Path) -> FileIO:
    """The growing file, never through a link; readable too, should its folder vanish."""
    try:
        return FileIO(part, "w+", opener=lambda name, flags: os.open(name, flags | os.O_NOFOLLOW, 0o666))
    except OSError as error:
        raise InputError(f"cannot create the log ({error})", where=part, remedy="choose another folder") from error


def _reserve(path: Path) -> None:
    """Room for the end of the file, given back when the disk is full: the log then ends with its index."""
    with new_file(path) as part, part.open("wb") as stream:
        try:
            os.posix_fallocate(stream.fileno(), 0, RESERVED)
        except OSError:  # no room for it, or a file system without: the log goes on without a reserve
            stream.truncate(0)


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
    if target.exists() and f"- {path.name}\n" not in target.read_text(encoding="utf-8"):
        return
    with new_file(target) as part:
        part.write_text(text, encoding="utf-8")
