# SPDX-License-Identifier: Apache-2.0
"""Mutated logs and configurations through every reader: ``python bench/fuzz_logs.py --logs 10000 --configs 500``."""

from __future__ import annotations

import argparse
import sys
import tempfile
import traceback
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "test"))

from helpers.fuzz import mutated_config, mutated_log, read_everything


def main() -> None:
    """Count what became of each; print every seed that ended in anything but an answer or one line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=10_000)
    parser.add_argument("--configs", type=int, default=500)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    wanted = parser.parse_args()
    failures = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for what, count in (("logs", wanted.logs), ("configs", wanted.configs)):
            outcomes: Counter[str] = Counter()
            for seed in range(wanted.first, wanted.first + count):
                try:
                    outcome = (read_everything(mutated_log(seed), folder) if what == "logs"
                               else mutated_config(seed, folder))  # fmt: skip
                except BaseException as error:  # a finding is anything that is not an answer
                    if isinstance(error, KeyboardInterrupt):
                        raise
                    last = traceback.extract_tb(error.__traceback__)[-1]
                    print(f"{what} seed {seed}: {type(error).__name__}: {error} ({last.filename}:{last.lineno})")
                    outcome, failures = "failed", failures + 1
                outcomes[outcome] += 1
            print(f"{count} mutated {what}: {dict(outcomes)}")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
