# SPDX-License-Identifier: Apache-2.0
"""The result of a diagnosis and its file form (contract: diagnosis.json)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.experiment import NextExperiment
from pneumo_ros.effects.parameters import Active, Curve
from pneumo_ros.files import new_file

DIFFERS: Final = "differs"  # law of an effect whose shape is needed beside its law [definition]


@dataclass(frozen=True)
class Estimate:
    """A parameter of an effect with its standard deviation.

    ``at_bound`` says that the fit ended at an end of the allowed range; ``moves_nothing`` that no output depends on it.
    """

    value: float
    std: float
    unit: str
    at_bound: bool = False
    moves_nothing: bool = False

    def to_json(self) -> dict[str, Any]:
        """Contract form, with the flags only where they are set."""
        out: dict[str, Any] = {"value": self.value, "std": self.std, "unit": self.unit}
        if self.at_bound:
            out["at_bound"] = True
        if self.moves_nothing:
            out["moves_nothing"] = True
        return out


@dataclass(frozen=True)
class Ranked:
    """One structure of the ranking.

    Attributes
    ----------
    effects : ids; ("none",) for the nominal structure, ("unknown",) for what the library lacks
    sites : site of each effect
    side : of the rig, in the model's own words, or None
    probability : 0..1, the list sums to one
    parameters : by name (prefixed with the effect's id where two effects share a name)
    gap_after : held-out gap with it
    shrink : 1 - gap_after / gap of the refit
    shrink_ci90 : moving-block bootstrap
    gap_fit : gap on the fitted logs
    evidence : what its probability rests on: mean square on the selection blocks, training cost, squared stretch of the
        tolerances, effective samples
    notes : what counts against it
    """

    effects: tuple[str, ...]
    sites: tuple[str, ...]
    side: str | None
    probability: float
    parameters: Mapping[str, Estimate]
    gap_after: float
    shrink: float
    shrink_ci90: tuple[float, float]
    gap_fit: float = math.nan
    evidence: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Contract form."""
        return {
            "effects": list(self.effects),
            "side": self.side,
            "sites": list(self.sites),
            "probability": self.probability,
            "parameters": {name: estimate.to_json() for name, estimate in self.parameters.items()},
            "gap_after": self.gap_after,
            "shrink": self.shrink,
            "shrink_ci90": list(self.shrink_ci90),
            "gap_fit": self.gap_fit,
            "evidence": dict(self.evidence),
            "notes": list(self.notes),
        }


@dataclass(frozen=True)
class Gap:
    """Held-out gaps: total and per channel."""

    nominal: float
    refit: float
    best: float
    noise_floor: float
    per_channel: Mapping[str, Mapping[str, float]]

    def to_json(self) -> dict[str, Any]:
        """Contract form."""
        return {
            "nominal": self.nominal,
            "refit": self.refit,
            "best": self.best,
            "noise_floor": self.noise_floor,
            "per_channel": {channel: dict(values) for channel, values in self.per_channel.items()},
        }


@dataclass(frozen=True)
class BudgetEntry:
    """One effect's part of the nominal held-out gap.

    Attributes
    ----------
    effects : ids of the mechanism
    side, places : where it acts
    share, share_ci90 : of the squared nominal gap, averaged over the orders in which effects can be added
    law : id of the library's law, or :data:`DIFFERS` where the family's shape closes more than its law
    probability : that the effect is in the structure, whatever else is
    curve : the law as measured, None where it has none
    """

    effects: tuple[str, ...]
    side: str | None
    places: tuple[str, ...]
    share: float
    share_ci90: tuple[float, float]
    law: str
    probability: float
    curve: Curve | None = None

    def to_json(self) -> dict[str, Any]:
        """Contract form."""
        return {
            "effects": list(self.effects),
            "family": self.effects[0],
            "side": self.side,
            "places": list(self.places),
            "share": self.share,
            "share_ci90": list(self.share_ci90),
            "law": self.law,
            "probability": self.probability,
            "curve": curve_json(self.curve),
        }


@dataclass(frozen=True)
class Remainder:
    """What no family of the structure closes: its share of the squared nominal gap, its places and measured law."""

    share: float
    places: tuple[str, ...] = ()
    curve: Curve | None = None

    def to_json(self) -> dict[str, Any]:
        """Contract form."""
        return {"share": self.share, "places": list(self.places), "curve": curve_json(self.curve)}


def curve_json(curve: Curve | None) -> dict[str, Any] | None:
    """Contract form of a measured curve."""
    if curve is None:
        return None
    axes = {key: {"name": axis.name, "unit": axis.unit} for key, axis in (("x", curve.x), ("y", curve.y))}
    return {**axes, "points": np.asarray(curve.points, dtype=float).tolist()}


@dataclass(frozen=True)
class EditTest:
    """A log with a known change, predicted without refitting."""

    log: str
    changes: Mapping[str, float]  # factor on each changed rig quantity
    gap_nominal: float
    gap_refit: float
    gap_best: float

    def to_json(self) -> dict[str, Any]:
        """Plain mapping."""
        return {
            "log": self.log,
            "changes": dict(self.changes),
            "gap_nominal": self.gap_nominal,
            "gap_refit": self.gap_refit,
            "gap_best": self.gap_best,
        }


@dataclass(frozen=True)
class Diagnosis:
    """Where the gap lies, which effect makes it, how far it shrinks.

    Attributes
    ----------
    verdict : effect id, "<id>+<id>", "none", "unknown" or "not_testable"
    probability : 0..1
    location : places with their share of the gap, largest first
    ranking : structures, most probable first
    ambiguity_group : ids this log cannot tell from the verdict
    gap : held-out gaps
    nuisance : estimated parameters of the chosen structure, by name: value, std, unit
    active : the chosen effects with their values
    budget : effects of the best structure with their shares of the gap, largest first
    refit_share, remainder, floor_share : what the tolerances close, what nothing closes, what sensors and form leave;
        with the budget they add up to one
    not_testable : effects that this excitation could not have shown, with the smallest size it could
    notes : sentences for the reader: limitations, bounds reached, divergences
    tried : label and gap on the fitted logs of every candidate that was fitted, best first
    evidence : numbers the verdict rests on
    trajectories : on the held-out rows: "time" (N,), "log", "nominal", "refit", "best" (N, C)
    """

    verdict: str
    probability: float
    location: tuple[tuple[str, float], ...]
    ranking: tuple[Ranked, ...]
    ambiguity_group: tuple[str, ...]
    gap: Gap
    nuisance: Mapping[str, Estimate]
    active: tuple[Active, ...]
    budget: tuple[BudgetEntry, ...] = ()
    refit_share: float = 0.0
    remainder: Remainder | None = None
    floor_share: float = 0.0
    not_testable: Mapping[str, str] = field(default_factory=dict)
    experiment: NextExperiment | None = None
    edit: EditTest | None = None
    notes: tuple[str, ...] = ()
    logs: Mapping[str, Any] = field(default_factory=dict)
    tried: tuple[tuple[str, float], ...] = ()
    evidence: Mapping[str, float] = field(default_factory=dict)
    trajectories: Mapping[str, Array] = field(default_factory=dict, repr=False, compare=False)

    def to_json(self) -> dict[str, Any]:
        """The contract's keys first, then what else was found; numbers that are not finite become null."""
        out: dict[str, Any] = {
            "verdict": self.verdict,
            "probability": self.probability,
            "location": [{"place": place, "share": share} for place, share in self.location],
            "ranking": [entry.to_json() for entry in self.ranking],
            "ambiguity_group": list(self.ambiguity_group),
            "gap": self.gap.to_json(),
            "budget": [entry.to_json() for entry in self.budget],
            "refit_share": self.refit_share,
            "remainder": None if self.remainder is None else self.remainder.to_json(),
            "floor_share": self.floor_share,
            "nuisance": {name: estimate.to_json() for name, estimate in self.nuisance.items()},
            "active": [{"effect": a.effect, "site": a.site, "values": list(a.values)} for a in self.active],
            "not_testable": dict(self.not_testable),
            "next_experiment": None if self.experiment is None else self.experiment.to_json(),
            "edit_test": None if self.edit is None else self.edit.to_json(),
            "notes": list(self.notes),
            "tried": [{"candidate": label, "gap_fit": gap} for label, gap in self.tried],
            "evidence": dict(self.evidence),
            "logs": dict(self.logs),
        }
        return dict(_finite(out))


def write_json(diagnosis: Diagnosis, path: Path) -> None:
    """Write diagnosis.json whole or not at all."""
    with new_file(path) as part:
        part.write_text(json.dumps(diagnosis.to_json(), indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(v) for key, v in value.items()}
    if isinstance(value, list):
        return [_finite(v) for v in value]
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None
    return value
