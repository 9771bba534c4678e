# SPDX-License-Identifier: Apache-2.0
"""The files of a diagnosis of one's own rig: as the half car's, and the rig as it was found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.report.card import RigCard
from pneumo_ros.diagnosis.report.contents import Findings
from pneumo_ros.diagnosis.report.outputs import write_files
from pneumo_ros.diagnosis.report.quantities import readable
from pneumo_ros.diagnosis.report.residual_log import PREFIXES, new_residual_log, tables_of, write_joints
from pneumo_ros.diagnosis.report.steps import Asked
from pneumo_ros.diagnosis.report.story import Story
from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.effects.parameters import is_law
from pneumo_ros.errors import InputError
from pneumo_ros.files import new_file
from pneumo_ros.own_rig.model import OwnRig
from pneumo_ros.own_rig.picture import picture_of
from pneumo_ros.own_rig.quantities import UNITS
from pneumo_ros.own_rig.records import OwnRecord

DIGITS = 12  # of a saved number: the saved rig is the fitted one to 1e-9


def summary_of(found: Diagnosis) -> dict[str, Any]:
    """The diagnosis as page and terminal tell it."""
    return {**found.to_json(), "rig_model": True}


def write_outputs(
    folder: Path,
    found: Diagnosis,
    model: OwnRig,
    fit: Sequence[OwnRecord],
    holdout: OwnRecord,
    asked: Asked | None = None,
) -> tuple[list[Path], Story]:
    """Write all files of a diagnosis, see :func:`pneumo_ros.diagnosis.report.outputs.write_files`."""
    runs = {name: run for name, run in found.trajectories.items() if name in PREFIXES}
    findings = Findings(
        summary=summary_of(found),
        trajectories=runs,
        holdout=holdout,
        fit_names=[record.name for record in fit],
        library={name: effect for name, effect in model.library.items() if is_law(name)},
        priors={p.name: (p.nominal, p.std) for p in model.parameters},
        asked=asked,
        card=card_of(model, holdout),
    )
    return write_files(folder, found, findings, lambda path: write_residuals(path, model, holdout, runs))


def card_of(model: OwnRig, record: OwnRecord) -> RigCard:
    """How the page speaks of the rig."""
    titles = {name: name.replace("_", " ") for name in model.channels}
    units = {}
    for k, (name, spec) in enumerate(model.description.channels.items()):
        units[name] = readable(UNITS[spec.unit][2], record.measured[:, k])
    return RigCard(titles, units, picture_of(model.physics.slots), model.description.name)


def write_residuals(path: Path, model: OwnRig, holdout: OwnRecord, runs: Mapping[str, Array]) -> None:
    """The held-out log beside the free runs, each a JointState by channel: ``/measured/channels``, ``/nominal/...``."""
    stamps = np.round(holdout.time * 1e9).astype(np.int64)
    with new_residual_log(path, {"log": holdout.name, "rig": model.description.name}) as writer:
        for prefix, table in tables_of(holdout, runs).items():
            write_joints(writer, f"{prefix}/channels", "rig", model.channels, stamps, table)


def save_rig(found: Diagnosis, model: OwnRig, path: Path) -> Path:
    """The rig file with the estimates in place of its numbers, the effects that were found, and their slots' scales.

    Raises
    ------
    InputError
        if it cannot be written.
    """
    table = dict(model.description.raw)
    parameters = dict(table.get("parameters") or {})
    for name, estimate in found.nuisance.items():
        unit = "" if estimate.unit == "1" else f" {estimate.unit}"
        parameters[name] = f"{estimate.value:.{DIGITS}g} +- {min(estimate.std, _stated(model, name)):.4g}{unit}"
    effects = (*model.configured, *found.active)
    table["parameters"] = parameters
    if effects:
        table["effects"] = [{"effect": a.effect, "site": a.site, "values": [float(f"{v:.{DIGITS}g}") for v in a.values]}
                            for a in effects]  # fmt: skip
        table["scales"] = _scales(model, {a.site for a in effects})
    try:
        with new_file(path) as part:
            part.write_text(yaml.safe_dump(table, sort_keys=False, allow_unicode=True, width=100), encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write the rig ({error})", where=path, remedy="choose another path") from error
    return path


def _stated(model: OwnRig, name: str) -> float:
    return model.description.parameters[name].std


def _scales(model: OwnRig, places: set[str]) -> dict[str, list[float]]:
    out = {}
    for k, slot in enumerate(model.physics.inside):
        if slot.place in places:
            out[slot.place] = [float(f"{v:.{DIGITS}g}") for v in model.scaling.inside[k]]
    for place, S in model.scaling.signals.items():
        if place in places:
            out[place] = [float(f"{v:.{DIGITS}g}") for v in S]
    return out
