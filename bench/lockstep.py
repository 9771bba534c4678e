# SPDX-License-Identifier: Apache-2.0
"""How much faster than real time a lockstep session runs, as five processes and in one, one run, medians.

Beside each session the same messages between nodes that compute nothing (bare_ring.py): what bare rclpy leaves.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from bare_ring import HOPS, ring

from pneumo_ros.log.reading import read_log
from pneumo_ros.log.topics import EVENTS
from pneumo_ros.nodes.neighbours import claim_place
from pneumo_ros.session.summary import load_session, wall_time

LIMITS = {"five processes": 4.0, "one process": 15.0}
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


def bare(single: bool) -> float:
    """The same factor of the ring."""
    claim = claim_place(None, "", isolate=True, what="a bare ring of messages")
    try:
        return ring(claim.domain, SECONDS, single) / RATE
    finally:
        claim.release()


def main() -> None:
    """Print both factors, their limits, and what bare rclpy reaches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--duration", type=float, default=20.0, help="s of session")
    arguments = parser.parse_args()
    factors: dict[str, list[tuple[float, float]]] = {name: [] for name in LIMITS}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(arguments.rounds):
            for name, values in factors.items():
                single = name == "one process"
                values.append((bare(single), speed(Path(folder), arguments.duration, single)))
    print(f"{HOPS:.1f} messages a period reach a subscriber")
    for name, values in factors.items():
        bares, sessions = zip(*values, strict=True)
        ratio = statistics.median(b / s for b, s in values)
        hop = 1e6 / (RATE * statistics.median(bares) * HOPS)
        print(f"{name:15s} {statistics.median(sessions):5.1f} x real time ({min(sessions):.1f} to {max(sessions):.1f}; "
              f"limit {LIMITS[name]:.0f}); bare {statistics.median(bares):.1f} x ({hop:.1f} us a hop), "
              f"{ratio:.2f} times as fast as the session")  # fmt: skip


if __name__ == "__main__":
    main()
