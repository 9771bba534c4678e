# SPDX-License-Identifier: Apache-2.0
"""Logs of a folder by pairs, rigs and dates, as their names say.

A folder with ``fit`` and ``holdout`` is a pair; so are ``NAME-fit`` and ``NAME-holdout`` (or ``_``); every other log is
one whose end is held out. The rig is the first folder below the given one, or the log's name without its date; the date
is the last one in its path.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

LOGS = (".mcap", ".csv", ".tsv", ".parquet", ".mat")
PART = re.compile(r"^(.*?)[-_]?(fit|holdout)$", re.IGNORECASE)
DATE = re.compile(r"(20\d\d)-?([01]\d)-?([0-3]\d)(?:[T_ -]?([0-2]\d)[-:h.]?([0-5]\d)(?:[-:m.]?([0-5]\d))?)?(?!\d)")
BAG = "metadata.yaml"  # what makes a folder one log
DONE = "diagnosis.json"  # what makes a folder a result


@dataclass(frozen=True)
class Session:
    """One diagnosis to be made.

    Attributes
    ----------
    name : path below the folder, without ending; where its results go
    rig : its rig; "" where names do not tell
    date : as its names say; None where they do not
    fit, holdout : logs; without a held-out one the end of ``fit`` is held out
    """

    name: str
    rig: str
    date: datetime | None
    fit: Path
    holdout: Path | None = None

    @property
    def logs(self) -> tuple[Path, ...]:
        """Those that are there."""
        return (self.fit,) if self.holdout is None else (self.fit, self.holdout)


def sessions_in(folder: Path, results: Path, beside: Sequence[str] = ()) -> list[Session]:
    """Sessions of a folder, by name.

    Parameters
    ----------
    results : folder that is not looked into
    beside : endings of files that belong to a log of another ending
    """
    pairs: dict[Path, dict[str, Path]] = {}
    for log in _logs(folder, results.resolve()):
        if not log.name.endswith(tuple(beside)):
            name, part = _split(log)
            pairs.setdefault(log.parent / name, {})[part] = log
    return [one for stem, parts in sorted(pairs.items()) for one in _of(folder, stem, parts)]


def _of(folder: Path, stem: Path, parts: dict[str, Path]) -> Iterator[Session]:
    """The pair of a name, and its logs that have no partner."""
    whole = {"fit", "holdout"} <= set(parts)
    if whole:
        yield _session(folder, stem, parts["fit"], parts["holdout"])
    for part, log in sorted(parts.items()):
        if part == "" or not whole:
            yield _session(folder, log.parent / _bare(log), log, None)


def _logs(folder: Path, results: Path) -> Iterator[Path]:
    """Logs below a folder; a bag's folder is one, and its files are none."""
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or path.resolve() == results:
            continue
        if not path.is_dir():
            if path.suffix.lower() in LOGS:
                yield path
        elif (path / BAG).is_file() and not _has_pair(path):
            yield path
        elif not (path / DONE).is_file():
            yield from _logs(path, results)


def _has_pair(folder: Path) -> bool:
    parts = {_split(path)[1] for path in folder.iterdir() if path.suffix.lower() in LOGS}
    return {"fit", "holdout"} <= parts


def _bare(log: Path) -> str:
    return log.name if log.is_dir() else log.stem


def _split(log: Path) -> tuple[str, str]:
    """Name of the pair and part of it; a part of "" belongs to no pair."""
    found = PART.match(_bare(log))
    return (found[1], found[2].lower()) if found else (_bare(log), "")


def _session(folder: Path, stem: Path, fit: Path, holdout: Path | None) -> Session:
    path = stem.relative_to(folder)
    first = path.parts[0] if path.parts else ""
    return Session(
        path.as_posix() if path.parts else "session", _undated(first), date_in(path.as_posix()), fit, holdout
    )


def _undated(name: str) -> str:
    return DATE.sub("", name).strip(" -_.")


def date_in(text: str) -> datetime | None:
    """The last date in a name, ``2026-03-01``, ``20260301T1015``; None where there is none."""
    for found in reversed(list(DATE.finditer(text))):
        try:
            return datetime(*(int(part or 0) for part in found.groups()))  # type: ignore[arg-type]
        except ValueError:  # 20261399 is a number
            continue
    return None
