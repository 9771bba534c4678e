# SPDX-License-Identifier: Apache-2.0
"""The rig after diagnosis, as a file that every verb takes.

``rig:`` holds what controllers and estimators may believe: parameters at their estimates, and effects that are a number
of the rig. ``ends:`` holds what each end has of its own, ``effects:`` everything else. The commanded outlet areas stay
as they are: what is estimated is the opening that this command really gives, and it is an end's own.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.effects.contract import Effect
from pneumo_ros.effects.loading import origin_of
from pneumo_ros.effects.nuisance import NUISANCE, of_ends, stated
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.errors import InputError
from pneumo_ros.files import new_file
from pneumo_ros.rig import LIMITS, NamedEffect, Rig

# Numbers of the rig that its ends have of their own [definition]
_OUTLETS: Final = ("outlet_area_front", "outlet_area_rear")


def corrected_rig(found: Diagnosis, model: RigModel) -> Rig:
    """The model's rig as diagnosed: its numbers, what its ends have of their own, its effects."""
    estimates = {name: estimate.value for name, estimate in found.nuisance.items()}
    numbers = {name: estimates[name] for name in NUISANCE if name in estimates and name not in _OUTLETS}
    rig = model.rig.with_values(**numbers)
    base = model.plant()
    own = {**dict(rig.ends), **of_ends({**stated(model.rig), **estimates})}
    own |= {"reference_pressure_front": base.front.reference_pressure,
            "reference_pressure_rear": base.rear.reference_pressure}  # fmt: skip
    rig, rest = _folded(rig, found.active)
    effects = (*rig.effects, *(_named(one, model.library) for one in rest))
    return replace(rig, ends=tuple(own.items()), effects=effects)


def _folded(rig: Rig, active: Sequence[Active]) -> tuple[Rig, list[Active]]:
    """Effects that are a number of the rig become one; the others stay effects."""
    rest = []
    for one in active:
        change = _numbers(rig, one)
        if not change or any(not LIMITS[name].low <= value <= LIMITS[name].high for name, value in change.items()):
            rest.append(one)
            continue
        rig = rig.with_values(**change)
    return rig, rest


def _numbers(rig: Rig, one: Active) -> dict[str, float]:
    size = one.values[0]
    if one.effect == "payload":
        return {"sprung_mass": rig.sprung_mass.value + size}
    if one.effect == "cg_shift":
        return {"front_arm": rig.front_arm.value - size, "rear_arm": rig.rear_arm.value + size}
    return {}


def _named(one: Active, library: Mapping[str, Effect]) -> NamedEffect:
    effect = library[one.effect]
    values = tuple((p.name, float(v)) for p, v in zip(effect.parameters, one.values, strict=True))
    origin = origin_of(effect)
    if origin is None:
        return NamedEffect(one.effect, one.site, values)
    return NamedEffect(one.effect, one.site, values, origin.digest, str(origin.file))


def save_corrected_rig(found: Diagnosis, model: RigModel, path: Path) -> Path:
    """Write the corrected rig, and the sources of its own effects beside it; an older rig file is replaced.

    Raises
    ------
    InputError
        if the file cannot be written.
    """
    rig = corrected_rig(found, model)
    try:
        for one in rig.effects:
            _put_beside(one, path.parent)
        with new_file(path) as part:
            part.write_text(rig.to_yaml(saved=True), encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write the rig ({error})", where=path, remedy="choose another path") from error
    return path


def _put_beside(one: NamedEffect, folder: Path) -> None:
    """Copy the source of a user's own effect beside the rig file, which may name it from nowhere else.

    Raises
    ------
    InputError
        if the source changed since it was loaded, or another file has its name there.
    """
    if not one.file:
        return
    source, target = Path(one.file), folder / Path(one.file).name
    content = source.read_bytes()
    if hashlib.sha256(content).hexdigest() != one.source:
        raise InputError("the effect's file changed while it was in use", where=source, key=one.effect,
                         remedy="diagnose again")  # fmt: skip
    if not target.exists():
        with target.open("xb") as stream:
            stream.write(content)
    elif target.read_bytes() != content:
        raise InputError("another file of this name stands there", where=target, key=one.effect,
                         remedy="save the rig into another folder")  # fmt: skip
