# SPDX-License-Identifier: Apache-2.0
"""What can be wrong with a rig, as the maker of cases states it: effect ids of the contract with the laws that each may
follow, and kinds that lie outside every family.

An effect turns a size in (0, 1] (1 is the largest sane one) into changes of the rig's parameters. The laws are the
richer rig's own; what a label says about parameters is what somebody with a bench would measure.
"""

from __future__ import annotations

from pneumo_ros.casemaker import (  # noqa: F401  # they fill the registry, first laws before second ones  # noqa: F401
    known_air,
    known_force,
    known_sensor,
    outside_kinds,
    second_air,
    second_force,
    second_sensor,
    unknown,
)
from pneumo_ros.casemaker.registry import LATER, REGISTRY, SECOND, Effect

# Kinds of the first sets that a family may well explain by a law of its own: they are no longer called outside.
EXPLAINABLE = ("valve_stiction", "valve_slew", "binding_guide", "lvdt_cosine", "tyre_hardening")


def known_effects() -> tuple[str, ...]:
    """Ids of the contract that a case can carry."""
    return tuple(name for name, item in REGISTRY.items() if item.known)


def unknown_kinds() -> tuple[str, ...]:
    """Kinds that the contract does not list, as the sets up to 0.3 use them."""
    return tuple(name for name, item in REGISTRY.items() if not item.known)


def outside_all() -> tuple[str, ...]:
    """Kinds outside every family."""
    return (*(name for name in unknown_kinds() if name not in EXPLAINABLE), *LATER)


def laws_of(name: str, *, foreign: bool) -> tuple[str, ...]:
    """Laws of an effect that the library contains, or those that it does not."""
    first = (REGISTRY[name].law,) if REGISTRY[name].foreign == foreign else ()
    return first + tuple(law for law, item in SECOND.get(name, {}).items() if item.foreign == foreign)


def get(name: str, law: str = "") -> Effect:
    """The effect of a name by one of its laws; without a law, by its first one."""
    if law and law in SECOND.get(name, {}):
        return SECOND[name][law]
    return LATER[name] if name in LATER else REGISTRY[name]
