# SPDX-License-Identifier: Apache-2.0
"""A whole lockstep session recorded by the chunk writer of pneumo_ros.log.chunks and by mcap's own Writer.

    python bench/chunk_writer.py [--rounds N] [--duration S]

The two take turns, so that both see the same machine. The recorder's process is given the writer before it starts.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from io import BufferedWriter, FileIO
from pathlib import Path

from mcap.writer import CompressionType, Writer

from pneumo_ros.log.chunks import ChunkedWriter
from pneumo_ros.session.summary import load_session, wall_time

LIMIT = 0.03  # of a session's speed that our own writer must gain to be kept
# Imported by every Python process of the session before anything else.
START = """
import sys
sys.path.insert(0, {bench!r})
import chunk_writer
import pneumo_ros.log.chunks
pneumo_ros.log.chunks.ChunkedWriter = chunk_writer.{writer}
"""


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


WRITERS = {"own": ChunkedWriter, "library": LibraryWriter}


def speed(folder: Path, name: str, duration: float, single: bool) -> float:
    """Session time over wall time."""
    log = folder / f"{name}-{len(list(folder.glob('*.mcap')))}.mcap"
    options = ["--single-process"] if single else []
    path = os.pathsep.join([str(folder / name), os.environ.get("PYTHONPATH", "")])
    subprocess.run(
        [sys.executable, "-m", "pneumo_ros.cli.main", "run", "--isolate", "--duration", str(duration), "--no-picture",
         "--no-report", "--no-summary", "--output", str(log), *options],
        check=True, stdout=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    return float(load_session(log).time[-1]) / wall_time(log)


def main() -> None:
    """Print the speeds and what our own writer gains."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--duration", type=float, default=20.0, help="s of session")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for kind, writer in WRITERS.items():
            (folder / kind).mkdir()
            text = START.format(bench=str(Path(__file__).parent), writer=writer.__name__)
            (folder / kind / "sitecustomize.py").write_text(text)
        for single in (True, False):
            found: dict[str, list[float]] = {kind: [] for kind in WRITERS}
            for turn in range(arguments.rounds):
                for kind in sorted(WRITERS, reverse=bool(turn % 2)):
                    found[kind].append(speed(folder, kind, arguments.duration, single))
            gains = [own / library - 1.0 for own, library in zip(found["own"], found["library"], strict=True)]
            both = ", ".join(f"{kind} {statistics.median(values):.2f}" for kind, values in found.items())
            where = "one process" if single else "five processes"
            print(f"{where}: {both} x real time; own gains {100 * statistics.median(gains):.1f} % "
                  f"({100 * min(gains):.1f} to {100 * max(gains):.1f}; kept from {100 * LIMIT:.0f} % on)")  # fmt: skip


if __name__ == "__main__":
    main()
