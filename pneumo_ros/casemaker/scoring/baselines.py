# SPDX-License-Identifier: Apache-2.0
"""Four simple rivals of the diagnosis, scored by the same code on the same cases."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from pneumo_ros.casemaker.catalogue import known_effects
from pneumo_ros.casemaker.scoring.results import Found

PLACES = ("front_force", "rear_force", "front_air", "rear_air", "front_tyre", "rear_tyre", "body_heave", "body_pitch",
          "road_input", "supply")  # fmt: skip
ALARM_RATIO = 1.5  # refit-only: a gap this far over the sensor noise is called unknown


def always_none(name: str, found: Found) -> Found:
    """Says that nothing is wrong, always and with certainty."""
    return Found("none", 1.0, gap=found.gap)


def at_random(name: str, found: Found) -> Found:
    """Draws verdict, side and place."""
    rng = np.random.default_rng(int(hashlib.sha256(name.encode()).hexdigest()[:8], 16))
    ids = ("none", "unknown", *known_effects())
    verdict = str(rng.choice(ids))
    entry = {"effects": [verdict], "side": str(rng.choice(["front", "rear", "both"])), "parameters": {}}
    return Found(verdict, 1.0 / len(ids), (str(rng.choice(PLACES)),), (entry,))


def refit_only(name: str, found: Found) -> Found:
    """Re-estimates the nominal model and looks at what is left; cannot name anything."""
    left, floor = _number(found.gap, "refit"), _number(found.gap, "noise_floor")
    return Found("unknown" if left > ALARM_RATIO * floor else "none", 1.0, gap=found.gap)


def best_training_fit(name: str, found: Found) -> Found:
    """Takes the single effect that fits the training log best, whatever it costs and predicts."""
    single = [e for e in found.ranking if len(e["effects"]) == 1 and e["effects"][0] not in ("none", "unknown")]
    if not single:
        return Found("none", 1.0, gap=found.gap)
    best = min(single, key=lambda e: float(e.get("gap_fit", e.get("gap_after", np.inf))))
    gap = {**found.gap, "best": best.get("gap_after", _number(found.gap, "refit"))}
    return Found(str(best["effects"][0]), 1.0, found.places, (best,), gap=gap)


BASELINES: dict[str, Callable[[str, Found], Found]] = {
    "always none": always_none,
    "random": at_random,
    "refit only": refit_only,
    "best training fit": best_training_fit,
}


def applied(found: Mapping[str, Found], names: Sequence[str] = tuple(BASELINES)) -> dict[str, dict[str, Found]]:
    """Every baseline's verdict on every case."""
    return {name: {case: BASELINES[name](case, item) for case, item in found.items()} for name in names}


def _number(values: Mapping[str, Any], key: str) -> float:
    value = values.get(key)
    return float(value) if value is not None else float("nan")
