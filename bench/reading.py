# SPDX-License-Identifier: Apache-2.0
"""Opening a log of a million messages into arrays, beside the generic reader on the same data: speed, memory."""

from __future__ import annotations

import argparse
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from mcap.writer import Writer

from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointEncoder, PressureEncoder
from pneumo_ros.log.writing import interface

LIMIT_SECONDS, LIMIT_MEGABYTES = 2.0, 500.0
SAMPLE_TOPICS = (topics.ROAD, topics.DISPLACEMENT, topics.FRONT_PRESSURE, topics.REAR_PRESSURE, topics.COMMAND)
PERIOD_NS = 2_000_000
SLOW_SHARE = 20  # the generic reader gets one message of so many, or a round would take half a minute


def make_log(path: Path, messages: int) -> None:
    """A log as a session's: five topics, numbers that do not compress."""
    rng = np.random.default_rng(1)
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "bench")
        channels = []
        for topic in SAMPLE_TOPICS:
            schema = writer.register_schema(topic.type, "ros2msg", interface(topic.type)[0].encode())
            channels.append(writer.register_channel(topic.name, "cdr", schema))
        encoders = [
            JointEncoder(t.frame_id, t.names, t.rates).encode if t.type == topics.JOINT
            else PressureEncoder(t.frame_id, 1.0).encode
            for t in SAMPLE_TOPICS
        ]  # fmt: skip
        for i in range(messages // len(SAMPLE_TOPICS)):
            stamp, values = i * PERIOD_NS, rng.standard_normal(4).tolist()
            for topic, channel, encode in zip(SAMPLE_TOPICS, channels, encoders, strict=True):
                given = values[0] if topic.type != topics.JOINT else values[: len(topic.names)]
                extra = (given,) if topic.rates else ()
                writer.add_message(channel, stamp, encode(stamp, given, *extra), stamp, i)
        writer.finish()


def once(path: Path, reader: str) -> None:
    """Read in a process of its own and print seconds and the most memory it held."""
    start = time.perf_counter()
    if reader == "bulk":
        from pneumo_ros.log.reading import read_log

        log = read_log(path)
        count = sum(len(log.columns(name).stamp_ns) for name in log.topics)
    else:
        from rosbags.highlevel import AnyReader

        with AnyReader([path]) as bag:
            count = sum(bag.deserialize(raw, c.msgtype) is not None for c, _, raw in bag.messages())
    took = time.perf_counter() - start
    print(took, count, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)


def measure(path: Path, reader: str) -> tuple[float, float, float]:
    """(seconds, messages, MB) of one run."""
    command = [sys.executable, __file__, "--once", str(path), "--reader", reader]
    words = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    return float(words[0]), float(words[1]), float(words[2])


def main() -> None:
    """Print both readers' figures and the limits."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--once", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--reader", default="bulk", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.once:
        once(arguments.once, arguments.reader)
        return
    with tempfile.TemporaryDirectory() as folder:
        large, small = Path(folder) / "large.mcap", Path(folder) / "small.mcap"
        make_log(large, arguments.messages)
        make_log(small, arguments.messages // SLOW_SHARE)
        ours, theirs = [], []
        for _ in range(arguments.rounds):
            ours.append(measure(large, "bulk"))
            theirs.append(measure(small, "generic"))
    seconds, memory = statistics.median(o[0] for o in ours), max(o[2] for o in ours)
    rates = [statistics.median(r[1] / r[0] for r in runs) for runs in (ours, theirs)]
    print(f"bulk     {ours[0][1]:.0f} messages in {seconds:.2f} s (limit {LIMIT_SECONDS:g}), {memory:.0f} MB"
          f" (limit {LIMIT_MEGABYTES:g}), {rates[0] / 1e3:.0f} k/s")  # fmt: skip
    print(f"generic  {rates[1] / 1e3:.0f} k/s with rosbags; bulk is {rates[0] / rates[1]:.0f} times as fast")


if __name__ == "__main__":
    main()
