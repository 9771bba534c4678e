# SPDX-License-Identifier: Apache-2.0
"""A hostile serial line, counted: ``python bench/line_proxy.py --frames 1000000``.

Driver, board rules and rig on one simulated clock; between them a proxy that drops, duplicates, reorders, delays,
flips, truncates, floods, plays old frames and whole old sessions, other sessions and versions, zeros and silence, in
one direction or both. A witness knows what both ends really said. Frames of the honest line between two attacks, over
which the rig is armed again, do not count.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "test"))

from helpers.line_proxy import FLOOD, KINDS, Witness

WAYS = ("up", "down", "both")
ATTACK = 1000  # ms
COLUMNS = ("attacks", "armed before", "frames", "values", "trips", "faults")


def main() -> None:
    """Round after round of all kinds in all directions, a new board and driver for each round."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=1_000_000, help="frames of an attacked line, and played ones")
    parser.add_argument("--seed", type=int, default=1, help="of the first round")
    options = parser.parse_args()
    table = {kind: Counter[str]() for kind in KINDS}
    faults: list[str] = []
    old = Witness(0)
    old.arm()
    recorded, seed = old.recorded, options.seed
    while sum(row["frames"] for row in table.values()) < options.frames:
        witness = Witness(seed, recorded)
        for kind in KINDS:
            for direction in WAYS:
                table[kind] += attacked(witness, kind, direction, FLOOD if seed == options.seed else 50_000)
        faults += witness.faults
        recorded, seed = witness.recorded, seed + 1
        print(f"round {seed - options.seed}: {sum(row['frames'] for row in table.values())} frames, "
              f"{len(faults)} faults", flush=True)  # fmt: skip
    show(table)
    print(*faults[:5], sep="\n")
    sys.exit(1 if faults else 0)


def show(table: dict[str, Counter[str]]) -> None:
    """A row for each kind of line, and all together."""
    print(f"| line | {' | '.join(COLUMNS)} |\n|{'---|' * (len(COLUMNS) + 1)}")
    for kind, row in {**table, "all": sum(table.values(), Counter())}.items():
        print(f"| {kind.replace('_', ' ')} | {' | '.join(str(row[name]) for name in COLUMNS)} |")


def attacked(witness: Witness, kind: str, direction: str, flood: int) -> Counter[str]:
    """What one attack on an armed rig led to: a row of the table."""
    armed = witness.arm()
    before = counts(witness)
    witness.attack(kind, direction, ATTACK, flood if kind == "flood" else 0)
    return Counter({"attacks": 1, "armed before": int(armed)}) + (counts(witness) - before)


def counts(witness: Witness) -> Counter[str]:
    """So far: spoiled and played frames, values published, trips of an armed rig, and what must never be."""
    spoiled = sum(number for kind, number in witness.frames.items() if kind != "honest")
    return Counter(frames=spoiled, values=witness.values, trips=witness.trips, faults=len(witness.faults))


if __name__ == "__main__":
    main()
