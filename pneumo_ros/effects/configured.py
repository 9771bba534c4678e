# SPDX-License-Identifier: Apache-2.0
"""Effects that a rig's configuration names: checked against the library, with their values in its order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from pneumo_ros.effects.contract import Effect, ends_of
from pneumo_ros.effects.loading import load_library
from pneumo_ros.effects.parameters import Active
from pneumo_ros.errors import InputError
from pneumo_ros.rig import NamedEffect, Rig


def standing_effects(rig: Rig, library: Mapping[str, Effect]) -> tuple[Active, ...]:
    """The effects of a rig as the model takes them.

    Raises
    ------
    InputError
        if one is not in the library, acts where it cannot, or has other parameters than the library's.
    """
    found = tuple(_active(one, rig, library) for one in rig.effects)
    _once_an_end(found, rig, library)
    return found


def library_of(rig: Rig, files: Sequence[str | Path] = ()) -> dict[str, Effect]:
    """The package's library, the files that the rig's own effects name, and further ones.

    A file that is not on this computer is left out: a log travels, and its effect may be given with ``files``.
    """
    named = dict.fromkeys(one.file for one in rig.effects if one.file)
    return load_library([*(file for file in named if Path(file).exists()), *files])


def _active(one: NamedEffect, rig: Rig, library: Mapping[str, Effect]) -> Active:
    where, effect = f"effects of {rig.name}", library.get(one.effect)
    if effect is None:
        missing = f"{one.file} is not here; " if one.file else ""
        remedy = f"{missing}give the Python file that defines it (pneumo diagnose: --effect; in the rig file: file)"
        raise InputError("unknown effect", where=where, key=one.effect, allowed=", ".join(library), remedy=remedy)
    if one.site not in effect.sites:
        allowed = ", ".join(repr(site) for site in effect.sites)
        raise InputError("cannot act there", where=where, key=f"{one.effect}.site", value=one.site, allowed=allowed)
    given, names = dict(one.parameters), [p.name for p in effect.parameters]
    if set(given) != set(names):
        raise InputError("wrong parameters", where=where, key=one.effect, value=", ".join(given),
                         allowed=", ".join(names),
                         remedy="give them all; a rig saved by another version is saved again by this one")  # fmt: skip
    for p in effect.parameters:
        if not p.low <= given[p.name] <= p.high or not math.isfinite(given[p.name]):
            raise InputError("value out of range", where=where, key=f"{one.effect}.{p.name}", value=given[p.name],
                             allowed=f"{p.low:g} to {p.high:g} {p.unit}")  # fmt: skip
    return Active(one.effect, one.site, tuple(given[name] for name in names))


def _once_an_end(found: Sequence[Active], rig: Rig, library: Mapping[str, Effect]) -> None:
    """Two terms of one kind cannot act at one end: the kernel has one place for each."""
    seen: set[tuple[str, int]] = set()
    for one in found:
        places = {(one.effect, end) for end in ends_of(one.site).columns}
        if library[one.effect].term is not None and places & seen:
            raise InputError("named twice at one end", where=f"effects of {rig.name}", key=one.effect,
                             remedy="keep one entry")  # fmt: skip
        seen |= places
