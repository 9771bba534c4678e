# SPDX-License-Identifier: Apache-2.0
"""Which cases a set holds: fixed seeds, fixed mix, in an order that tells nothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumo_ros.casemaker.catalogue import known_effects, unknown_kinds
from pneumo_ros.casemaker.mixture import MIXTURES, mixture
from pneumo_ros.casemaker.planned import GRADES, IMPERFECT_SHARE, RIVALS, Planned, case_prefix, drawn_side
from pneumo_ros.errors import InputError


@dataclass(frozen=True)
class Mix:
    """How many cases of each kind."""

    seed: int
    none: int
    single: int
    pair: int
    unknown: int
    withheld: int
    decoys: int  # cases that also lose an effect they do not have, so that a withheld id gives nothing away


# A release opens its full set once and gets a new seed; the sets of earlier releases stay by name.
SETS: dict[str, Mix] = {
    "full-0.3": Mix(20263, none=64, single=100, pair=36, unknown=28, withheld=12, decoys=12),
    "full-0.2": Mix(20262, none=64, single=100, pair=36, unknown=28, withheld=12, decoys=12),
    "full-0.1": Mix(20261, none=64, single=100, pair=36, unknown=28, withheld=12, decoys=12),
    "dev": Mix(1, none=16, single=25, pair=9, unknown=7, withheld=3, decoys=3),
    "dev2": Mix(2, none=16, single=48, pair=12, unknown=14, withheld=6, decoys=4),
    "dev3": Mix(3, none=8, single=72, pair=20, unknown=14, withheld=8, decoys=4),
    "dev4": Mix(4, none=10, single=150, pair=12, unknown=14, withheld=24, decoys=6),
    "dev5": Mix(5, none=48, single=0, pair=0, unknown=0, withheld=0, decoys=0),
}
# Six cases for every change of the code: their sizes are fixed, so that making one is three simulations.
CI: tuple[Planned, ...] = (
    Planned("ci-none", "none", (), 0.0, (), 770001, True),
    Planned("ci-friction", "single", (("coulomb_friction", "both"),), 20.0, (), 770002, False, 0.25),
    Planned("ci-leak", "single", (("leak", "front"),), 20.0, (), 770003, True, 0.25),
    Planned("ci-pair", "pair", (("valve_lag", "rear"), ("tyre_damping", "both")), 20.0, (), 770004, False, 0.4),
    Planned("ci-unknown", "unknown", (("wheel_imbalance", "rear"),), 20.0, (), 770005, False, 0.3),
    Planned("ci-withheld", "withheld", (("lvdt_scale", "rear"),), 20.0, ("lvdt_scale",), 770006, False, 0.5),
)
SEED_OF_CI = 770000


def seed_of(name: str) -> int:
    """Seed of a set."""
    if name in MIXTURES:
        return MIXTURES[name].seed
    return SEED_OF_CI if name == "ci" else SETS[name].seed


def plan(name: str) -> tuple[Planned, ...]:
    """The cases of a set, in its public order.

    Raises
    ------
    InputError
        if there is no such set.
    """
    if name == "ci":
        return CI
    if name in MIXTURES:
        return mixture(name)
    if name not in SETS:
        allowed = ", ".join((*MIXTURES, *SETS, "ci"))
        raise InputError("unknown set", key="set", value=name, allowed=allowed, remedy="choose one of them")
    mix, prefix = SETS[name], case_prefix(name)
    rng = np.random.default_rng(mix.seed)
    drafts = _none(mix) + _single(mix, rng) + _pairs(mix, rng) + _unknown(mix, rng) + _withheld(mix, rng)
    drafts = _with_decoys(drafts, mix.decoys, rng)
    order = rng.permutation(len(drafts))
    seeds = rng.integers(1, 2**31, len(drafts))
    imperfect = rng.uniform(size=len(drafts)) < IMPERFECT_SHARE
    return tuple(
        _planned(f"{prefix}-{place:03d}", drafts[pick], int(seeds[place]), bool(imperfect[place]))
        for place, pick in enumerate(order)
    )


Draft = tuple[str, tuple[tuple[str, "str | None"], ...], float, tuple[str, ...]]


def _planned(name: str, draft: Draft, seed: int, imperfect: bool) -> Planned:
    kind, effects, grade, withhold = draft
    return Planned(name, kind, effects, grade, withhold, seed, imperfect)


def _none(mix: Mix) -> list[Draft]:
    return [("none", (), 0.0, ())] * mix.none


def _single(mix: Mix, rng: np.random.Generator) -> list[Draft]:
    """Every effect at every grade as far as the count goes; a smaller set takes each effect once, grades in turn."""
    ids = [str(name) for name in rng.permutation(known_effects())]
    laps = [(name, GRADES[(i + lap) % len(GRADES)]) for lap in range(len(GRADES)) for i, name in enumerate(ids)]
    picks = [laps[i % len(laps)] for i in range(mix.single)]
    return [("single", ((name, drawn_side(name, rng)),), grade, ()) for name, grade in picks]


def _pairs(mix: Mix, rng: np.random.Generator) -> list[Draft]:
    ids = known_effects()
    out: list[Draft] = []
    while len(out) < mix.pair:
        one, two = (str(name) for name in rng.choice(ids, 2, replace=False))
        if any(one in group and two in group for group in RIVALS):
            continue
        grade = float(rng.choice([2.0, 5.0, 20.0], p=(0.2, 0.4, 0.4)))
        out.append(("pair", ((one, drawn_side(one, rng)), (two, drawn_side(two, rng))), grade, ()))
    return out


def _unknown(mix: Mix, rng: np.random.Generator) -> list[Draft]:
    kinds = [str(kind) for kind in rng.permutation(unknown_kinds())]
    out: list[Draft] = []
    for i in range(mix.unknown):
        kind = kinds[i % len(kinds)]
        out.append(("unknown", ((kind, drawn_side(kind, rng)),), (5.0, 20.0)[(i // len(kinds) + i) % 2], ()))
    return out


def _withheld(mix: Mix, rng: np.random.Generator) -> list[Draft]:
    ids = rng.choice(known_effects(), mix.withheld, replace=False)
    return [
        ("withheld", ((str(n), drawn_side(str(n), rng)),), (5.0, 20.0)[i % 2], (str(n),)) for i, n in enumerate(ids)
    ]


def _with_decoys(drafts: list[Draft], count: int, rng: np.random.Generator) -> list[Draft]:
    plain = [i for i, draft in enumerate(drafts) if not draft[3]]
    for i in rng.choice(plain, count, replace=False):
        kind, effects, grade, _ = drafts[i]
        others = [name for name in known_effects() if name not in {e for e, _ in effects}]
        drafts[i] = (kind, effects, grade, (str(rng.choice(others)),))
    return drafts
