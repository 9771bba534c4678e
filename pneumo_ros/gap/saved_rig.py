"""The rig after diagnosis, as a file that every verb takes.

What the nominal equations can hold goes into ``rig:`` (parameters at their estimates, the mean of front and rear where
the rig has one number for both); the effects themselves are listed under ``effects:`` for those who simulate with them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pneumo_ros.errors import InputError
from pneumo_ros.gap.diagnosis import Diagnosis
from pneumo_ros.gap.rig_model import NUISANCE, RigModel
from pneumo_ros.rig import Rig


def corrected_rig(found: Diagnosis, model: RigModel) -> Rig:
    """The model's rig with its estimated parameters."""
    values: dict[str, list[float]] = {}
    for name, quantity in NUISANCE.items():
        if name in found.nuisance:
            values.setdefault(quantity, []).append(found.nuisance[name].value)
    means = {quantity: float(np.mean(numbers)) for quantity, numbers in values.items()}
    means |= _folded(found, model.rig, means)
    return model.rig.with_values(**means)


def _folded(found: Diagnosis, rig: Rig, means: dict[str, float]) -> dict[str, float]:
    """Effects that are a value of the rig itself."""
    out = {}
    for one in found.active:
        if one.effect == "payload":
            out["sprung_mass"] = means.get("sprung_mass", rig.sprung_mass.value) + one.values[0]
        elif one.effect == "cg_shift":
            out["front_arm"] = rig.front_arm.value - one.values[0]
            out["rear_arm"] = rig.rear_arm.value + one.values[0]
        elif one.effect == "viscous_damping" and one.site == "both":
            out["bushing_damping"] = means.get("bushing_damping", rig.bushing_damping.value) + one.values[0]
    return out


def save_corrected_rig(found: Diagnosis, model: RigModel, path: Path) -> Path:
    """Write the corrected rig; an older file is replaced.

    Raises
    ------
    InputError
        if the file cannot be written.
    """
    document: dict[str, Any] = {
        "rig": corrected_rig(found, model).to_dict(),
        "effects": [
            {
                "effect": one.effect,
                "site": one.site,
                "parameters": {
                    p.name: float(v) for p, v in zip(model.library[one.effect].parameters, one.values, strict=True)
                },
            }
            for one in found.active
        ],
    }
    part = path.with_name(path.name + ".part")
    try:
        part.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
        part.replace(path)
    except OSError as error:
        raise InputError(f"cannot write the rig ({error})", where=path, remedy="choose another path") from error
    return path
