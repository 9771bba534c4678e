# SPDX-License-Identifier: Apache-2.0
"""How well the places of a gap are found, on cases with known places (made by `pneumo blind make`).

    python bench/locate.py CASES

CASES holds cases/<name>/{fit,holdout}.mcap and labels/<name>.json. Printed: per case whether the set of places is
exact, its first place right, or the residual flat; and the level (rms in null standard deviations) that refitting
leaves where nothing is wrong: the null distribution behind the threshold.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from pathlib import Path

import numpy as np

from pneumo_ros.diagnosis.half_car.signals import read_signals
from pneumo_ros.diagnosis.half_car.where import locate
from pneumo_ros.effects.rig_model import RigModel


def graded(chosen: tuple[str, ...], truth: set[str]) -> str:
    """One word on a case."""
    if not truth:
        return "false alarm" if chosen else "flat"
    if not chosen:
        return "flat though wrong"
    return "exact" if set(chosen) == truth else "first right" if chosen[0] in truth else "wrong"


def main() -> None:
    """Print one line a case and the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", type=Path)
    folder = parser.parse_args().cases
    counts: Counter[str] = Counter()
    levels = []
    for path in sorted((folder / "labels").glob("*.json")):
        label = json.loads(path.read_text())
        fit, holdout = (read_signals(folder / "cases" / path.stem / f"{part}.mcap") for part in ("fit", "holdout"))
        found = locate(RigModel(fit.rig), [fit], holdout)
        truth = {place for entry in label["truth"] for place in entry["places"]}
        word = graded(found.chosen, truth)
        counts[word] += 1
        if not truth:
            levels.append(found.level["refit"])
        what = " + ".join(entry["effect"] for entry in label["truth"]) or "none"
        print(f"{path.stem:10s} {word:18s} {what:40s} grade {label['grade']}  {', '.join(found.chosen)}")
    print(dict(counts))
    if levels:
        print(f"level where nothing is wrong: {np.min(levels):.2f} to {np.max(levels):.2f}")


if __name__ == "__main__":
    main()
