# SPDX-License-Identifier: Apache-2.0
"""`pneumo diagnose --rig-model rig.py`: any rig, by one file of physics and one of names."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from pneumo_ros.cli.app import program
from pneumo_ros.cli.diagnose_against import fitted_own
from pneumo_ros.cli.existing import claimed, refuse_old_diagnosis
from pneumo_ros.cli.patience import answered
from pneumo_ros.cli.terminal import Console
from pneumo_ros.errors import InputError


def diagnose_own(
    console: Console,
    model: Path,
    fit: Sequence[Path],
    holdout: Path | None,
    output: Path,
    rig: Path | None,
    without: Sequence[str],
    save_rig: Path | None,
    against: Path | None,
    pairs: bool,
    overwrite: bool,
) -> None:
    """Diagnose logs of one's own rig, write the files and tell the verdict.

    Raises
    ------
    InputError
        for whatever cannot be used, in one line.
    """
    from pneumo_ros.own_rig.from_files import rig_file_of

    _check_files(fit, holdout, model, rig_file_of(model, rig))
    refuse_old_diagnosis(output, save_rig, overwrite, [rig_file_of(model, rig)])
    from pneumo_ros.cli.diagnosis_shown import progress_bar, show
    from pneumo_ros.diagnosis.diagnose import Options
    from pneumo_ros.diagnosis.report import Asked
    from pneumo_ros.own_rig import outputs
    from pneumo_ros.own_rig.experiment import design_own
    from pneumo_ros.own_rig.from_files import prepared

    with claimed(output), ExitStack() as held:
        rig_asked = rig
        if against is not None:
            rig = held.enter_context(fitted_own(console, against, model, rig, pairs))
        task = prepared(model, fit, holdout, rig, without, answered(model))
        kernel = task.model.physics.kernel
        threads = (os.cpu_count() or 1) if kernel.compiled and not kernel.alone else 1
        with progress_bar(console) as progress:
            bar = progress.add_task("diagnosing", total=1.0)
            options = Options(pairs=pairs, threads=threads, experiment=design_own)
            found = task.diagnose(options, lambda share, what: progress.update(bar, completed=share, description=what))
        named = ("--rig-model", str(model), *(() if rig_asked is None else ("--rig", str(rig_asked))))
        asked = Asked(tuple(fit), holdout, output, save_rig, named, program=program())
        files, first = outputs.write_outputs(output, found, task.model, task.fit, task.holdout, asked)
        if found.experiment is not None:
            files += found.experiment.write(output)
        if save_rig is not None:
            files.append(outputs.save_rig(found, task.model, save_rig))
        show(console, found, first)
        for file in files:
            console.print(f"written  {file}", highlight=False, markup=False, soft_wrap=True)


def _check_files(fit: Sequence[Path], holdout: Path | None, model: Path, rig: Path) -> None:
    """What is read is there, before seconds of imports."""
    named = [("--rig-model", model), ("--rig", rig), *(("FIT", path) for path in fit)]
    for key, path in (*named, *([("--holdout", holdout)] if holdout is not None else [])):
        if not path.exists():
            beside = "write it beside rig.py, under its name" if key == "--rig" else "check the name"
            raise InputError("no such file", where=path, key=key, remedy=beside)
