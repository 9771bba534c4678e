# SPDX-License-Identifier: Apache-2.0
"""Peak memory of every verb on every bomb of the tests, and on real logs: ``python bench/bombs.py [LOG...]``.

Prints the table of docs/logs.md.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "test"))

from helpers.bombs import BOMBS, run, verbs

LIVE = ("replay (live)", "view")  # they do not end by themselves on a log that can be read


def main() -> None:
    """One row a verb: the largest peak over all bombs, how many ended in one line, any traceback."""
    worst: dict[str, tuple[float, str]] = {}
    counts: dict[str, list[int]] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for bomb, make in BOMBS.items():
            path = make(folder / "bomb.mcap")
            for verb, words in verbs(path, folder).items():
                if verb in LIVE and bomb in ("aliases in parameters", "deep YAML"):
                    continue
                done = run(*words)
                worst[verb] = max(worst.get(verb, (0.0, "")), (done.peak, bomb))
                count = counts.setdefault(verb, [0, 0, 0])
                count[0] += 1
                count[1] += done.code == 2
                count[2] += "Traceback" in done.said
        print(
            "| verb | bombs | refused with one line | tracebacks | largest peak, MB | at |\n|---|---|---|---|---|---|"
        )
        for verb, (peak, bomb) in worst.items():
            print(f"| {verb} | {' | '.join(map(str, counts[verb]))} | {peak:.0f} | {bomb} |")
        for log in map(Path, sys.argv[1:]):
            for verb, words in verbs(log, folder).items():
                if verb not in LIVE:
                    done = run(*words, patience=600.0)
                    print(f"{log.name}: {verb}: {done.peak:.0f} MB, exit code {done.code}")


if __name__ == "__main__":
    main()
