# SPDX-License-Identifier: Apache-2.0
"""Effects that a rig's configuration names: checked against the library, with their values in its order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from pneumo_ros.effects.contract import Effect, ends_of
from pneumo_ros.effects.loading import effect_in, laws_of, load_library, origin_of
from pneumo_ros.effects.parameters import Active
from pneumo_ros.errors import InputError
from pneumo_ros.rig import NamedEffect, Rig


def configured_effects(rig: Rig, library: Mapping[str, Effect]) -> tuple[Active, ...]:
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
    """The package's library, the files of a rig that the user gave as a file, and further ones of the user's.

    A rig out of a log has no files: what a log says is never imported.
    """
    named = dict.fromkeys(one.file for one in rig.effects if one.file)
    return load_library([*named, *files])


def with_files(rig: Rig, files: Sequence[str | Path]) -> Rig:
    """The rig of a log with the user's files for the effects it names."""
    given = {effect_in(Path(file)).id: str(Path(file).resolve()) for file in files}
    return replace(rig, effects=tuple(replace(one, file=given.get(one.effect, one.file)) for one in rig.effects))


def _active(one: NamedEffect, rig: Rig, library: Mapping[str, Effect]) -> Active:
    where, effect = f"effects of {rig.name}", library.get(one.effect)
    if effect is None:
        raise InputError("unknown effect", where=where, key=one.effect, allowed=", ".join(laws_of(library)),
                         remedy="give the Python file that defines it (--effect FILE), or a rig file with it beside it "
                                "(--rig FILE.yaml); a log's own paths are never opened")  # fmt: skip
    _same_source(one, effect, where)
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


def _same_source(one: NamedEffect, effect: Effect, where: str) -> None:
    origin = origin_of(effect)
    here = "" if origin is None else origin.digest
    if one.source and one.source != here:
        raise InputError(
            "the effect's source is another than the one that was recorded", where=where, key=one.effect,
            value=f"SHA-256 {here[:16]}" if here else "the package's own", allowed=f"SHA-256 {one.source[:16]}",
            remedy="give that file (--effect FILE), or a rig file without the line 'source:' (--rig FILE.yaml)",
        )  # fmt: skip


def _once_an_end(found: Sequence[Active], rig: Rig, library: Mapping[str, Effect]) -> None:
    """Two terms of one kind cannot act at one end: the kernel has one place for each."""
    seen: set[tuple[str, int]] = set()
    for one in found:
        places = {(one.effect, end) for end in ends_of(one.site).columns}
        if library[one.effect].term is not None and places & seen:
            raise InputError("named twice at one end", where=f"effects of {rig.name}", key=one.effect,
                             remedy="keep one entry")  # fmt: skip
        seen |= places
