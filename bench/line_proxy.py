# SPDX-License-Identifier: Apache-2.0
"""A hostile serial line, counted: ``python bench/line_proxy.py --frames 1000000``.

Driver, board rules and rig on one simulated clock; between them a proxy that drops, duplicates, reorders, delays,
flips, truncates, floods, plays old frames and whole old sessions, other sessions and versions, zeros and silence, in
one direction or both. A witness knows what both ends really said.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "test"))

from helpers.line_proxy import FLOOD, KINDS, Witness


def main() -> None:
    """Round after round of all kinds in all directions, a new board and driver for each round."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    frames: Counter[str] = Counter()
    counts: Counter[str] = Counter()
    faults: list[str] = []
    old = Witness(0)
    old.arm()
    recorded, seed = old.recorded, options.seed
    while sum(frames.values()) < options.frames:
        witness = Witness(seed, recorded)
        for kind in KINDS:
            for direction in ("up", "down", "both"):
                counts["attacks"] += 1
                counts["armed before"] += witness.arm()
                big = kind == "flood" and seed == options.seed
                witness.attack(kind, direction, 300, FLOOD if big else 50_000)
        frames += witness.frames
        faults += witness.faults
        counts.update({"values": witness.values, "arms": witness.arms, "trips": witness.trips})
        recorded, seed = witness.recorded, seed + 1
    print(f"{sum(frames.values())} frames: {dict(frames)}")
    print(f"{dict(counts)}; wrong values, foreign or late commands: {len(faults)} {faults[:3]}")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
