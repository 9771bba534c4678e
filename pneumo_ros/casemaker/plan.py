"""Which cases a set holds: fixed seeds, fixed mix, in an order that tells nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pneumo_ros.casemaker.catalogue import get, known_effects, laws_of, outside_all, unknown_kinds
from pneumo_ros.errors import InputError

GRADES = (1.2, 2.0, 5.0, 20.0)
IMPERFECT_SHARE = 0.35  # of the cases have jitter, lost samples or slower channels


@dataclass(frozen=True)
class Planned:
    """One case before it is made.

    Attributes
    ----------
    name : folder name
    kind : none, single, pair, several (three to five), unknown (a kind no library has), mixed (known ones and one of
        those) or withheld (a known effect taken from the library)
    effects : (id, side) of each effect in it
    grade : wanted gap over null floor; 0 for none
    withhold : effect ids that the diagnosis must do without
    seed : of everything drawn for it
    imperfect : whether the logger jitters and loses samples
    size : fixed size of the effects; None: searched so that the grade is met
    laws : law of each effect; empty: the first ones, as in the sets up to 0.3
    grades : wanted gap over null floor of each effect alone; empty: ``grade`` for all
    form : whether the rig has an error of its model's form, which its config owns
    budgeted : whether the label carries the true budget and curves
    """

    name: str
    kind: str
    effects: tuple[tuple[str, str | None], ...]
    grade: float
    withhold: tuple[str, ...]
    seed: int
    imperfect: bool
    size: float | None = None
    laws: tuple[str, ...] = ()
    grades: tuple[float, ...] = ()
    form: bool = False
    budgeted: bool = False


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


@dataclass(frozen=True)
class Mixture:
    """How many cases of each kind from 0.4 on.

    Attributes
    ----------
    none, formed : nothing wrong; of these with an error of the model's form
    single : one effect; three quarters by a law that the library does not contain
    several : three to five effects
    unknown : outside every family
    mixed : one to three effects and one outside every family
    """

    seed: int
    none: int
    formed: int
    single: int
    several: int
    unknown: int
    mixed: int


MIXTURES: dict[str, Mixture] = {
    "full": Mixture(20264, none=64, formed=32, single=96, several=60, unknown=30, mixed=30),
    "dev6": Mixture(6, none=8, formed=4, single=24, several=14, unknown=8, mixed=6),
    "dev7": Mixture(7, none=8, formed=4, single=24, several=14, unknown=8, mixed=6),
}


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
# Effects that are not paired with each other: both move the same number of the same sensor or balance.
SENSOR = ("lvdt_scale", "lvdt_offset", "pressure_scale", "pressure_offset", "pressure_lag")
BALANCE = ("leak", "orifice_coefficient", "valve_deadband", "supply_droop")
LAG = ("valve_lag", "transport_delay")
MASS = ("payload", "cg_shift", "effective_area_error", "pressure_scale", "pressure_offset")
RIVALS = (SENSOR, BALANCE, LAG, MASS, ("coulomb_friction", "bellows_hysteresis", "viscous_damping"))


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
    mix, prefix = SETS[name], "full" if name == "full-0.3" else name  # cases keep the names they had
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
    return [("single", ((name, _side(name, rng)),), grade, ()) for name, grade in picks]


def _pairs(mix: Mix, rng: np.random.Generator) -> list[Draft]:
    ids = known_effects()
    out: list[Draft] = []
    while len(out) < mix.pair:
        one, two = (str(name) for name in rng.choice(ids, 2, replace=False))
        if any(one in group and two in group for group in RIVALS):
            continue
        grade = float(rng.choice([2.0, 5.0, 20.0], p=(0.2, 0.4, 0.4)))
        out.append(("pair", ((one, _side(one, rng)), (two, _side(two, rng))), grade, ()))
    return out


def _unknown(mix: Mix, rng: np.random.Generator) -> list[Draft]:
    kinds = [str(kind) for kind in rng.permutation(unknown_kinds())]
    out: list[Draft] = []
    for i in range(mix.unknown):
        kind = kinds[i % len(kinds)]
        out.append(("unknown", ((kind, _side(kind, rng)),), (5.0, 20.0)[(i // len(kinds) + i) % 2], ()))
    return out


def _withheld(mix: Mix, rng: np.random.Generator) -> list[Draft]:
    ids = rng.choice(known_effects(), mix.withheld, replace=False)
    return [("withheld", ((str(n), _side(str(n), rng)),), (5.0, 20.0)[i % 2], (str(n),)) for i, n in enumerate(ids)]


def _with_decoys(drafts: list[Draft], count: int, rng: np.random.Generator) -> list[Draft]:
    plain = [i for i, draft in enumerate(drafts) if not draft[3]]
    for i in rng.choice(plain, count, replace=False):
        kind, effects, grade, _ = drafts[i]
        others = [name for name in known_effects() if name not in {e for e, _ in effects}]
        drafts[i] = (kind, effects, grade, (str(rng.choice(others)),))
    return drafts


def mixture(name: str) -> tuple[Planned, ...]:
    """The cases of a set of 0.4 or later, in its public order."""
    mix = MIXTURES[name]
    rng = np.random.default_rng(mix.seed)
    drafts = [*_bare(mix), *_singles(mix, rng), *_several(mix, rng), *_outside(mix, rng), *_mixed(mix, rng)]
    order = rng.permutation(len(drafts))
    seeds = rng.integers(1, 2**31, len(drafts))
    imperfect = rng.uniform(size=len(drafts)) < IMPERFECT_SHARE
    return tuple(
        replace(drafts[pick], name=f"{name}-{place:03d}", seed=int(seeds[place]), imperfect=bool(imperfect[place]))
        for place, pick in enumerate(order)
    )


Acting = tuple[str, "str | None", str]  # id, side, law


def _draft(kind: str, acting: Sequence[Acting] = (), grades: tuple[float, ...] = (), form: bool = False) -> Planned:
    return Planned("", kind, tuple((name, side) for name, side, _ in acting), max(grades, default=0.0), (), 0, False,
                   laws=tuple(law for *_, law in acting), grades=grades, form=form, budgeted=True)  # fmt: skip


def _bare(mix: Mixture) -> list[Planned]:
    return [_draft("none", form=i < mix.formed) for i in range(mix.none)]


def _acting(name: str, foreign: bool, rng: np.random.Generator) -> Acting:
    """An effect by a law of the wanted sort, or of the other where it has none."""
    laws = laws_of(name, foreign=foreign) or laws_of(name, foreign=not foreign)
    law = str(rng.choice(laws))
    sides = get(name, law).sides
    return name, sides[int(rng.integers(len(sides)))], law


def _singles(mix: Mixture, rng: np.random.Generator) -> list[Planned]:
    """Every effect at every grade as far as the count goes; once in four by a law of the library."""
    ids = [str(name) for name in rng.permutation(known_effects())]
    out = []
    for k in range(mix.single):
        lap, i = divmod(k, len(ids))
        grade, foreign = GRADES[(i + lap) % len(GRADES)], (i // len(GRADES) + lap) % 4 != 0
        out.append(_draft("single", [_acting(ids[i], foreign, rng)], (grade,)))
    return out


def _together(count: int, rng: np.random.Generator) -> list[Acting]:
    """Effects that act at the same time: no two of one family or of rivals for the same number."""
    ids = known_effects()
    while True:
        names = [str(name) for name in rng.choice(ids, count, replace=False)]
        if not any(sum(name in group for name in names) > 1 for group in RIVALS):
            return [_acting(name, rng.uniform() < 0.75, rng) for name in names]


def _sizes(count: int, rng: np.random.Generator) -> tuple[float, ...]:
    """Grades within a factor of two of each other, and large enough to stand out of what a refit closes of the gap."""
    return tuple(float(v) for v in np.round(rng.uniform(20.0, 50.0) * np.exp(rng.uniform(-0.7, 0.0, count)), 2))


def _several(mix: Mixture, rng: np.random.Generator) -> list[Planned]:
    counts = [3 + i % 3 for i in range(mix.several)]
    return [_draft("several", _together(count, rng), _sizes(count, rng)) for count in counts]


def _kinds(count: int, rng: np.random.Generator) -> list[Acting]:
    kinds = [str(kind) for kind in rng.permutation(outside_all())]
    out: list[Acting] = []
    for i in range(count):
        kind = kinds[i % len(kinds)]
        out.append((kind, _side(kind, rng), ""))
    return out


def _outside(mix: Mixture, rng: np.random.Generator) -> list[Planned]:
    acting = _kinds(mix.unknown, rng)
    return [_draft("unknown", [one], ((5.0, 20.0)[i % 2],)) for i, one in enumerate(acting)]


def _mixed(mix: Mixture, rng: np.random.Generator) -> list[Planned]:
    """One to three named effects and one kind outside, all of like size."""
    out = []
    for i, one in enumerate(_kinds(mix.mixed, rng)):
        count = 1 + i % 3
        out.append(_draft("mixed", [*_together(count, rng), one], _sizes(count + 1, rng)))
    return out


def _side(name: str, rng: np.random.Generator) -> str | None:
    sides = get(name).sides
    return sides[int(rng.integers(len(sides)))]
