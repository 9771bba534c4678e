# SPDX-License-Identifier: Apache-2.0
"""Rigs made by scipy's integrators with effects by laws of their own: does the diagnosis name what is missing?

    python bench/made_rigs.py [--seeds 1 2 3] [--only sledge silverbox]

Each rig is a model of one's own (rig.py, rig.yaml as a user writes them) and two logs, one held out, made by another
program: a sledge on a guide, an oscillator at 68 Hz whose spring hardens (after Wigren and Schoukens's Silverbox), a
joint with Bouc-Wen hysteresis (after Noel and Schoukens), two tanks that overflow (after Schoukens et al.), a speed
whose sensor has lost its sign, a heated plate, a motor, a quarter car, valves, stops, sensors and actuators. One line a
log, then the counts; ``part`` names some of what is there.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from made import flow, mass, motion
from made.common import Made
from numpy.random import Generator

from pneumo_ros.errors import PneumoError
from pneumo_ros.own_rig.from_files import prepared

RIGS = mass.RIGS | motion.RIGS | flow.RIGS


def main() -> int:
    """Make and diagnose; the counts say how many were named as they were made."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--only", nargs="+", choices=sorted(RIGS), default=list(RIGS))
    asked = parser.parse_args()
    found = [diagnosed(name, seed) for name in asked.only for seed in asked.seeds]
    print(f"named as made {found.count('right')} of {len(found)}, in part {found.count('part')}")
    return 0


def diagnosed(name: str, seed: int) -> str:
    """``right``, ``part`` or ``wrong``; one line is printed."""
    rig, started = RIGS[name], time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "rig.py"
        model.write_text(rig.physics, encoding="utf-8")
        model.with_suffix(".yaml").write_text(rig.names, encoding="utf-8")
        logs = [written(rig, np.random.default_rng(1000 * seed + k), Path(folder) / f"{k}.csv") for k in range(2)]
        try:
            one = prepared(model, logs[:1], logs[1]).diagnose()
        except PneumoError as error:
            print(f"{name:20} {seed:2} {error}", flush=True)
            return "wrong"
    told, there = set(one.verdict.split("+")), set(rig.families or {"none"})
    verdict = "right" if told == there else "part" if told & there else "wrong"
    print(f"{name:20} {seed:2} {verdict:5} {one.verdict:40} {one.probability:.2f}  gap {one.gap.refit:.4f} -> "
          f"{one.gap.best:.4f}  {time.perf_counter() - started:3.0f} s", flush=True)  # fmt: skip
    return verdict


def written(rig: Made, rng: Generator, path: Path) -> Path:
    """A log as CSV."""
    columns = rig.log(rng)
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, "%.9g", ",", header=",".join(columns), comments="")
    return path


if __name__ == "__main__":
    sys.exit(main())
