# SPDX-License-Identifier: Apache-2.0
"""How much faster than real time a lockstep session runs, as five processes and in one, one run, medians.

Beside each session messages between nodes that compute nothing (bare_ring.py): the parcels of five processes, which is
what bare rclpy leaves them, and every topic by itself, which is all there is to compare one process with.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
from operator import truediv
from pathlib import Path

from bare_ring import GRAPHS, hops, ring

from pneumo_ros.log.reading import read_log
from pneumo_ros.log.topics import EVENTS
from pneumo_ros.nodes.neighbours import claim_place
from pneumo_ros.session.summary import load_session, wall_time

LIMITS = {"five processes": 4.0, "one process": 15.0}
RINGS = {"five processes": ("parcels", "topics"), "one process": ("topics",)}
RATE = 500.0  # Hz
SECONDS = 5.0  # of the bare ring


def speed(folder: Path, duration: float, single: bool) -> float:
    """Session time over wall time of one session."""
    log = folder / f"session-{len(list(folder.iterdir()))}.mcap"
    options = ["--single-process"] if single else []
    subprocess.run(
        [sys.executable, "-m", "pneumo_ros.cli.main", "run", "--isolate", "--duration", str(duration), "--no-picture",
         "--output", str(log), *options],
        check=True, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    return float(load_session(log).time[-1]) / wall_time(read_log(log, [EVENTS.name]))


def bare(graph: str, single: bool) -> float:
    """The same factor of a ring."""
    claim = claim_place(None, "", isolate=True, what="a bare ring of messages")
    try:
        return ring(claim.domain, SECONDS, graph, single) / RATE
    finally:
        claim.release()


def main() -> None:
    """Print the factors of sessions, their limits, and what bare rclpy reaches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--duration", type=float, default=20.0, help="s of session")
    arguments = parser.parse_args()
    sessions: dict[str, list[float]] = {name: [] for name in LIMITS}
    rings: dict[tuple[str, str], list[float]] = {(name, graph): [] for name in LIMITS for graph in RINGS[name]}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(arguments.rounds):
            for name in LIMITS:
                single = name == "one process"
                for graph in RINGS[name]:
                    rings[name, graph].append(bare(graph, single))
                sessions[name].append(speed(Path(folder), arguments.duration, single))
    for name, factors in sessions.items():
        print(f"{name:15s} {statistics.median(factors):5.1f} x real time ({min(factors):.1f} to {max(factors):.1f}; "
              f"limit {LIMITS[name]:.0f})")  # fmt: skip
        for graph in RINGS[name]:
            bares, messages = rings[name, graph], hops(GRAPHS[graph])
            factor, ratio = statistics.median(bares), statistics.median(map(truediv, bares, factors))
            print(f"  bare {graph:8s} {factor:5.1f} x real time ({min(bares):.1f} to {max(bares):.1f}), {messages:.1f} "
                  f"messages a period reach a subscriber, {1e6 / (RATE * factor * messages):.1f} us each; "
                  f"{ratio:.2f} times as fast as the session")  # fmt: skip


if __name__ == "__main__":
    main()
