"""What can be wrong with a rig, as the maker of cases states it: effect ids of the contract, and kinds no library has.

An effect turns a size in (0, 1] (1 is the largest sane one) into changes of the rig's parameters. The laws are the
richer rig's own; what a label says about parameters is what somebody with a bench would measure.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

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
    """

    id: str
    known: bool
    sides: tuple[str | None, ...]
    apply: Callable[[RicherRig, float, str | None, np.random.Generator], Applied] = field(repr=False)
    comparable: bool = False


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


def places_of(side: str | None, what: str) -> tuple[str, ...]:
    """Places like front_air for the ends of a side."""
    return tuple(f"{end}_{what}" for end in ends_of(side))


def sign(rng: np.random.Generator) -> float:
    """-1 or 1."""
    return float(rng.choice([-1.0, 1.0]))


REGISTRY: dict[str, Effect] = {}


def effect(
    name: str, *, known: bool = True, sides: tuple[str | None, ...] = SIDES, comparable: bool = False
) -> Callable[
    [Callable[[RicherRig, float, str | None, np.random.Generator], Applied]],
    Callable[[RicherRig, float, str | None, np.random.Generator], Applied],
]:
    """Register a function as an effect."""

    def register(
        function: Callable[[RicherRig, float, str | None, np.random.Generator], Applied],
    ) -> Callable[[RicherRig, float, str | None, np.random.Generator], Applied]:
        REGISTRY[name] = Effect(name, known, sides, function, comparable)
        return function

    return register


def known_effects() -> tuple[str, ...]:
    """Ids of the contract that a case can carry."""
    _load()
    return tuple(name for name, item in REGISTRY.items() if item.known)


def unknown_kinds() -> tuple[str, ...]:
    """Kinds that the contract does not list."""
    _load()
    return tuple(name for name, item in REGISTRY.items() if not item.known)


def get(name: str) -> Effect:
    """The effect of a name."""
    _load()
    return REGISTRY[name]


def _load() -> None:
    from pneumo_ros.casemaker import known_air, known_force, known_sensor, unknown  # noqa: F401
