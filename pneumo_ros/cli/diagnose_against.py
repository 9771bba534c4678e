# SPDX-License-Identifier: Apache-2.0
"""`pneumo diagnose B --against A`: what changed between two logs. A fits the rig, B is diagnosed against it."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from pneumo_ros.cli.terminal import Console
from pneumo_ros.errors import InputError

if TYPE_CHECKING:
    from pneumo_ros.diagnosis.result import Diagnosis
    from pneumo_ros.rig import Rig


def check_against(against: Path | None) -> None:
    """The earlier log is there, before seconds of imports."""
    if against is not None and not against.exists():
        raise InputError("no such file", where=against, key="--against", remedy="check the name")


@contextmanager
def fitted_half_car(
    console: Console, against: Path, rig: Rig | None, effects: Sequence[Path], pairs: bool
) -> Iterator[Rig]:
    """The half car as a log has it: its numbers inside their tolerances, and the effects that it had already."""
    from pneumo_ros.cli.diagnosis_shown import progress_bar
    from pneumo_ros.diagnosis.diagnose import Options
    from pneumo_ros.diagnosis.half_car.from_logs import prepared
    from pneumo_ros.diagnosis.half_car.saved_rig import save_corrected_rig
    from pneumo_ros.rig import load_rig

    task = prepared([against], None, rig, None, effects)
    with progress_bar(console) as progress:
        bar = progress.add_task(f"fitting {against.name}", total=1.0)
        options = Options(pairs=pairs, threads=os.cpu_count() or 1)
        found = task.diagnose(options, lambda share, what: progress.update(bar, completed=share))
    with TemporaryDirectory() as folder:
        path = save_corrected_rig(found, task.model, Path(folder) / "rig.yaml")
        tell(console, against, found)
        yield load_rig(path)


@contextmanager
def fitted_own(console: Console, against: Path, model: Path, rig: Path | None, pairs: bool) -> Iterator[Path]:
    """The rig file of one's own rig as a log has it."""
    from pneumo_ros.cli.diagnosis_shown import progress_bar
    from pneumo_ros.cli.patience import answered
    from pneumo_ros.diagnosis.diagnose import Options
    from pneumo_ros.own_rig.from_files import prepared
    from pneumo_ros.own_rig.outputs import save_rig

    task = prepared(model, [against], None, rig, guard=answered(model))
    with progress_bar(console) as progress:
        bar = progress.add_task(f"fitting {against.name}", total=1.0)
        found = task.diagnose(Options(pairs=pairs), lambda share, what: progress.update(bar, completed=share))
    with TemporaryDirectory() as folder:
        path = save_rig(found, task.model, Path(folder) / "rig.yaml")
        tell(console, against, found)
        yield path


def tell(console: Console, against: Path, found: Diagnosis) -> None:
    """What the earlier log was found to have already; a log that tells nothing is no standard."""
    if found.verdict == "not_testable":
        raise InputError("the log cannot tell what the rig was", where=against, key="--against",
                         remedy="give one that moves more")  # fmt: skip
    had = "something without a name, which both logs may share" if found.verdict == "unknown" else found.verdict
    console.print(f"{against.name} had: {had} (gap left {found.gap.best:.3g})", highlight=False, soft_wrap=True)
