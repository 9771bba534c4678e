# SPDX-License-Identifier: Apache-2.0
"""How much faster than real time a lockstep session runs, as five processes and in one, one run, medians."""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from pneumo_ros.session.summary import load_session, wall_time

LIMITS = {"five processes": 4.0, "one process": 15.0}


def speed(folder: Path, duration: float, single: bool) -> float:
    """Session time over wall time of one 500 Hz session."""
    log = folder / f"session-{len(list(folder.iterdir()))}.mcap"
    options = ["--single-process"] if single else []
    subprocess.run(
        [sys.executable, "-m", "pneumo_ros.cli.main", "run", "--isolate", "--duration", str(duration), "--no-picture",
         "--output", str(log), *options],
        check=True, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    return float(load_session(log).time[-1]) / wall_time(log)


def main() -> None:
    """Print both factors and their limits."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--duration", type=float, default=20.0, help="s of session")
    arguments = parser.parse_args()
    factors: dict[str, list[float]] = {name: [] for name in LIMITS}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(arguments.rounds):
            for name, values in factors.items():
                values.append(speed(Path(folder), arguments.duration, name == "one process"))
    for name, values in factors.items():
        spread = f"{min(values):.1f} to {max(values):.1f}"
        print(f"{name:15s} {statistics.median(values):5.1f} x real time ({spread}; limit {LIMITS[name]:.0f})")


if __name__ == "__main__":
    main()
