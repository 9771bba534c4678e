# SPDX-License-Identifier: Apache-2.0
"""The register of what can be wrong with a rig; :mod:`pneumo_ros.casemaker.catalogue` fills it and answers questions.

An effect turns a size in (0, 1] (1 is the largest sane one) into changes of the rig's parameters. The laws are the
richer rig's own; what a label says about parameters is what somebody with a bench would measure.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from pneumo_ros.casemaker.laws.slots import SHARED, Law
from pneumo_ros.casemaker.parameters import RicherRig

QUICKEST = 3e-4  # s: a second order lag below this is too quick for the integrator's step
SIDES = ("front", "rear", "both")
Parameters = dict[str, tuple[float, str]]


@dataclass(frozen=True)
class Applied:
    """A rig with an effect in it.

    Attributes
    ----------
    rig : changed rig
    parameters : name -> (value, unit) as a bench would measure them; the first is comparable between laws unless
        the effect says otherwise
    places : where the gap comes from, names of the contract's section 3; any of them is right
    road_gain : factor the effect needs on the road's heights to be seen at all
    """

    rig: RicherRig
    parameters: Parameters
    places: tuple[str, ...]
    road_gain: float = 1.0


@dataclass(frozen=True)
class Effect:
    """One thing that can be wrong.

    Attributes
    ----------
    id : effect id of the contract, or the name of a kind that no library has
    known : whether the contract lists it
    sides : front, rear, both; or (None,) when it has no side
    apply : (rig, size, side, generator) -> Applied; draws the same numbers whatever the size
    comparable : whether the first parameter means the same in any sensible law
    law : name of its law
    foreign : whether no law of the effects' library contains it (docs/blind-check.md says so law by law)
    """

    id: str
    known: bool
    sides: tuple[str | None, ...]
    apply: Callable[[RicherRig, float, str | None, np.random.Generator], Applied] = field(repr=False)
    comparable: bool = False
    law: str = "first"
    foreign: bool = False


def ends_of(side: str | None) -> tuple[str, ...]:
    """The ends a side means."""
    return ("front", "rear") if side in ("both", None) else (side,)


def at_ends(rig: RicherRig, side: str | None, **changes: float) -> RicherRig:
    """The rig with parameters of one or both ends replaced."""
    for end in ends_of(side):
        rig = rig._replace(**{end: getattr(rig, end)._replace(**changes)})
    return rig


def in_frame(rig: RicherRig, **changes: float) -> RicherRig:
    """The rig with shared parameters replaced."""
    return rig._replace(frame=rig.frame._replace(**changes))


def with_law(rig: RicherRig, side: str | None, row: int, number: int, *values: float) -> RicherRig:
    """The rig with a second law at the ends of a side; a law of the whole rig is kept in the front end's row."""
    ends = ("front",) if row in SHARED else ends_of(side)
    kept = tuple(law for law in rig.laws if law.row != row or law.end not in ends)
    return rig._replace(laws=kept + tuple(Law(end, row, number, values) for end in ends))


def places_of(side: str | None, what: str) -> tuple[str, ...]:
    """Places like front_air for the ends of a side."""
    return tuple(f"{end}_{what}" for end in ends_of(side))


def sign(rng: np.random.Generator) -> float:
    """A random sign, -1 or 1."""
    return float(rng.choice([-1.0, 1.0]))


Apply = Callable[[RicherRig, float, str | None, np.random.Generator], Applied]
REGISTRY: dict[str, Effect] = {}
SECOND: dict[str, dict[str, Effect]] = {}  # effect id -> law -> effect by that law
LATER: dict[str, Effect] = {}  # kinds outside every family that came with the second laws


def effect(
    name: str,
    *,
    known: bool = True,
    sides: tuple[str | None, ...] = SIDES,
    comparable: bool = False,
    law: str = "first",
    foreign: bool = False,
) -> Callable[[Apply], Apply]:
    """Register a function as an effect with the first law of its family."""

    def register(function: Apply) -> Apply:
        REGISTRY[name] = Effect(name, known, sides, function, comparable, law, foreign)
        return function

    return register


def second_law(
    name: str, law: str, *, foreign: bool = True, sides: tuple[str | None, ...] | None = None
) -> Callable[[Apply], Apply]:
    """Register a function as another law of a known effect; at the sides of the first law unless told."""

    def register(function: Apply) -> Apply:
        where = REGISTRY[name].sides if sides is None else sides
        SECOND.setdefault(name, {})[law] = Effect(name, True, where, function, law=law, foreign=foreign)
        return function

    return register


def outside(name: str, *, sides: tuple[str | None, ...] = SIDES) -> Callable[[Apply], Apply]:
    """Register a kind that lies outside every family."""

    def register(function: Apply) -> Apply:
        LATER[name] = Effect(name, False, sides, function)
        return function

    return register
