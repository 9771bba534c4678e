# SPDX-License-Identifier: Apache-2.0
"""One piece of `pneumo diagnose-all`: a diagnosis into a folder of its own, kept when it is newer than what it read."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

RESULT = "diagnosis.json"  # written last


class Piece(NamedTuple):
    """One diagnosis: paths as texts, so that a cluster's workers can be given it.

    Attributes
    ----------
    fit, holdout : logs; "" splits ``fit``
    folder : of its results
    model, rig : of a rig of one's own, or ""
    pairs : whether two effects at once are looked for
    """

    fit: str
    holdout: str
    folder: str
    model: str
    rig: str
    pairs: bool


def diagnose_piece(piece: Piece) -> None:
    """Diagnose; a finished one is kept unless a log or a rig file is newer.

    Raises
    ------
    InputError
        for logs and rigs that cannot be used.
    """
    if finished(piece):
        return
    folder, holdout = Path(piece.folder), Path(piece.holdout) if piece.holdout else None
    (folder / RESULT).unlink(missing_ok=True)
    diagnose = _own if piece.model else _half_car
    diagnose(piece, [Path(piece.fit)], holdout, folder)


def finished(piece: Piece) -> bool:
    """Whether a result is there that is newer than all it was made of."""
    result = Path(piece.folder) / RESULT
    if not result.is_file():
        return False
    made = result.stat().st_mtime_ns
    return all(_changed(Path(name)) <= made for name in (piece.fit, piece.holdout, piece.model, piece.rig) if name)


def _changed(path: Path) -> int:
    files = [path, *path.iterdir()] if path.is_dir() else [path]
    return max((file.stat().st_mtime_ns for file in files if file.exists()), default=0)


def _own(piece: Piece, fit: list[Path], holdout: Path | None, folder: Path) -> None:
    from pneumo_ros.diagnosis.diagnose import Options
    from pneumo_ros.own_rig import outputs
    from pneumo_ros.own_rig.from_files import prepared

    task = prepared(Path(piece.model), fit, holdout, Path(piece.rig) if piece.rig else None)
    outputs.write_outputs(folder, task.diagnose(Options(pairs=piece.pairs)), task.model, task.fit, task.holdout)


def _half_car(piece: Piece, fit: list[Path], holdout: Path | None, folder: Path) -> None:
    from pneumo_ros.diagnosis.diagnose import Options
    from pneumo_ros.diagnosis.half_car.from_logs import prepared
    from pneumo_ros.diagnosis.report import write_outputs
    from pneumo_ros.rig import load_rig

    task = prepared(fit, holdout, load_rig(Path(piece.rig)) if piece.rig else None)
    write_outputs(folder, task.diagnose(Options(pairs=piece.pairs)), task.model, task.fit, task.holdout)
