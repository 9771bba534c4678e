"""How the verdict's probabilities fare on cases with known answers, and the constants that would have fared best.

Reads a folder of labels (<case>.json with "kind") and one of diagnoses (<case>.json, bare or under "diagnosis"), as
the verbs `pneumo blind make` and `pneumo blind diagnose` write them. Prints a reliability table and, for the decision
between a named effect and "unknown", the constants of gap/verdict.Calibration with the least log loss.
"""

from __future__ import annotations

import argparse
import json
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from pneumo_ros.gap.verdict import Calibration

KNOWN, FOREIGN = ("single", "pair"), ("unknown", "withheld")


def read(labels: Path, diagnoses: Path) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Label and diagnosis of every case that has both."""
    pairs = []
    for path in sorted(diagnoses.glob("*.json")):
        label = labels / path.name
        if label.exists():
            found = json.loads(path.read_text())
            pairs.append((json.loads(label.read_text()), found.get("diagnosis", found)))
    return pairs


def right(label: dict[str, Any], found: dict[str, Any]) -> bool:
    """Whether the verdict is the truth."""
    if label["kind"] in FOREIGN:
        return bool(found["verdict"] == "unknown")
    return bool(found["verdict"] == ("+".join(sorted({t["effect"] for t in label["truth"]})) or "none"))


def unknown_share(found: dict[str, Any], constants: Calibration) -> float:
    """Probability of "unknown" from the evidence, with other constants."""
    e = found["evidence"]
    if e["effects"] == 0:
        ratio = (e["level_refit"] / constants.real) ** (0.5 * constants.steepness)
    else:
        left = np.sqrt(max(0.0, e["level_chosen"] - constants.floor) / max(e["level_refit"], 1e-9))
        ratio = (left / constants.leftover) ** constants.steepness
    return float(np.clip(ratio / (1.0 + ratio), 1e-3, 1.0 - 1e-3))


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("labels", type=Path)
    parser.add_argument("diagnoses", type=Path)
    options = parser.parse_args()
    cases = [(label, found) for label, found in read(options.labels, options.diagnoses) if "evidence" in found]
    p = np.array([found["probability"] for _, found in cases])
    hit = np.array([right(label, found) for label, found in cases])
    print(f"{len(cases)} cases, {hit.sum()} right; mean probability {p.mean():.2f}")
    for low in np.arange(0.0, 1.0, 0.2):
        inside = (p >= low) & (p < low + 0.2 + 1e-9 * (low > 0.7))
        if inside.any():
            print(f"  p {low:.1f} to {low + 0.2:.1f}: {inside.sum():3d} cases, right {hit[inside].mean():.2f}")
    judged = [(label["kind"] in FOREIGN, found) for label, found in cases if label["kind"] in KNOWN + FOREIGN]
    grid = product((0.08, 0.12, 0.18, 0.25, 0.35), (2.0, 3.0, 4.0, 6.0), (1.5, 2.5, 4.0))
    scored = []
    for leftover, steepness, real in grid:
        constants = Calibration(leftover=leftover, steepness=steepness, real=real)
        share = np.array([unknown_share(found, constants) for _, found in judged])
        foreign = np.array([truth for truth, _ in judged])
        scored.append((-float(np.mean(np.log(np.where(foreign, share, 1.0 - share)))), constants))
    for loss, c in sorted(scored, key=lambda item: item[0])[:5]:
        print(f"  log loss {loss:.3f}: leftover {c.leftover}, steepness {c.steepness}, real {c.real}")


if __name__ == "__main__":
    main()
