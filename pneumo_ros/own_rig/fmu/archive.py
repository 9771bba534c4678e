# SPDX-License-Identifier: Apache-2.0
"""model.fmu as an archive: what is in it is looked at before anything is unpacked, and only what is needed is.

An FMU holds compiled code, which its user runs as they run rig.py: nothing here makes a hostile one harmless. What is
refused is what no exporter writes, and what only looks like an FMU.
"""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from pneumo_ros.errors import InputError

DESCRIPTION = "modelDescription.xml"
MOST_FILES = 20_000
MOST_BYTES = 1_000_000_000  # unpacked; tables and the libraries of every platform of a large FMU stay below
MOST_TEXT = 64_000_000  # of the description: 100,000 variables
RATIO, FROM = 100, 50_000_000  # compiled code and tables shrink to a third, not to a hundredth, of what is large


def unpack(path: Path, folder: Path, platforms: Sequence[str]) -> None:
    """Unpack description, resources and this platform's binaries.

    Parameters
    ----------
    folder : an empty one
    platforms : names of this platform's folder below ``binaries/``, by version of FMI

    Raises
    ------
    InputError
        if it is no zip, or one that no exporter writes.
    """
    if not path.is_file():
        raise InputError("no such file", where=path, key="--rig-model", remedy="check the name")
    wanted = (DESCRIPTION, "resources/", *(f"binaries/{one}/" for one in platforms))
    try:
        with zipfile.ZipFile(path) as archive:
            _check(path, archive.infolist())
            names = [one for one in archive.namelist() if one.startswith(wanted)]
            archive.extractall(folder, members=names)
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, OSError) as error:
        raise InputError("not an FMU: no zip that can be read", where=path, value=str(error)[:60],
                         remedy="export it again") from error  # fmt: skip
    text = folder / DESCRIPTION
    if b"<!DOCTYPE" in text.read_bytes():
        raise InputError(f"{DESCRIPTION} has a document type", where=path, remedy="no FMU needs one: export it again")


def _check(path: Path, files: Sequence[zipfile.ZipInfo]) -> None:
    sizes = {one.filename: one.file_size for one in files}
    if DESCRIPTION not in sizes:
        raise InputError(f"not an FMU: no {DESCRIPTION} in it", where=path, remedy="export it again")
    for name in sizes:
        if ".." in PurePosixPath(name).parts or name.startswith("/") or "\\" in name or ":" in name:
            raise InputError("a path that leads out of the archive", where=path, value=name, remedy="do not use it")
    total, packed = sum(one.file_size for one in files), path.stat().st_size
    if len(files) > MOST_FILES or total > MOST_BYTES or (total > FROM and total > RATIO * packed):
        raise InputError("the archive unpacks to too much", where=path, value=f"{len(files)} files, {total} bytes",
                         allowed=f"{MOST_FILES} files, {MOST_BYTES} bytes, {RATIO} times the archive")  # fmt: skip
    if sizes[DESCRIPTION] > MOST_TEXT:
        raise InputError(f"{DESCRIPTION} is too large", where=path, value=sizes[DESCRIPTION],
                         allowed=f"up to {MOST_TEXT} bytes")  # fmt: skip
