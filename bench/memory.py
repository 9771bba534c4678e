# SPDX-License-Identifier: Apache-2.0
"""Memory of every process over a long simulated session: ``python bench/memory.py --hours 8``.

A session in lockstep; every few seconds the resident memory of each process beside the simulated time. Prints a line a
process: at the end of the first tenth, at the end, and the slope between, fitted by least squares.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "test"))

from helpers.sessions import children

EVERY = 2.0  # s between looks
SETTLED = 0.1  # of the session, before which buffers and caches fill
MODULE = "pneumo_ros.cli.main"


def main() -> None:
    """Run the session and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=8.0, help="simulated")
    parser.add_argument("--patience", type=float, default=1e9, help="s after which it is ended by Ctrl-C")
    parser.add_argument("--single-process", action="store_true", help="all nodes in one process")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "session.mcap"
        command = [sys.executable, "-m", MODULE, "run", "--isolate", "--no-picture", "--no-report", "--duration",
                   str(options.hours * 3600.0), "--output", str(log)]  # fmt: skip
        command += ["--single-process"] if options.single_process else []
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        said: list[str] = []
        threading.Thread(target=lambda: said.extend(process.stdout or ()), daemon=True).start()
        rows = watched(process, log.with_name("session.mcap.part"), options.patience)
        process.wait(300)
        size = log.stat().st_size if log.exists() else 0
    print(f"exit code {process.returncode}, log of {size / 1e6:.0f} MB; {''.join(said).strip().splitlines()[-1:]}")
    show(rows)


def watched(process: subprocess.Popen[str], part: Path, patience: float) -> dict[str, list[tuple[float, float, float]]]:
    """Process name -> (s since the start, MB of log, MB resident) at each look."""
    start = time.monotonic()
    rows: dict[str, list[tuple[float, float, float]]] = {}
    while process.poll() is None:
        now = time.monotonic() - start
        if now > patience:
            process.send_signal(2)
            patience = float("inf")
        size = part.stat().st_size / 1e6 if part.exists() else 0.0
        for name, pid in {"supervisor": process.pid, **children(process.pid)}.items():
            if size and (memory := resident(pid)):
                rows.setdefault(name, []).append((now, size, memory))
        time.sleep(EVERY)
    return rows


def resident(pid: int) -> float:
    """MB of a process; 0 if it has gone."""
    try:
        return float(Path(f"/proc/{pid}/statm").read_text().split()[1]) * 4096 / 1e6
    except (OSError, IndexError):
        return 0.0


def show(rows: dict[str, list[tuple[float, float, float]]]) -> None:
    """One line a process; the log grows by the same amount each simulated second, so its size is the clock."""
    print("| process | MB after a tenth | MB at the end | slope, MB per 100 MB of log |\n|---|---|---|---|")
    for name, looks in rows.items():
        _, size, memory = np.array(looks).T
        late = size > SETTLED * size[-1]
        if late.sum() > 2:
            slope = np.polyfit(size[late], memory[late], 1)[0]
            print(f"| {name} | {memory[late][0]:.1f} | {memory[-1]:.1f} | {100.0 * slope:+.2f} |")


if __name__ == "__main__":
    main()
