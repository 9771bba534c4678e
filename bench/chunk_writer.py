# SPDX-License-Identifier: Apache-2.0
"""A whole lockstep session recorded by the chunk writer of pneumo_ros.log.chunks and by mcap's own Writer.

    python bench/chunk_writer.py [--rounds N] [--duration S]

The two take turns, so that both see the same machine. The recorder's process is given the writer before it starts.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from io import BufferedWriter, FileIO
from pathlib import Path

from mcap.writer import CompressionType, Writer

from pneumo_ros.log.chunks import ChunkedWriter
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.topics import EVENTS
from pneumo_ros.session.summary import load_session, wall_time

LIMIT = 0.03  # of a session's speed that our own writer must gain to be kept
# Imported by every Python process of the session before anything else.
START = """
import sys
sys.path.insert(0, {bench!r})
import chunk_writer
import pneumo_ros.log.chunks
pneumo_ros.log.chunks.ChunkedWriter = chunk_writer.{writer}
import pneumo_ros.log.writing
drain = pneumo_ros.log.writing.LogWriter._drain
def timed(self):
    drain(self)
    chunk_writer.tell()
pneumo_ros.log.writing.LogWriter._drain = timed
"""
TOLD = "CHUNK_WRITER_TIME"  # file that the writing thread's processor time is told in


class LibraryWriter:
    """mcap's Writer with the methods of :class:`pneumo_ros.log.chunks.ChunkedWriter`."""

    def __init__(self, stream: FileIO, profile: str, library: str, chunk_bytes: int) -> None:
        self._stream = BufferedWriter(stream)
        self._writer = Writer(
            self._stream, chunk_size=chunk_bytes, compression=CompressionType.ZSTD, enable_data_crcs=True
        )
        self._writer.start(profile, library)
        self.counts: dict[int, int] = {}
        self.span_ns = (0, 0)

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Id of the schema."""
        return int(self._writer.register_schema(name, encoding, data))

    def add_channel(self, topic: str, encoding: str, schema: int, metadata: Mapping[str, str]) -> int:
        """Id of the channel."""
        number = int(self._writer.register_channel(topic, encoding, schema, dict(metadata)))
        self.counts[number] = 0
        return number

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """A metadata record."""
        self._writer.add_metadata(name, dict(values))

    def add_message(self, channel: int, log_ns: int, data: bytes, publish_ns: int) -> None:
        """One message."""
        count = self.counts[channel]
        self.counts[channel] = count + 1
        self._writer.add_message(channel, log_ns, data, publish_ns, count)
        first, last = self.span_ns
        self.span_ns = (min(first or log_ns, log_ns), max(last, log_ns))

    def flush(self) -> None:
        """To the system."""
        self._stream.flush()

    def finish(self) -> None:
        """Index and footer."""
        self._writer.finish()
        self._stream.flush()
        self._stream.detach()


def tell() -> None:
    """Processor time of this thread, s."""
    Path(os.environ[TOLD]).write_text(str(time.thread_time()))


WRITERS = {"own": ChunkedWriter, "library": LibraryWriter}


def session(folder: Path, name: str, duration: float, single: bool) -> tuple[float, float, float]:
    """Session time over wall time; processor time of all its processes, and of the thread that writes, s."""
    number = len(list(folder.glob("*.mcap")))
    log, told = folder / f"{name}-{number}.mcap", folder / f"{name}-{number}.txt"
    options = ["--single-process"] if single else []
    path = os.pathsep.join([str(folder / name), os.environ.get("PYTHONPATH", "")])
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-m", "pneumo_ros.cli.main", "run", "--isolate", "--duration", str(duration), "--no-picture",
         "--no-report", "--no-summary", "--output", str(log), *options],
        check=True, stdout=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": path, TOLD: str(told)},
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return float(load_session(log).time[-1]) / wall_time(read_log(log, [EVENTS.name])), used, float(told.read_text())


def report(where: str, found: dict[str, list[tuple[float, float, float]]], started: float) -> None:
    """Speeds, and processor times of a session without what its start costs."""
    medians = {kind: [statistics.median(column) for column in zip(*rows, strict=True)] for kind, rows in found.items()}
    for kind, (speed, used, written) in medians.items():
        print(f"{where}, {kind}: {speed:.1f} x real time; {used - started:.2f} s of the processor, "
              f"{written:.2f} s of them writing")  # fmt: skip
    (_, used, own), (_, _, library) = medians["own"], medians["library"]
    print(f"  the library's writing would make it {100 * (library - own) / (used - started):.0f} % more "
          f"(our own is kept from {100 * LIMIT:.0f} % on)")  # fmt: skip


def main() -> None:
    """Print the speeds and what our own writer gains."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--duration", type=float, default=40.0, help="s of session")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for kind, writer in WRITERS.items():
            (folder / kind).mkdir()
            text = START.format(bench=str(Path(__file__).parent), writer=writer.__name__)
            (folder / kind / "sitecustomize.py").write_text(text)
        for single in (True, False):
            found: dict[str, list[tuple[float, float, float]]] = {kind: [] for kind in WRITERS}
            started = min(session(folder, "own", 0.1, single)[1] for _ in range(2))
            for number in range(arguments.rounds):
                for kind in sorted(WRITERS, reverse=bool(number % 2)):
                    found[kind].append(session(folder, kind, arguments.duration, single))
            report("one process" if single else "five processes", found, started)


if __name__ == "__main__":
    main()
