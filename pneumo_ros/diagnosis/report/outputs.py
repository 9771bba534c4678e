# SPDX-License-Identifier: Apache-2.0
"""The files of a diagnosis: diagnosis.json for programs, report.html for people, residual.mcap for plotting tools."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.signals import Signals
from pneumo_ros.diagnosis.half_car.where import (
    Location,
    conditional_gaps,
    locate,
    missing_law,
    occurrence,
    predict_located,
)
from pneumo_ros.diagnosis.half_car.where.design import car_of
from pneumo_ros.diagnosis.half_car.where.regimes import harmonics
from pneumo_ros.diagnosis.judge.held_out import channel_gaps, total_gap
from pneumo_ros.diagnosis.report.contents import Findings, told
from pneumo_ros.diagnosis.report.page import write_report
from pneumo_ros.diagnosis.report.residual_log import write_residual_log
from pneumo_ros.diagnosis.report.steps import Asked
from pneumo_ros.diagnosis.report.story import Story
from pneumo_ros.diagnosis.result import Diagnosis, write_json
from pneumo_ros.effects.loading import laws_of, own_ids
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.errors import InputError

MAX_LAWS: Final = 2  # places whose missing law is drawn [display]
# names of the files that a diagnosis leaves [definition]
FILES: Final = ("diagnosis.json", "report.html", "residual.mcap")


def claim_folder(folder: Path) -> None:
    """Make the folder and see that it can be written, before the time of a diagnosis is spent.

    Raises
    ------
    InputError
        if it cannot.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"cannot write there ({reason})", where=folder, remedy="choose another folder") from error


def write_files(
    folder: Path, diagnosis: Diagnosis, findings: Findings, write_residuals: Callable[[Path], None]
) -> tuple[list[Path], Story]:
    """Write report.html, residual.mcap (by ``write_residuals``) and, last, diagnosis.json; older ones are replaced.

    diagnosis.json, which programs look for, comes last: where it is new, the others are.

    Returns
    -------
    The files, and what the report says first.

    Raises
    ------
    InputError
        if the folder cannot be made or written.
    """
    claim_folder(folder)
    write_report(folder / FILES[1], findings)
    write_residuals(folder / FILES[2])
    write_json(diagnosis, folder / FILES[0])
    return [folder / name for name in FILES], told(findings)


def write_outputs(
    folder: Path,
    diagnosis: Diagnosis,
    model: RigModel,
    fit: Sequence[Signals],
    holdout: Signals,
    location: Location | None = None,
    asked: Asked | None = None,
) -> tuple[list[Path], Story]:
    """Write all files of a diagnosis of the half car, see :func:`write_files`.

    Parameters
    ----------
    folder : made if it is not there
    fit, holdout : the logs that were fitted and held out
    location : from :func:`pneumo_ros.diagnosis.half_car.where.locate` on these logs, if it is at hand
    asked : what the user typed
    """
    where = location or locate(model, fit, holdout)
    findings = replace(_findings(diagnosis, model, fit, holdout, where), asked=asked)
    return write_files(
        folder, diagnosis, findings, lambda path: write_residual_log(path, holdout, diagnosis.trajectories)
    )


def _findings(
    diagnosis: Diagnosis, model: RigModel, fit: Sequence[Signals], holdout: Signals, where: Location
) -> Findings:
    runs = {name: run for name, run in diagnosis.trajectories.items() if name in ("nominal", "refit", "best")}
    error = np.where(holdout.weight > 0, holdout.measured - runs["refit"], 0.0) / holdout.scale
    telling = not where.flat and bool(where.shares)
    return Findings(
        summary=diagnosis.to_json(),
        trajectories=runs,
        holdout=holdout,
        fit_names=[log.name for log in fit],
        library=laws_of(model.library),
        priors={p.name: (p.nominal, p.std) for p in model.parameters},
        own=own_ids(model.library),
        regimes=_sentences(where, holdout, error) if telling else [],
        conditional=conditional_gaps(car_of(model, where.start.values(model, where.refit_nuisance)), holdout),
        mended=_mended(model, where) if telling and where.followed and diagnosis.verdict == "unknown" else None,
        laws=[missing_law(where, place) for place in _one_of_a_kind(where)] if telling else [],
    )


def _one_of_a_kind(where: Location) -> list[str]:
    """The first place of each kind (spring, air, tyre, sensor ...): front and rear of one kind show the same law."""
    kinds: dict[str, str] = {}
    for place in where.chosen:
        kinds.setdefault(place.removeprefix("front_").removeprefix("rear_").split(":")[0], place)
    return list(kinds.values())[:MAX_LAWS]


def _sentences(where: Location, holdout: Signals, error: Array) -> list[str]:
    """When the gap shows, and what its harmonics say where the road is one sine."""
    out = [occurrence(where, error).text]
    found = harmonics(holdout.road, error, holdout.period)
    if found is not None:
        kind = "odd, as symmetric laws make them" if found.odd > found.even else "even, as one-sided laws make them"
        out.append(
            f"the road is one sine of {found.frequency:.3g} Hz; the error's harmonics are mostly {kind} "
            f"(odd {found.odd:.2f}, even {found.even:.2f} of the first)"
        )
    return out


def _mended(model: RigModel, where: Location) -> float:
    """Held-out gap of the free run with the chosen places mended by their flexible corrections."""
    return total_gap(channel_gaps(where.judge.signals, predict_located(model, where, where.judge)))
