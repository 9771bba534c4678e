# SPDX-License-Identifier: Apache-2.0
"""The mix of sets from 0.4 on: second laws, several effects at once, named beside unnamed, errors of form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pneumo_ros.casemaker.catalogue import get, known_effects, laws_of, outside_all
from pneumo_ros.casemaker.planned import GRADES, IMPERFECT_SHARE, RIVALS, Planned, case_prefix, drawn_side

Acting = tuple[str, "str | None", str]  # id, side, law


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
    "full": Mixture(20268, none=64, formed=32, single=96, several=60, unknown=30, mixed=30),
    "full-0.7": Mixture(20267, none=64, formed=32, single=96, several=60, unknown=30, mixed=30),
    "full-0.6": Mixture(20266, none=64, formed=32, single=96, several=60, unknown=30, mixed=30),
    "full-0.5": Mixture(20265, none=64, formed=32, single=96, several=60, unknown=30, mixed=30),
    "full-0.4": Mixture(20264, none=64, formed=32, single=96, several=60, unknown=30, mixed=30),
    "dev6": Mixture(6, none=8, formed=4, single=24, several=14, unknown=8, mixed=6),
    "dev7": Mixture(7, none=8, formed=4, single=24, several=14, unknown=8, mixed=6),
    "dev8": Mixture(8, none=2, formed=1, single=24, several=8, unknown=6, mixed=0),
}


def mixture(name: str) -> tuple[Planned, ...]:
    """The cases of a set of 0.4 or later, in its public order."""
    mix, prefix = MIXTURES[name], case_prefix(name)
    rng = np.random.default_rng(mix.seed)
    drafts = [*_bare(mix), *_singles(mix, rng), *_several(mix, rng), *_outside(mix, rng), *_mixed(mix, rng)]
    order = rng.permutation(len(drafts))
    seeds = rng.integers(1, 2**31, len(drafts))
    imperfect = rng.uniform(size=len(drafts)) < IMPERFECT_SHARE
    return tuple(
        replace(drafts[pick], name=f"{prefix}-{place:03d}", seed=int(seeds[place]), imperfect=bool(imperfect[place]))
        for place, pick in enumerate(order)
    )


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
        out.append((kind, drawn_side(kind, rng), ""))
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
