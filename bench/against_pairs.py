# SPDX-License-Identifier: Apache-2.0
"""What changed between two sessions of one rig: does ``diagnose --against`` say it, and nothing where nothing did?

    python bench/against_pairs.py FOLDER [--leaks 8] [--same 8] [--seed 1] [--duration 15] [--split]

Each pair is a rig whose numbers a seed draws inside their tolerances, and which has an effect of its own (friction)
in every other pair: a session before and two after (one fitted, one held out; ``--split`` drives one and holds its
end out), over other roads. In the first ``--leaks`` pairs a leak of one to two typical sizes is added in between, at a
place that the seed draws. One line a pair; exit code 1 if a verdict is wrong. Finished sessions and diagnoses are
kept, so that it goes on where it was interrupted.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from pneumo_ros.cli.diagnose import diagnose
from pneumo_ros.cli.run import run
from pneumo_ros.effects.hidden import drawn, inside_tolerances
from pneumo_ros.effects.loading import laws_of, load_library
from pneumo_ros.rig import NamedEffect, Rig, load_rig

ROADS = {"before": "D", "after": "D", "held-out": "C"}
OWN, LEAK = "coulomb_friction", "leak"


def rigs(seed: int, leaks: bool) -> tuple[Rig, Rig]:
    """The rig before and after."""
    rng, library = np.random.default_rng(seed), laws_of(load_library())
    before = inside_tolerances(load_rig(), rng)

    def one(name: str) -> NamedEffect:
        effect = library[name]
        site = str(rng.choice(effect.sites))
        return NamedEffect(name, site, tuple((p.name, drawn(p, rng)) for p in effect.parameters))

    if seed % 2:
        before = replace(before, effects=(one(OWN),))
    return before, replace(before, effects=(*before.effects, one(LEAK))) if leaks else before


def drive(folder: Path, name: str, rig: Rig, seed: int, duration: float) -> Path:
    """A session of a rig that nodes and log know nothing of; a finished one is kept."""
    log, hidden = folder / f"{name}.mcap", folder / "hidden" / f"{name}.yaml"
    if not log.exists():
        hidden.parent.mkdir(parents=True, exist_ok=True)
        hidden.write_text(rig.to_yaml(), encoding="utf-8")
        road = ROADS[name]
        run(road=road, duration=duration, seed=seed, set_=[f"plant.simulated_rig={json.dumps(str(hidden.resolve()))}"],
            output=log, isolate=True, single_process=True, picture=False, report=False, summary=False)  # fmt: skip
    return log


def verdict(folder: Path, split: bool) -> dict[str, object]:
    """Diagnosis of what changed; a finished one is kept."""
    out = folder / "found"
    if not (out / "diagnosis.json").exists():
        held = None if split else folder / "held-out.mcap"
        diagnose([folder / "after.mcap"], output=out, holdout=held, against=folder / "before.mcap", overwrite=True)
    return dict(json.loads((out / "diagnosis.json").read_text(encoding="utf-8")))


def pair(folder: Path, seed: int, leaks: bool, duration: float, split: bool) -> bool:
    """One pair; whether the verdict is right."""
    begun = time.monotonic()
    before, after = rigs(seed, leaks)
    for k, name in enumerate(ROADS):
        if name != "held-out" or not split:
            drive(folder, name, before if name == "before" else after, 10 * seed + k, duration)
    found = verdict(folder, split)
    wanted = LEAK if leaks else "none"
    right = found["verdict"] == wanted
    site = after.effects[-1].site if leaks else "-"
    had = before.effects[0].site if before.effects else "-"
    was = f"wanted {wanted:5s} at {site:6s}  friction before at {had:6s}"
    told = f"found {found['verdict']} ({found['probability']:.2f})  {time.monotonic() - begun:.0f} s"
    print(f"{folder.name:12s} {'right' if right else 'WRONG'}  {was}  {told}", flush=True)
    return right


def main() -> int:
    """All pairs; 1 if one is wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--leaks", type=int, default=8)
    parser.add_argument("--same", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--duration", type=float, default=15.0)
    parser.add_argument("--split", action="store_true")
    asked = parser.parse_args()
    right = {}
    for what, count in (("leak", asked.leaks), ("same", asked.same)):
        results = [pair(asked.folder / f"{what}-{k}", asked.seed + k + (100 if what == "same" else 0), what == "leak",
                        asked.duration, asked.split) for k in range(count)]  # fmt: skip
        right[what] = (sum(results), count)
    print(", ".join(f"{what}: {good} of {count} right" for what, (good, count) in right.items()))
    return int(any(good < count for good, count in right.values()))


if __name__ == "__main__":
    sys.exit(main())
