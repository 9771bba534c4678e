# SPDX-License-Identifier: Apache-2.0
"""What is there already is not written over unless the user says so."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated

import typer

from pneumo_ros.errors import InputError

Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace outputs that exist already.")]
DIAGNOSIS_FILES = ("diagnosis.json", "report.html", "residual.mcap")


def refuse_existing(files: Iterable[Path], overwrite: bool) -> None:
    """Refuse outputs that exist, unless they may be replaced.

    Raises
    ------
    InputError
        naming the first of them.
    """
    there = [file for file in files if file.exists()]
    if there and not overwrite:
        raise InputError("exists already", where=there[0], remedy="choose another name, or say --overwrite")


@contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """The folder of a diagnosis: made and seen to be writable, and gone again if nothing came of it.

    Raises
    ------
    InputError
        if it cannot be written.
    """
    from pneumo_ros.diagnosis.report import claim_folder

    made = not folder.exists()
    claim_folder(folder)
    try:
        yield
    except BaseException:
        if made:
            with suppress(OSError):
                folder.rmdir()  # refuses where anything is inside
        raise


def refuse_old_diagnosis(folder: Path, save_rig: Path | None, overwrite: bool, inputs: Iterable[Path] = ()) -> None:
    """Refuse an older diagnosis, and a rig of an older one that would stay beside the new verdict.

    Parameters
    ----------
    save_rig : where the corrected rig goes, if it is wanted
    inputs : files that are read, which may lie in the folder
    """
    files = [folder / name for name in DIAGNOSIS_FILES]
    if not any(file.exists() for file in files):
        refuse_existing([save_rig] if save_rig is not None else [], overwrite)
        return
    refuse_existing([*files, *([save_rig] if save_rig is not None else [])], overwrite)
    kept = {path.resolve() for path in (*inputs, *([save_rig] if save_rig is not None else []))}
    for path in sorted(folder.glob("*.yaml")):
        if path.resolve() not in kept and _is_diagnosed_rig(path):
            raise InputError("the rig of an older diagnosis would stay beside the new verdict", where=path,
                             remedy="move it away, or write the new one over it with --save-rig")  # fmt: skip


def _is_diagnosed_rig(path: Path) -> bool:
    from pneumo_ros.rig import load_rig

    try:
        return load_rig(path).diagnosed
    except InputError:
        return False
