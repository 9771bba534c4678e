# SPDX-License-Identifier: Apache-2.0
"""Topics as tables, one row a message, for pandas, MATLAB and spreadsheets: CSV, Parquet or MAT."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.errors import InputError, not_one_of
from pneumo_ros.files import new_file
from pneumo_ros.log.decoded import FLUID_PRESSURE, JOINT_STATE, Log
from pneumo_ros.log.topic_data import Columns, Joint

Table = dict[str, NDArray[Any]]
MERGED = (JOINT_STATE, FLUID_PRESSURE)
RIG_SENSORS = ("/rig/displacement", "/rig/front/pressure", "/rig/rear/pressure")
HELD = ("/valve/command", "/valve/applied")
LONGEST_NAME = 120  # characters of a file's name
FORMULA = ("=", "+", "-", "@", "\uff1d", "\uff0b", "\uff0d", "\uff20")  # with their full-width forms


def table(log: Log, topic: str) -> Table:
    """The topic's columns, each (N,).

    ``log_time_ns`` and ``stamp_ns`` first. A JointState's columns have the channels' names (``front``, and
    ``front.velocity``, ``front.effort`` where there are any); other types' the path of the field, ``path[k]`` for the
    k-th element of an array.

    Raises
    ------
    InputError
        if the topic is missing or does not decode.
    """
    info = log.info(topic)
    if info.type == JOINT_STATE and info.count:
        return _joint_table(log.joint(topic))
    return _plain_table(log.columns(topic))


def _joint_table(joint: Joint) -> Table:
    out: Table = {"log_time_ns": joint.log_time_ns, "stamp_ns": joint.stamp_ns}
    for suffix, values in (("", joint.position), (".velocity", joint.velocity), (".effort", joint.effort)):
        if values is not None:
            out.update({name + suffix: values[:, k] for k, name in enumerate(joint.names)})
    return out


def _plain_table(columns: Columns) -> Table:
    out: Table = {"log_time_ns": columns.log_time_ns, "stamp_ns": columns.stamp_ns}
    for path, values in columns.arrays.items():
        if path.startswith("header.stamp."):
            continue
        if values.ndim == 2:
            out.update({f"{path}[{k}]": values[:, k] for k in range(values.shape[1])})
        else:
            out[path] = values
    for path, text in columns.texts.items():
        if path != "header.frame_id":
            out[path] = np.full(len(columns.stamp_ns), text if isinstance(text, str) else json.dumps(text), object)
    return out


def file_name(topic: str, suffix: str) -> str:
    """``/rig/front/pressure`` -> ``rig_front_pressure.csv``; whatever else a name holds is no part of a path."""
    return re.sub(r"[^\w.-]", "_", topic.strip("/"))[:LONGEST_NAME].lstrip(".") + suffix


def export(
    log: Log, folder: Path, kind: str = "csv", topics: Sequence[str] | None = None, overwrite: bool = False
) -> list[Path]:
    """Write one file a topic.

    Parameters
    ----------
    log : from :func:`pneumo_ros.log.reading.read_log`
    folder : created if missing
    kind : csv, mat (MATLAB 5), or parquet (needs pyarrow)
    topics : all by default

    Raises
    ------
    InputError
        an unknown kind or topic, pyarrow missing, a file that exists already or cannot be written.
    """
    if kind not in WRITERS:
        raise not_one_of("unknown format", kind, WRITERS, key="format")
    wanted = list(topics) if topics else [name for name, info in log.topics.items() if info.encoding == "cdr"]
    targets = [folder / file_name(name, f".{kind}") for name in wanted]
    if len(set(targets)) < len(targets):
        twice = next(name for k, name in enumerate(wanted) if targets[k] in targets[:k])
        raise InputError("two topics would go to one file", where=log.path, key=twice,
                         remedy="export them one by one: --topic")  # fmt: skip
    for target in targets:
        if target.exists() and not overwrite:
            raise InputError("the file exists already", where=target, remedy="choose another folder, or --overwrite")
    for name, target in zip(wanted, targets, strict=True):
        content = table(log, name)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with new_file(target) as part:
                WRITERS[kind](part, content)
        except OSError as error:
            raise InputError(f"cannot write ({error.strerror})", where=target) from error
    return targets


def merged(log: Log, topics: Sequence[str] | None = None) -> Table:
    """One table with a row a sample of the fastest measured topic; columns are named ``topic/column``.

    ``time`` is s from the first row, ``stamp_ns`` its instant. Numbers of other topics are linear between their samples
    (commands and openings are held) and NaN outside them; texts and topics without a rate are left out.

    Raises
    ------
    InputError
        if no topic has samples to merge.
    """
    wanted = [name for name in (topics or log.topics) if log.info(name).encoding == "cdr" and log.info(name).count > 1]
    found = {name: table(log, name) for name in wanted if log.info(name).type in MERGED}
    if not found:
        raise InputError("no topic has numbers to merge", where=log.path, allowed=", ".join(log.topics))
    measured = [name for name in found if name in RIG_SENSORS] or list(found)
    base = np.unique(found[max(measured, key=lambda name: len(found[name]["stamp_ns"]))]["stamp_ns"])
    out: Table = {"time": (base - base[0]) * 1e-9, "stamp_ns": base}
    for name, columns in found.items():
        stamps, rows = np.unique(columns["stamp_ns"], return_index=True)
        for column, values in columns.items():
            if column not in ("log_time_ns", "stamp_ns") and values.dtype.kind in "biuf":
                out[f"{name}/{column}"] = _at(base, stamps, values[rows].astype(float), name in HELD)
    return out


def _at(base: NDArray[Any], stamps: NDArray[Any], values: NDArray[Any], held: bool) -> NDArray[Any]:
    inside = (base >= stamps[0]) & (base <= stamps[-1])
    if held:
        found = values[np.clip(np.searchsorted(stamps, base, side="right") - 1, 0, None)]
    else:
        # From the first stamp: differences of ns since the epoch are exact, the epoch's float64 is not.
        found = np.interp((base - stamps[0]).astype(float), (stamps - stamps[0]).astype(float), values)
    return np.where(inside, found, np.nan)


def export_merged(
    log: Log, folder: Path, kind: str = "csv", topics: Sequence[str] | None = None, overwrite: bool = False
) -> Path:
    """Write :func:`merged` as ``<log>.<kind>``; arguments and errors as of :func:`export`."""
    if kind not in WRITERS:
        raise not_one_of("unknown format", kind, WRITERS, key="format")
    target = folder / f"{log.path.stem}.{kind}"
    if target.exists() and not overwrite:
        raise InputError("the file exists already", where=target, remedy="choose another folder, or --overwrite")
    part = target.with_name(target.name + ".part")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        WRITERS[kind](part, merged(log, topics))
        part.replace(target)
    except OSError as error:
        raise InputError(f"cannot write ({error.strerror})", where=target) from error
    return target


def _write_mat(path: Path, content: Table) -> None:
    """Column vectors; MATLAB's names have letters, digits and underscores, 63 at most."""
    from scipy.io import savemat

    names: dict[str, str] = {}
    for column in content:
        name = re.sub(r"\W", "_", column.strip("/")).lstrip("_0123456789")[-60:].lstrip("_0123456789") or "x"
        names[column] = name if name not in names.values() else f"{name}_{len(names)}"[-63:]
    values = {names[c]: _cells(_plain(v)) if v.dtype == object else v for c, v in content.items()}
    with path.open("wb") as stream:
        savemat(stream, values, oned_as="column", do_compression=True)


def _cells(values: list[Any]) -> NDArray[Any]:
    """A cell array of texts, or numbers; what a message does not have is an empty text, or NaN. MATLAB has no None."""
    if any(isinstance(value, str) for value in values):
        return np.array(["" if value is None else str(value) for value in values], dtype=object)
    return np.array([np.nan if value is None else float(value) for value in values])


def _write_csv(path: Path, content: Table) -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow([harmless(name) for name in content])
        # tolist() gives Python numbers, whose repr is the shortest text that reads back to the same value.
        writer.writerows(zip(*(_plain(values) for values in content.values()), strict=True))


def _plain(values: NDArray[Any]) -> list[Any]:
    if values.dtype == object:
        return [harmless(v) if isinstance(v, str) else _cell(v) for v in values]
    return values.tolist()


def harmless(text: str) -> str:
    """A text that a spreadsheet takes for a text: what begins like a formula gets an apostrophe in front."""
    return f"'{text}" if text.lstrip().startswith(FORMULA) or text[:1] in ("\t", "\r", "\n") else text


def _cell(value: Any) -> Any:
    return value if isinstance(value, int | float | None) else json.dumps(_listed(value))


def _listed(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _write_parquet(path: Path, content: Table) -> None:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise InputError("Parquet needs pyarrow", remedy="pip install 'pneumo_ros[parquet]', or export csv") from error
    columns = {name: _plain(v) if v.dtype == object else np.ascontiguousarray(v) for name, v in content.items()}
    pyarrow.parquet.write_table(pyarrow.table(columns), path)


WRITERS: dict[str, Callable[[Path, Table], None]] = {"csv": _write_csv, "parquet": _write_parquet, "mat": _write_mat}
"""Format -> what writes a table in it."""
