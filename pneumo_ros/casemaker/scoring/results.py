# SPDX-License-Identifier: Apache-2.0
"""A diagnosis as the scores see it (contract section 3)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pneumo_ros.errors import InputError

NOT_NAMED = ("none", "unknown", "not_testable")


@dataclass(frozen=True)
class Found:
    """One diagnosis.

    Attributes
    ----------
    verdict : effect id, ``a+b``, none, unknown or not_testable
    probability : stated for the verdict
    places : names, largest share first
    ranking : entries of the diagnosis file, best first
    group : ids that the log cannot tell from the verdict
    gap : held-out gaps: nominal, refit, best, noise_floor
    edit : gaps on the edit log: nominal, refit, best; empty when it was not predicted
    budget : from 0.4 on, entries of the gap's budget, largest first
    refit_share, remainder_share : from 0.4 on, of the nominal gap; NaN before
    seconds : wall clock of the diagnosis
    commit : of the software that made it
    """

    verdict: str
    probability: float
    places: tuple[str, ...] = ()
    ranking: tuple[dict[str, Any], ...] = ()
    group: tuple[str, ...] = ()
    gap: Mapping[str, Any] = field(default_factory=dict)
    edit: Mapping[str, Any] = field(default_factory=dict)
    budget: tuple[dict[str, Any], ...] = ()
    refit_share: float = math.nan
    remainder_share: float = math.nan
    seconds: float = math.nan
    commit: str = "unknown"

    @property
    def named(self) -> frozenset[str]:
        """Effect ids of the verdict; empty for none, unknown, not_testable."""
        return frozenset() if self.verdict in NOT_NAMED else frozenset(self.verdict.split("+"))

    @property
    def declared(self) -> frozenset[str]:
        """The verdict together with its ambiguity group."""
        return (self.named or frozenset({self.verdict})) | frozenset(self.group)

    @property
    def best(self) -> dict[str, Any]:
        """The ranking entry of the verdict; empty when there is none."""
        for entry in self.ranking:
            if self.named and frozenset(entry["effects"]) == self.named:
                return entry
        return {}

    @property
    def alarm(self) -> bool:
        """Whether it says that something is wrong."""
        return self.verdict not in ("none", "not_testable")


def parse(diagnosis: Mapping[str, Any], seconds: float = math.nan, commit: str = "unknown") -> Found:
    """A diagnosis from the content of diagnosis.json."""
    places = sorted(diagnosis.get("location", []), key=lambda item: -float(item["share"]))
    return Found(
        verdict=str(diagnosis["verdict"]),
        probability=float(diagnosis["probability"]),
        places=tuple(str(item["place"]) for item in places),
        ranking=tuple(diagnosis.get("ranking", [])),
        group=tuple(map(str, diagnosis.get("ambiguity_group", []))),
        gap=diagnosis.get("gap", {}),
        edit={key.removeprefix("gap_"): value for key, value in (diagnosis.get("edit_test") or {}).items()},
        budget=tuple(diagnosis.get("budget") or ()),
        refit_share=_share_of(diagnosis.get("refit_share")),
        remainder_share=_share_of((diagnosis.get("remainder") or {}).get("share")),
        seconds=seconds,
        commit=commit,
    )


def _share_of(value: object) -> float:
    return float(value) if isinstance(value, int | float) else math.nan


def load_results(folder: Path, cases: Mapping[str, object]) -> dict[str, Found]:
    """Diagnoses of the cases that have one.

    Raises
    ------
    InputError
        if no case has one, or a file cannot be read.
    """
    out = {}
    for name in cases:
        path = folder / f"{name}.json"
        if not path.exists():
            continue
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            out[name] = parse(content["diagnosis"], float(content["seconds"]), str(content.get("commit", "unknown")))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(f"cannot read this diagnosis ({error})", where=path,
                             remedy="delete it and run `pneumo blind diagnose` again") from error  # fmt: skip
    if not out:
        raise InputError("no diagnosis found", where=folder, remedy="run `pneumo blind diagnose` first")
    return out
