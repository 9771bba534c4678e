# SPDX-License-Identifier: Apache-2.0
"""The files of a log: one MCAP file, or a folder as ``ros2 bag record`` writes it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pneumo_ros.documents import parse_yaml
from pneumo_ros.errors import InputError
from pneumo_ros.log.bounds import free_for_messages
from pneumo_ros.log.container import MAGIC, Contents, DamageError, check_magic
from pneumo_ros.log.records import Gathered, Records, gather
from pneumo_ros.log.sections import read_blocks, read_header
from pneumo_ros.log.unpacking import mapped

PROFILE = "ros2"
PART = re.compile(r"(_\d+)?\.mcap(\.zstd)?$")  # how a part's name ends
SHOWN = 6


@dataclass(frozen=True)
class Part:
    """One file: what it declares, and the messages of each wanted channel."""

    contents: Contents
    records: dict[int, Records]


def files_of(path: Path) -> list[Path]:
    """The MCAP files of a log in recording order.

    Raises
    ------
    InputError
        if the path does not exist or the folder holds no MCAP file.
    """
    if not path.exists():
        raise InputError("no such file or folder", where=path, remedy="give a session log (.mcap) or a bag folder")
    if not path.is_dir():
        return [path]
    listed = _listed(path)
    there = sorted([*path.glob("*.mcap"), *path.glob("*.mcap.zstd")])
    files = [path / name for name in listed] if listed else there or sorted(path.glob("*.db3"))
    if not files:
        raise InputError("the folder holds no .mcap file", where=path, remedy="give the folder that ros2 bag wrote")
    for file in files:
        if file.suffix == ".db3":
            raise InputError("a bag in SQLite storage", where=file, remedy="ros2 bag convert makes an MCAP bag of it")
        if not file.exists():
            raise InputError(f"metadata.yaml lists {file.name}, which is not there", where=path)
    _ask_which(path, there, files if listed else [])
    return files


def _ask_which(folder: Path, there: list[Path], listed: list[Path]) -> None:
    """Several logs in a folder are no log; the numbered parts of one, as rosbag2 splits it, are."""
    series = {PART.sub("", file.name) for file in there}
    others = sorted(file.name for file in there if file not in listed)
    if (listed and others) or (not listed and len(series) > 1):
        names = sorted(file.name for file in there)
        shown = ", ".join(names[:SHOWN]) + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")
        raise InputError("the folder holds several logs", where=folder, allowed=shown,
                         remedy=f"say which, for example {folder / names[0]}")  # fmt: skip


def check_log(path: Path) -> None:
    """See in a moment that a log is there and is one, before what would read it is imported.

    Raises
    ------
    InputError
        as :func:`files_of`, or if a file begins with other bytes than MCAP's.
    """
    for file in files_of(path):
        if file.suffix == ".zstd":
            continue
        try:
            with file.open("rb") as stream:
                check_magic(stream.read(len(MAGIC)), file)
        except OSError as error:
            raise InputError(
                f"cannot read the log ({error.strerror})", where=file, remedy="check its rights"
            ) from error


def _listed(folder: Path) -> list[str]:
    """File names in metadata.yaml; none where there is no such file, as a killed recorder leaves it."""
    try:
        document = parse_yaml((folder / "metadata.yaml").read_text(encoding="utf-8"), folder / "metadata.yaml")
        information = document["rosbag2_bagfile_information"]
        names = [str(name) for name in information["relative_file_paths"]]
        mode = str(information.get("compression_mode") or "").lower()
    except FileNotFoundError:
        return []
    except (OSError, InputError, KeyError, TypeError, AttributeError, UnicodeDecodeError) as error:
        raise InputError(
            "metadata.yaml cannot be read", where=folder, remedy="remove it: the .mcap files are then taken by name"
        ) from error
    if mode == "message":
        raise InputError(
            "every message is compressed by itself",
            where=folder,
            key="compression_mode",
            value=mode,
            allowed="file, none",
            remedy="ros2 bag convert without it; MCAP compresses anyway",
        )
    return names


def read_parts(path: Path, topics: Sequence[str] | None, since_ns: int = 0) -> list[Part]:
    """Every file of the log.

    Raises
    ------
    InputError
        see :func:`pneumo_ros.log.reading.read_log`.
    """
    return [read_part(file, topics, since_ns) for file in files_of(path)]


def read_part(path: Path, topics: Sequence[str] | None, since_ns: int = 0) -> Part:
    """One MCAP file, strictly.

    Raises
    ------
    InputError
        not MCAP, another profile, truncated or damaged; more than fits into memory.
    """
    most = free_for_messages()
    with mapped(path) as buffer:
        check_magic(buffer, path)
        contents = Contents(path, read_header(buffer, path))
        if contents.header.profile != PROFILE:
            raise InputError(
                "another profile", where=path, key="profile", value=contents.header.profile, allowed=PROFILE
            )
        pieces: dict[int, Gathered] = {}
        total = 0
        for block in read_blocks(buffer, path, contents):
            total += gather(block, topics, pieces, contents, since_ns)
            if sum(one.size for one in pieces.values()) > most:
                raise InputError(
                    "its messages do not fit into memory",
                    where=path,
                    allowed=f"{most >> 20} MiB, half of what is free",
                    remedy="close other programs, or cut a part out with `mcap filter`",
                )
    statistics = contents.statistics
    if statistics is not None and statistics.message_count != total:
        raise DamageError(
            f"{total} messages found, the summary counts {statistics.message_count}", path, path.stat().st_size
        )
    kept = [i for i, channel in contents.channels.items() if topics is None or channel.topic in topics]
    return Part(contents, {identity: pieces.pop(identity, Gathered()).records() for identity in kept})
