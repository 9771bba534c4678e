# SPDX-License-Identifier: Apache-2.0
"""The rig after diagnosis, as a file that every verb takes.

``rig:`` holds what controllers and estimators may believe: parameters at their estimates (the mean of front and rear
where the rig has one number for both), and effects that are a number of the rig. ``ends:`` holds what each end has of
its own, ``effects:`` everything else. The commanded outlet areas stay as they are: what is estimated is the opening
that this command really gives, and it is an end's own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.effects.contract import Effect
from pneumo_ros.effects.loading import load_library
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import NUISANCE, RigModel
from pneumo_ros.errors import InputError
from pneumo_ros.rig import END_LIMITS, LIMITS, NamedEffect, Rig

_OUTLETS = ("outlet_area_front", "outlet_area_rear")


def corrected_rig(found: Diagnosis, model: RigModel, files: Sequence[Path] = ()) -> Rig:
    """The model's rig as diagnosed: its numbers, what its ends have of their own, its effects.

    Parameters
    ----------
    files : Python files with effects of the user's own, so that the rig file can name them
    """
    estimates = {name: estimate.value for name, estimate in found.nuisance.items()}
    means: dict[str, list[float]] = {}
    for name, quantity in NUISANCE.items():
        if name in estimates and quantity not in _OUTLETS:
            means.setdefault(quantity, []).append(estimates[name])
    rig = model.rig.with_values(**{quantity: float(np.mean(numbers)) for quantity, numbers in means.items()})
    base = model.plant()
    own = {**dict(rig.ends), **{name: value for name, value in estimates.items() if name in END_LIMITS}}
    own |= {"reference_pressure_front": base.front.reference_pressure,
            "reference_pressure_rear": base.rear.reference_pressure}  # fmt: skip
    rig, rest = _folded(rig, found.active)
    effects = (*rig.effects, *(_named(one, model.library, files) for one in rest))
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


def _named(one: Active, library: Mapping[str, Effect], files: Sequence[Path]) -> NamedEffect:
    effect = library[one.effect]
    values = tuple((p.name, float(v)) for p, v in zip(effect.parameters, one.values, strict=True))
    # A file is loaded once for each content, so the same object comes back.
    file = next((f for f in files if load_library([f]).get(one.effect) is effect), None)
    return NamedEffect(one.effect, one.site, values, "" if file is None else str(file.resolve()))


def save_corrected_rig(found: Diagnosis, model: RigModel, path: Path, files: Sequence[Path] = ()) -> Path:
    """Write the corrected rig; an older file is replaced.

    Raises
    ------
    InputError
        if the file cannot be written.
    """
    part = path.with_name(path.name + ".part")
    try:
        part.write_text(corrected_rig(found, model, files).to_yaml(), encoding="utf-8")
        part.replace(path)
    except OSError as error:
        raise InputError(f"cannot write the rig ({error})", where=path, remedy="choose another path") from error
    return path
