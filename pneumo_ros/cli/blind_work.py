# SPDX-License-Identifier: Apache-2.0
"""The two pieces of work of a blind check, as functions of plain values so that any process can run them."""

from __future__ import annotations

import json
import subprocess
import time
from pathlib import Path

from pneumo_ros import __version__
from pneumo_ros.casemaker.case import made
from pneumo_ros.casemaker.planned import Planned


def make_case(item: tuple[Planned, str]) -> None:
    """Make one case below a folder: ``cases/<name>/`` and ``labels/<name>.json``."""
    case, folder = item
    made(case, Path(folder) / "cases", Path(folder) / "labels")


def diagnose_case(item: tuple[str, tuple[str, ...], str, str, int]) -> None:
    """Diagnose one case by so many threads into ``<results>/<name>.json``; a finished one is kept."""
    name, withhold, folder, results, threads = item
    target = Path(results) / f"{name}.json"
    if target.exists():
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    diagnosis = _diagnosis(Path(folder) / "cases" / name, withhold, threads)
    part = target.with_suffix(".part")
    content = {"diagnosis": diagnosis, "seconds": time.perf_counter() - began, "commit": _commit()}
    part.write_text(json.dumps(content, indent=1), "utf-8")
    part.rename(target)


def _commit() -> str:
    """Commit of the package's checkout; its version where there is none."""
    try:
        done = subprocess.run(["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=True,
                              cwd=Path(__file__).parent)  # fmt: skip
    except (OSError, subprocess.CalledProcessError):
        return __version__
    return done.stdout.strip()


def _diagnosis(case: Path, withhold: tuple[str, ...], threads: int) -> dict[str, object]:
    from pneumo_ros.diagnosis.diagnose import Options
    from pneumo_ros.diagnosis.half_car.from_logs import diagnose_files

    found = diagnose_files([case / "fit.mcap"], case / "holdout.mcap", edit=case / "edit.mcap", without=list(withhold),
                           options=Options(threads=threads))  # fmt: skip
    return dict(found.to_json())
