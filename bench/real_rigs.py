# SPDX-License-Identifier: Apache-2.0
"""Measurements of other people's rigs, whose missing effect the literature knows: does the diagnosis name it?

    python bench/real_rigs.py FOLDER [--only frame chamber cylinder] [--plain]

FOLDER holds ``frame_*_x.mat`` with ``frame_*_y.mat`` (github.com/l-marino/switching-GPLFM), ``chamber_*.csv`` and
``cylinders/*.csv`` (github.com/EvaZillen/3D-printed-pneumatic-actuator); none is part of this package. Each log is
diagnosed three times under the one default calibration, its second part held out: as it is; without the family that it
was found to have (a wrong name is an error, ``unknown`` is right); and with the rig file that the first diagnosis saved
(``none`` is right). ``--plain`` does the first alone. One line a log, then the counts.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.own_rig.from_files import prepared
from pneumo_ros.own_rig.outputs import save_rig

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
KINDS = {"frame": "frame_*_x.mat", "chamber": "chamber_*.csv", "cylinder": "cylinders/*.csv"}
EXPECTED = {"frame": ("coulomb_friction",), "chamber": ("leak", "none"), "cylinder": ("coulomb_friction",)}
TIGHT = ("chamber_Aluminium",)


@dataclass
class Counts:
    """Of how many logs, how many."""

    logs: int = 0
    right: int = 0
    worse: int = 0
    removed: int = 0
    misnamed: int = 0
    moved_in: int = 0
    none: int = 0


def main() -> int:
    """Diagnose every log of a folder; 1 if one is named wrongly or worse than the refit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="*", choices=sorted(KINDS), default=sorted(KINDS))
    parser.add_argument("--plain", action="store_true")
    asked = parser.parse_args()
    counts = Counts()
    for kind in asked.only:
        for log in sorted(asked.folder.glob(KINDS[kind])):
            one_log(kind, log, asked.plain, counts)
    print(f"named as the literature has it {counts.right} of {counts.logs}; worse than the refit {counts.worse}")
    if not asked.plain:
        print(f"family removed: named wrongly {counts.misnamed} of {counts.removed}; effect moved into the model: none "
              f"{counts.none} of {counts.moved_in}")  # fmt: skip
    return int(counts.right < counts.logs or counts.worse > 0)


def one_log(kind: str, log: Path, plain: bool, counts: Counts) -> None:
    """Diagnose one log three times."""
    rig = EXAMPLES / kind / "rig.py"
    begun = time.monotonic()
    task = prepared(rig, [log])
    found = task.diagnose()
    wanted = ("none",) if log.stem in TIGHT else EXPECTED[kind][:1]
    named = found.verdict.split("+")
    counts.logs += 1
    counts.right += wanted[0] in named
    counts.worse += found.verdict not in ("none", "unknown") and found.gap.best >= found.gap.refit
    tell(log, "as it is", found, time.monotonic() - begun)
    if plain or wanted == ("none",) or wanted[0] not in named:
        return
    without = prepared(rig, [log], without=wanted).diagnose()
    counts.removed += 1
    counts.misnamed += without.verdict not in ("none", "unknown", "not_testable")
    tell(log, f"without {wanted[0]}", without)
    with tempfile.TemporaryDirectory() as folder:
        saved = save_rig(found, task.model, Path(folder) / "rig.yaml")
        again = prepared(rig, [log], rig=saved).diagnose()
    counts.moved_in += 1
    counts.none += again.verdict == "none"
    tell(log, "with what was found", again)


def tell(log: Path, what: str, found: Diagnosis, seconds: float | None = None) -> None:
    """One line."""
    gap, place = found.gap, found.location[0][0] if found.location else "-"
    took = "" if seconds is None else f"  {seconds:.0f} s"
    told = f"{found.verdict:36s} {found.probability:.2f}  {place:18s}"
    gaps = f"gap {gap.nominal:.3f} -> {gap.refit:.3f} -> {gap.best:.3f}"
    print(f"{log.stem:24s} {what:26s} {told} {gaps}{took}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
