# SPDX-License-Identifier: Apache-2.0
"""How the probabilities of effects fare on cases with known answers, and the constants that would have fared best.

Reads a folder of labels (<case>.json with "truth") and one of diagnoses (<case>.json, bare or under "diagnosis"), as
the verbs `pneumo blind make` and `pneumo blind diagnose` write them. Prints a reliability table of the effects in the
budgets, and the constants of diagnosis/judge/verdict.Calibration with the least log loss for whether a name stands.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from pneumo_ros.diagnosis.judge.closable import EffectEvidence
from pneumo_ros.diagnosis.judge.verdict import Calibration, HeldOutGaps, credit

CALM = HeldOutGaps(2.0, 1.0)


def read(labels: Path, diagnoses: Path) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Label and diagnosis of every case that has both."""
    pairs = []
    for path in sorted(diagnoses.glob("*.json")):
        label = labels / path.name
        if label.exists():
            found = json.loads(path.read_text())
            pairs.append((json.loads(label.read_text()), found.get("diagnosis", found)))
    return pairs


def truth(label: dict[str, Any]) -> set[str]:
    """Effects that act and that a library can name."""
    return set() if label["kind"] in ("none", "unknown") else {t["effect"] for t in label["truth"]}


def entries(cases: list[tuple[dict[str, Any], dict[str, Any]]]) -> list[tuple[dict[str, Any], dict[str, Any], bool]]:
    """Budget entry, its diagnosis, and whether the effect really acts."""
    return [(e, found, e["effects"][0] in truth(label)) for label, found in cases for e in found.get("budget", [])]


def evidence_of(entry: dict[str, Any], found: dict[str, Any]) -> EffectEvidence:
    """What the credit was computed from."""
    gap, closes = found["gap"], float(found["evidence"].get(f"closes:{entry['effects'][0]}", 0.0))
    left = max(gap["refit"] ** 2 - gap["noise_floor"] ** 2, 1e-12)
    # Any three gaps with the share that was closed will do.
    share = entry["share"] * gap["nominal"] ** 2 / left
    bounds = float(found["evidence"].get(f"at_bounds:{entry['effects'][0]}", 0.0))
    return EffectEvidence(
        (entry["effects"][0], ""), tuple(entry["places"]) or ("",), 1.0, (1.0 - closes) ** 2, 0.0, share, bounds
    )


def report(found: list[tuple[dict[str, Any], dict[str, Any], bool]]) -> None:
    """The reliability as it is."""
    p, hit = np.array([e["probability"] for e, _, _ in found]), np.array([right for _, _, right in found])
    print(f"{len(found)} effects, {hit.sum()} right; mean probability {p.mean():.2f}")
    for low in np.arange(0.0, 1.0, 0.2):
        inside = (p >= low) & (p < low + 0.2 + 1e-9 * (low > 0.7))
        if inside.any():
            print(f"  p {low:.1f} to {low + 0.2:.1f}: {inside.sum():3d} effects, right {hit[inside].mean():.2f}")


def main() -> None:
    """Print the reliability and the constants that would have lost least."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("labels", type=Path)
    parser.add_argument("diagnoses", type=Path)
    options = parser.parse_args()
    found = entries(read(options.labels, options.diagnoses))
    report(found)
    loss = []
    for closes, steepness, least in product((0.3, 0.4, 0.5, 0.6, 0.7), (2.0, 4.0, 6.0), (0.005, 0.015, 0.03, 0.06)):
        c = replace(Calibration(), closes=closes, steepness=steepness, least=least)
        p = [credit(evidence_of(e, d), CALM, c) for e, d, _ in found]
        told = np.clip([one if right else 1.0 - one for one, (_, _, right) in zip(p, found, strict=True)], 1e-3, 1.0)
        loss.append((-float(np.mean(np.log(told))), f"closes {closes}, steepness {steepness}, least {least}"))
    print("names that stand:", *(f"  log loss {value:.3f}: {what}" for value, what in sorted(loss)[:6]), sep="\n")


if __name__ == "__main__":
    main()
