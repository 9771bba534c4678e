# SPDX-License-Identifier: Apache-2.0
"""How the verdict's probabilities fare on cases with known answers, and the constants that would have fared best.

Reads a folder of labels (<case>.json with "kind") and one of diagnoses (<case>.json, bare or under "diagnosis"), as
the verbs `pneumo blind make` and `pneumo blind diagnose` write them. Prints a reliability table and the constants of
gap/verdict.Calibration with the least log loss: for the decision between a named effect and "unknown", and for the
choice among names.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from pneumo_ros.diagnosis.diagnose import TELLING
from pneumo_ros.diagnosis.judge.verdict import Calibration, HeldOutGaps, nameless
from pneumo_ros.diagnosis.search.selection import TOLL

FOREIGN = ("unknown", "withheld")


def read(labels: Path, diagnoses: Path) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Label and diagnosis of every case that has both."""
    pairs = []
    for path in sorted(diagnoses.glob("*.json")):
        label = labels / path.name
        if label.exists():
            found = json.loads(path.read_text())
            pairs.append((json.loads(label.read_text()), found.get("diagnosis", found)))
    return pairs


def truth(label: dict[str, Any]) -> str:
    """The verdict that is right."""
    if label["kind"] in FOREIGN:
        return "unknown"
    return "+".join(sorted({t["effect"] for t in label["truth"]})) or "none"


def unknown_share(found: dict[str, Any], constants: Calibration) -> float:
    """Probability of "unknown" from the evidence, with other constants."""
    e, gap = found["evidence"], found["gap"]
    refit, best = (gap[name] / gap["noise_floor"] for name in ("refit", "best"))
    kept = e.get("kept_chosen") if e.get("equations_refit", 0.0) > TELLING else None
    level = e["level_chosen"] if e["effects"] else None
    share = nameless(e["level_refit"], level, HeldOutGaps(refit, best, kept), int(e.get("walls", 0)), constants)
    return float(np.clip(share, 1e-3, 1.0 - 1e-3))


def height(weighed: dict[str, float], entry: dict[str, Any], constants: Calibration) -> float:
    """Logarithm of a structure's weight before its effects pay their toll."""
    fitted = [name for name in entry["parameters"] if "total_lag" not in name]  # that one follows from the others
    price = weighed["cost"] + TOLL * (len(fitted) + entry["sites"].count("both"))
    return -constants.sharpness * price / weighed["samples"]


def named_share(label: dict[str, Any], found: dict[str, Any], constants: Calibration) -> float:
    """Probability that the ranking gives the true structure, were the effect surely in the library."""
    tolls = (0.0, constants.first_toll, constants.first_toll + constants.second_toll)
    entries = [entry for entry in found["ranking"] if entry.get("evidence")]
    sizes = [0 if entry["effects"] == ["none"] else len(entry["effects"]) for entry in entries]
    heights = np.array([height(entry["evidence"], entry, constants) - tolls[n]
                        for entry, n in zip(entries, sizes, strict=True)])  # fmt: skip
    weights = np.exp(heights - heights.max())
    true = np.array(["+".join(sorted(set(entry["effects"]))) == truth(label) for entry in entries])
    return float(np.clip(weights[true].sum() / weights.sum(), 1e-3, 1.0))


def report(cases: list[tuple[dict[str, Any], dict[str, Any]]]) -> None:
    """The reliability as it is."""
    p = np.array([found["probability"] for _, found in cases])
    hit = np.array([found["verdict"] == truth(label) for label, found in cases])
    print(f"{len(cases)} cases, {hit.sum()} right; mean probability {p.mean():.2f}")
    for low in np.arange(0.0, 1.0, 0.2):
        inside = (p >= low) & (p < low + 0.2 + 1e-9 * (low > 0.7))
        if inside.any():
            print(f"  p {low:.1f} to {low + 0.2:.1f}: {inside.sum():3d} cases, right {hit[inside].mean():.2f}")


def main() -> None:
    """Print the reliability and, for both questions, the constants that would have lost least."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("labels", type=Path)
    parser.add_argument("diagnoses", type=Path)
    options = parser.parse_args()
    cases = [(label, found) for label, found in read(options.labels, options.diagnoses) if "evidence" in found]
    report(cases)
    foreign = [truth(label) == "unknown" for label, _ in cases]
    loss = []
    for leftover, held, walls in product((0.03, 0.05, 0.065, 0.1, 0.18), (0.1, 0.14, 0.18, 0.25), (1.0, 1.3, 1.9)):
        c = replace(Calibration(), leftover=leftover, leftover_held=held, walls=walls)
        share = [unknown_share(found, c) if out else 1.0 - unknown_share(found, c)
                 for out, (_, found) in zip(foreign, cases, strict=True)]  # fmt: skip
        loss.append((-float(np.mean(np.log(share))), f"leftover {leftover}, held {held}, walls {walls}"))
    print("known or unknown:", *(f"  log loss {value:.3f}: {what}" for value, what in sorted(loss)[:4]), sep="\n")
    known = [case for case, out in zip(cases, foreign, strict=True) if not out]
    loss = []
    for sharpness, first, second in product(
        (6.0, 12.0, 24.0, 36.0, 60.0, 120.0), (5.0, 7.0, 9.0, 12.0), (5.0, 9.0, 14.0)
    ):
        c = replace(Calibration(), sharpness=sharpness, first_toll=first, second_toll=second)
        share = [named_share(*case, c) for case in known]
        loss.append((-float(np.mean(np.log(share))), f"sharpness {sharpness}, first toll {first}, second {second}"))
    print("which name:", *(f"  log loss {value:.3f}: {what}" for value, what in sorted(loss)[:4]), sep="\n")


if __name__ == "__main__":
    main()
