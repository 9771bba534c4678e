"""A diagnosis from log files: reads them, builds the model with the wanted library, and runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from pneumo_ros.errors import InputError
from pneumo_ros.gap.compete import Progress
from pneumo_ros.gap.diagnose import Options, diagnose
from pneumo_ros.gap.diagnosis import Diagnosis
from pneumo_ros.gap.effects.loading import load_library
from pneumo_ros.gap.rig_model import RigModel
from pneumo_ros.gap.signals import check_pair, read_signals
from pneumo_ros.gap.where import place_gaps
from pneumo_ros.rig import Rig


def diagnose_files(
    fit: Sequence[str | Path],
    holdout: str | Path | None = None,
    rig: Rig | None = None,
    edit: str | Path | None = None,
    effects: Sequence[str | Path] = (),
    without: Sequence[str] = (),
    options: Options | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnose logs.

    Parameters
    ----------
    fit : logs to fit, at least one
    holdout : log nothing is fitted to; None: the end of the last fit log
    rig : in place of the one the logs carry
    edit : log of the rig after a known change (its own configuration states the change)
    effects : Python files with further effects
    without : ids of effects that must not compete

    Raises
    ------
    InputError
        for logs, rigs or effects that cannot be used.
    """
    if not fit:
        raise InputError("no log to fit", remedy="give at least one log")
    if progress is not None:
        progress(0.0, "reading the logs")
    logs = [read_signals(path, rig) for path in fit]
    held = None if holdout is None else read_signals(holdout, rig)
    check_pair(logs, held)
    library = load_library(effects)
    for name in without:
        if name not in library:
            raise InputError("unknown effect", key="without", value=name, allowed=", ".join(sorted(library)))
    model = RigModel(logs[0].rig, library, frozenset(without))
    chosen = options or Options()
    if chosen.locate is None:
        chosen = replace(chosen, locate=place_gaps)
    changed = None if edit is None else read_signals(edit)
    return diagnose(model, logs, held, chosen, progress, changed)
