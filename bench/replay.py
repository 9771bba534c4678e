# SPDX-License-Identifier: Apache-2.0
"""How much faster than real time stepped replay runs at 500 Hz, and how punctual live replay is; one run, medians."""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from pneumo_ros.log.reading import read_log
from pneumo_ros.session.replay import replay, warm_up

LIMIT = 20.0  # times real time


def record(folder: Path, duration: float) -> Path:
    """A lockstep session of 500 Hz."""
    log = folder / "session.mcap"
    command = [sys.executable, "-m", "pneumo_ros.cli.main", "run", "--duration", str(duration), "--single-process",
               "--no-picture", "--no-report", "--output", str(log)]  # fmt: skip
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return log


def stepped(path: Path) -> tuple[float, bool]:
    """(times real time, whether every byte was equal) of reading the log and stepping it."""
    start = time.perf_counter()
    result = replay(read_log(path))
    took = time.perf_counter() - start
    span = (result.estimate.stamp_ns[-1] - result.estimate.stamp_ns[0]) * 1e-9
    return float(span / took), all(a.identical for a in result.agreements)


def live(path: Path) -> str:
    """What live replay says of its own punctuality."""
    command = [sys.executable, "-m", "pneumo_ros.cli.main", "replay", str(path)]
    said = subprocess.run(command, check=True, capture_output=True, text=True, stdin=subprocess.DEVNULL).stdout
    return said.strip().splitlines()[-1]


def main() -> None:
    """Print the factor with its limit, and the lateness of live messages."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--duration", type=float, default=20.0, help="s of session")
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        log = record(Path(folder), arguments.duration)
        warm_up(read_log(log))
        runs = [stepped(log) for _ in range(arguments.rounds)]
        factors = [factor for factor, _ in runs]
        equal = "equal bytes" if all(same for _, same in runs) else "DIFFERENT BYTES"
        print(f"stepped  {statistics.median(factors):.1f} x real time ({min(factors):.1f} to {max(factors):.1f};"
              f" limit {LIMIT:g}), {equal}")  # fmt: skip
        print(f"live     {live(log)}")


if __name__ == "__main__":
    main()
