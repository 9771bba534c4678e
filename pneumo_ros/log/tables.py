"""Topics as tables, one row a message, for pandas and spreadsheets: CSV or Parquet."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.errors import InputError
from pneumo_ros.files import new_file
from pneumo_ros.log.reading import JOINT_STATE, Columns, Joint, Log

Table = dict[str, NDArray[Any]]
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
    kind : csv, or parquet (needs pyarrow)
    topics : all by default

    Raises
    ------
    InputError
        an unknown kind or topic, pyarrow missing, a file that exists already or cannot be written.
    """
    writers: dict[str, Callable[[Path, Table], None]] = {"csv": _write_csv, "parquet": _write_parquet}
    if kind not in writers:
        raise InputError("unknown format", key="format", value=kind, allowed=", ".join(writers))
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
                writers[kind](part, content)
        except OSError as error:
            raise InputError(f"cannot write ({error.strerror})", where=target) from error
    return targets


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
