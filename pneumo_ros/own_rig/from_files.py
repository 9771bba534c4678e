# SPDX-License-Identifier: Apache-2.0
"""A diagnosis of one's own rig from files: rig.py, rig.yaml, logs."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.diagnose import Options, diagnose, split_by_time
from pneumo_ros.diagnosis.fit.problem import MODEL_FORM_FLOOR
from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.diagnosis.search.state import Progress
from pneumo_ros.errors import InputError, not_one_of
from pneumo_ros.own_rig.description import Description, read_description
from pneumo_ros.own_rig.model import OwnRig, own_rig, windows_of
from pneumo_ros.own_rig.physics import Physics, load_physics
from pneumo_ros.own_rig.records import FEWEST, OwnRecord, read_record
from pneumo_ros.own_rig.whereabouts import whereabouts
from pneumo_ros.slots.laws import LAWS

APART = 30.0  # between what the model and the log move, from which on a unit is suspected
NEXT_TO_NOTHING = 0.1  # of the refit's held-out gap above the noise: a structure that leaves less hits no wrong form
AT_REST = 3.0  # sigmas of noise that a log must move by to be compared with


@dataclass(frozen=True)
class OwnTask:
    """Logs that were read and the model that fits them."""

    model: OwnRig
    fit: tuple[OwnRecord, ...]
    holdout: OwnRecord
    notes: tuple[str, ...] = ()

    def diagnose(self, options: Options | None = None, progress: Progress | None = None) -> Diagnosis:
        """Run the diagnosis; what is left is located by whatever closes it.

        A model form that nobody has stated is assumed large. Where the log stays below it and yet one name closes
        nearly all of the gap, the data say that the form is better than assumed: the diagnosis is run again by it.
        """
        chosen = options or Options()
        if chosen.locate is None:
            chosen = replace(chosen, locate=whereabouts)
        found, notes = diagnose(self.model, self.fit, self.holdout, chosen, progress), self.notes
        form = _shown_form(found) if self.model.description.form_assumed else None
        if form is not None:
            assumed = self.model.description.model_form
            notes += (f"model_form is not stated: {100 * assumed:g} % was assumed, more than the whole gap. One name "
                      f"closes nearly all of it, so {100 * form:.2g} % was taken: twice what that leaves",)  # fmt: skip
            fit = [replace(record, model_form=form) for record in self.fit]
            found = diagnose(self.model, fit, replace(self.holdout, model_form=form), chosen, progress)
        return replace(found, notes=(*notes, *found.notes))


def rig_file_of(model: Path, rig: Path | None) -> Path:
    """The rig file: the one that is named, or the one beside rig.py under its name."""
    return rig if rig is not None else model.with_suffix(".yaml")


def prepared(
    model: Path,
    fit: Sequence[Path],
    holdout: Path | None = None,
    rig: Path | None = None,
    without: Sequence[str] = (),
    guard: AbstractContextManager[None] | None = None,
) -> OwnTask:
    """Read everything and build the model.

    Parameters
    ----------
    model, rig : rig.py or model.fmu and its YAML; by default the one of the same name beside it
    fit, holdout : logs; without a held-out one the end of the last fitted one is held out
    without : families that do not compete
    guard : around what runs the user's code for the first time

    Raises
    ------
    InputError
        for whatever cannot be used, in one line.
    """
    if not fit:
        raise InputError("no log to fit", remedy="give at least one log")
    families = sorted({law.id.partition(".")[0] for law in LAWS})
    for name in without:
        if name not in families:
            raise not_one_of("unknown family", name, families, key="without")
    description = read_description(rig_file_of(model, rig))
    with guard or nullcontext():
        physics, description = _loaded(model, description)
    _check_apart(fit, holdout)
    records = [read_record(path, description) for path in fit]
    notes = []
    if not physics.kernel.compiled:
        notes.append(f"numba cannot compile {model.name}, which makes it about a hundred times slower: "
                     f"{physics.kernel.why_not}")  # fmt: skip
    if holdout is None:
        logs, held = split_by_time(records)
        notes.append("no held-out log was given: the end of the last fit log is held out, which tests less")
    else:
        logs, held = records, read_record(holdout, description)
    _check_alike(logs, held)
    if description.effects:
        names = ", ".join(f"{one.effect} ({one.site})" for one in description.effects)
        notes.append(f"the rig file names {names}: part of the model as stated there; what competes is what the logs "
                     "show beyond it")  # fmt: skip
    with np.errstate(all="ignore"):  # what is no number is refused in a line of its own
        made = own_rig(description, physics, logs, without)
        notes += _of_another_order(made, logs)
    return OwnTask(made, tuple(logs), held, tuple(notes))


def _of_another_order(model: OwnRig, records: Sequence[OwnRecord]) -> list[str]:
    """A note on each channel that the nominal model moves far more or less than the log: mostly a unit is wrong.

    More in short windows from the log's own state, because a free run may drift however right its units are; less in
    the free run, because a wrong state moves a window as far as it is wrong.
    """
    windows = [w for record in records for w in windows_of(model.description, model.physics, record)]
    more = _moves(model, [(w.record, w.state) for w in windows])
    less = _moves(model, [(record, model.initial(record)[0]) for record in records])
    notes = []
    for name, far, near in zip(model.channels, more, less, strict=True):
        ratio = near if near < 1.0 / APART else far
        if ratio < 1.0 / APART or ratio > APART:
            notes.append(f"{name}: the nominal model moves {ratio:.2g} times as far as the log; if that is a unit: "
                         "rig.py gets SI, whatever units rig.yaml names")  # fmt: skip
    return notes


def _shown_form(found: Diagnosis) -> float | None:
    """Model form that the data themselves show, as a share of a channel's standard deviation; None where they do not.

    They show one where the verdict is "none", the refit leaves more than noise, and the best named structure closes
    nearly all of that (:data:`NEXT_TO_NOTHING`): then it is twice what that structure leaves above the noise."""
    if found.verdict != "none":
        return None
    left = min((entry.gap_after for entry in found.ranking if entry.parameters), default=np.inf)
    noise = found.gap.noise_floor**2
    own, whole = (np.sqrt(max(gap**2 - noise, 0.0)) for gap in (left, found.gap.refit))
    return float(max(2.0 * own, MODEL_FORM_FLOOR)) if whole**2 > noise and own < NEXT_TO_NOTHING * whole else None


def _moves(model: OwnRig, pieces: Sequence[tuple[Any, Array]]) -> Array:
    """(C,) how far the nominal model moves from where it starts, rms, in units of what the log does; 1 for a channel
    that is at rest.
    """
    nominal = np.array([p.nominal for p in model.parameters])
    runs = [model.predict(record, nominal, state, ()) for record, state in pieces]
    own = np.vstack([run - run[0] for run in runs])
    seen = np.vstack([record.measured - record.measured[0] for record, _ in pieces])
    far, moved = (np.sqrt(np.mean(one**2, axis=0)) for one in (own, seen))
    noise = np.max([record.noise for record, _ in pieces], axis=0)
    return np.where(moved > AT_REST * noise, far / np.maximum(moved, 1e-300), 1.0)


def _loaded(model: Path, description: Description) -> tuple[Physics, Description]:
    if model.suffix.lower() != ".fmu":
        return load_physics(model, description), description
    from pneumo_ros.own_rig.fmu.model import load_fmu  # fmpy only where it is needed

    return load_fmu(model, description)


def _check_apart(fit: Sequence[Path], holdout: Path | None) -> None:
    """A log counts once, and what is held out is fitted by nothing."""
    files = [path.resolve() for path in fit]
    for one, path in zip(files, fit, strict=True):
        if files.count(one) > 1:
            raise InputError("the log is given twice", where=path, key="FIT", remedy="give it once")
    if holdout is not None and holdout.resolve() in files:
        raise InputError("the held-out log is fitted as well", where=holdout, key="--holdout",
                         remedy="leave --holdout away: the end of the log is held out then")  # fmt: skip


def _check_alike(logs: Sequence[OwnRecord], held: OwnRecord) -> None:
    for one in (*logs, held):
        if len(one.measured) < FEWEST:
            raise InputError("too few rows to fit or to hold out", where=one.name, value=len(one.measured),
                             allowed=f"at least {FEWEST}", remedy="record longer, or give a held-out log")  # fmt: skip
