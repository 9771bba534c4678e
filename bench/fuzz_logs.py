# SPDX-License-Identifier: Apache-2.0
"""Mutated logs and configurations through every reader: ``python bench/fuzz_logs.py --logs 10000 --configs 500``.

A finding is anything but an answer or an error of one line: a traceback, more than :data:`PATIENCE` of computing, more
memory than :data:`MEMORY` beyond the readers' own. With ``--results FILE`` seeds that are in that file already are not
tried again.
"""

from __future__ import annotations

import argparse
import json
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "test"))

from helpers.fuzz import base_log, mutated_config, mutated_log, read_everything

PATIENCE = 30.0  # s of this process's own time for one log through all readers
MEMORY = 400.0  # MB that any may add to the process


def main() -> None:
    """Count what became of each; print every seed that ended in a finding."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=10_000)
    parser.add_argument("--configs", type=int, default=500)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--results", type=Path, help="file of outcomes, a line each, that is read first and added to")
    wanted = parser.parse_args()
    found = known(wanted.results)
    signal.signal(signal.SIGVTALRM, _too_long)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        read_everything(base_log(), folder)  # modules and kernels are in memory before anything is measured
        for what, count in (("logs", wanted.logs), ("configs", wanted.configs)):
            for seed in range(wanted.first, wanted.first + count):
                if (what, seed) in found:
                    continue
                found[what, seed] = tried(what, seed, folder)
                if wanted.results is not None:
                    with wanted.results.open("a") as stream:
                        stream.write(json.dumps([what, seed, found[what, seed]]) + "\n")
    sys.exit(1 if summary(found) else 0)


def tried(what: str, seed: int, folder: Path) -> dict[str, Any]:
    """Outcome, seconds of this process's time and growth of its largest memory, MB, by one mutation."""
    before, began = peak(), time.process_time()
    said = ""
    try:
        with limited():
            outcome = read_everything(mutated_log(seed), folder) if what == "logs" else mutated_config(seed, folder)
    except BaseException as error:  # a finding is anything that is not an answer
        if isinstance(error, KeyboardInterrupt):
            raise
        last = traceback.extract_tb(error.__traceback__)[-1]
        outcome, said = "failed", f"{type(error).__name__}: {error} ({last.filename}:{last.lineno})"
    seconds, grown = time.process_time() - began, peak() - before
    if outcome != "failed" and grown > MEMORY:
        outcome, said = "failed", f"{grown:.0f} MB more"
    return {"outcome": outcome, "seconds": round(seconds, 3), "grown": round(grown, 1), "said": said}


@contextmanager
def limited() -> Iterator[None]:
    """An end after :data:`PATIENCE`, in this process's own time, so that a loaded computer makes no findings."""
    signal.setitimer(signal.ITIMER_VIRTUAL, PATIENCE)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)


def _too_long(number: int, frame: object) -> None:
    raise TimeoutError(f"more than {PATIENCE} s")


def peak() -> float:
    """Largest resident memory of this process so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def known(results: Path | None) -> dict[tuple[str, int], dict[str, Any]]:
    """What an earlier run found."""
    if results is None or not results.exists():
        return {}
    return {(what, seed): one for what, seed, one in map(json.loads, results.read_text().splitlines())}


def summary(found: dict[tuple[str, int], dict[str, Any]]) -> int:
    """Print the counts and every finding; their number."""
    for kind in ("logs", "configs"):
        rows = {seed: one for (what, seed), one in found.items() if what == kind}
        if not rows:
            continue
        slowest = max(rows, key=lambda seed: float(rows[seed]["seconds"]))
        grown = sum(float(one["grown"]) for one in rows.values())
        print(f"{len(rows)} mutated {kind}: {dict(Counter(one['outcome'] for one in rows.values()))}; the slowest "
              f"{rows[slowest]['seconds']} s (seed {slowest}); memory grew by {grown:.0f} MB in all")  # fmt: skip
    failed = {key: one["said"] for key, one in found.items() if one["outcome"] == "failed"}
    for (what, seed), said in failed.items():
        print(f"{what} seed {seed}: {said}")
    return len(failed)


if __name__ == "__main__":
    main()
