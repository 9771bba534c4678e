# SPDX-License-Identifier: Apache-2.0
"""Numbers out of any log: MCAP and bag folders, CSV, Parquet, .mat; a signal is samples over their own times."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.errors import InputError, not_one_of
from pneumo_ros.own_rig.description import Description, SignalSpec

TABLES = (".csv", ".txt", ".tsv", ".dat", ".parquet", ".mat")
MOST_BYTES = 2_000_000_000
_INDEXED = re.compile(r"^(.*)\[([^\[\]]+)\]$")
SECOND = 1e-9


@dataclass(frozen=True)
class Sampled:
    """A signal as it was logged: times (M,) s, values (M,), in the log's unit, and when a recorder received them."""

    time: Array
    values: Array
    received: Array | None = None


def is_table(path: Path) -> bool:
    """Whether a file is a table rather than a bag."""
    return path.suffix.lower() in TABLES


def sampled(path: Path, spec: SignalSpec, rig: Description) -> Sampled:
    """One signal of a log, SI.

    Raises
    ------
    InputError
        if the file, the topic or the field is not there, or is no number.
    """
    file = _beside(path, spec)
    found = _of_table(file, spec, rig) if is_table(file) else _of_bag(file, spec)
    if len(found.time) != len(found.values):
        raise InputError("times and values of another number", where=file, key=spec.field,
                         value=(len(found.time), len(found.values)))  # fmt: skip
    return replace(found, values=found.values * spec.scale + spec.shift)


def _beside(path: Path, spec: SignalSpec) -> Path:
    if spec.beside is None:
        return path
    one, other = spec.beside
    for own, its in ((one, other), (other, one)):
        if path.name.endswith(own):
            return path.with_name(path.name.removesuffix(own) + its) if spec.beside[0] == own else path
    raise InputError("the log's name has neither ending", where=path, key=spec.name, allowed=f"...{one} or ...{other}")


def _of_table(path: Path, spec: SignalSpec, rig: Description) -> Sampled:
    columns = table_of(path)
    values = _column(columns, spec.field, path, spec.name)
    if isinstance(rig.time, float):
        return Sampled(np.asarray(np.arange(len(values)) * rig.time, dtype=float), values)
    if rig.time is None:
        raise InputError("a table needs its time", where=rig.path, key="time",
                         allowed="{field: t, unit: s}, or the time from row to row, 4 s")  # fmt: skip
    return Sampled(_column(columns, rig.time.field, path, "time") * rig.time.scale, values)


def table_of(path: Path) -> Mapping[str, Array]:
    """Columns of a table by name; by number, from 0, where it has no names.

    Raises
    ------
    InputError
        if it cannot be read.
    """
    if not path.is_file():
        raise InputError("no such file", where=path, remedy="check the name")
    if path.stat().st_size > MOST_BYTES:
        raise InputError("the table is too large", where=path, value=path.stat().st_size, allowed="up to 2 GB")
    try:
        return _READERS.get(path.suffix.lower(), _csv)(path)
    except (OSError, ValueError, KeyError, IndexError, UnicodeDecodeError, NotImplementedError, TypeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError("the table cannot be read", where=path, value=str(error)[:60],
                         allowed=", ".join(TABLES)) from error  # fmt: skip


def _column(columns: Mapping[str, Array], field: str, path: Path, key: str) -> Array:
    if field in columns:
        return columns[field]
    indexed = _INDEXED.match(field)
    if indexed and indexed[1] in columns and indexed[2].isdigit():
        table = columns[indexed[1]]
        if table.ndim == 2 and int(indexed[2]) < table.shape[1]:
            return np.asarray(table[:, int(indexed[2])])
    raise not_one_of("no such column", field, columns, where=path, key=key)


def _csv(path: Path) -> Mapping[str, Array]:
    lines = [line for line in path.read_text(encoding="utf-8-sig").splitlines() if line.strip()]
    lines = [line for line in lines if not line.lstrip().startswith(("#", "%"))]
    if not lines:
        raise InputError("the table is empty", where=path, remedy="give the log itself")
    mark = next((m for m in (";", "\t", ",") if m in lines[0]), None)
    cells = [[cell.strip() for cell in line.split(mark)] for line in lines]
    named = any(_number(cell) is None for cell in cells[0])
    names = cells[0] if named else [str(k) for k in range(len(cells[0]))]
    rows = [row for row in cells[int(named) :] if len(row) == len(names)]
    if not rows:
        raise InputError("the table has no rows", where=path, remedy="give the log itself")
    table = np.array([[np.nan if (v := _number(cell)) is None else v for cell in row] for row in rows])
    return {name: table[:, k] for k, name in enumerate(names)}


def _number(cell: str) -> float | None:
    """A number, 1.003.000 with points between thousands as well; None for a text, NaN for nothing."""
    if not cell:
        return float("nan")
    if cell.count(".") > 1:
        whole, _, part = cell.rpartition(".")
        cell = whole.replace(".", "") + "." + part
    try:
        return float(cell)
    except ValueError:
        return None


def _parquet(path: Path) -> Mapping[str, Array]:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError as error:
        raise InputError("Parquet needs pyarrow", where=path, remedy="pip install 'pneumo_ros[parquet]'") from error
    try:
        table = parquet.read_table(path)
    except pa.ArrowException as error:
        raise InputError("no Parquet table", where=path, remedy="check the file") from error
    kept = [name for name in table.column_names if pa.types.is_floating(table[name].type)
            or pa.types.is_integer(table[name].type)]  # fmt: skip
    return {name: np.asarray(table[name].to_numpy(), dtype=float) for name in kept}


def _mat(path: Path) -> Mapping[str, Array]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        held = loadmat(path, simplify_cells=True)
    except MatReadError as error:
        raise InputError("no .mat file", where=path, remedy="check the file") from error
    except NotImplementedError as error:
        raise InputError("a .mat file of version 7.3", where=path, remedy="save it with -v7") from error
    out: dict[str, Array] = {}
    _flattened("", {k: v for k, v in held.items() if not k.startswith("__")}, out)
    return out


def _flattened(path: str, value: Any, out: dict[str, Array]) -> None:
    """Arrays of a .mat file; structures by path, ``data.u``."""
    if isinstance(value, dict):
        for name, inner in value.items():
            _flattened(f"{path}.{name}" if path else str(name), inner, out)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and 0 < value.ndim <= 2:
        array = value.astype(float)
        out[path] = array.ravel() if array.ndim == 1 or 1 in array.shape else array


_READERS: dict[str, Callable[[Path], Mapping[str, Array]]] = {".parquet": _parquet, ".mat": _mat}


def _of_bag(path: Path, spec: SignalSpec) -> Sampled:
    from pneumo_ros.log.reading import read_log

    if not spec.topic:
        raise InputError("no topic is named for it", where=path, key=spec.name,
                         remedy="pneumo log map LOG proposes a rig file")  # fmt: skip
    log = read_log(path, [spec.topic])
    if spec.topic not in log.topics:
        raise not_one_of("the log has no such topic", spec.topic, log.topics, where=path, key=spec.name)
    columns = log.columns(spec.topic)
    values = _field(columns.arrays, columns.texts, spec.field, path, spec.name)
    stamps, received = (np.asarray(one * SECOND, dtype=float) for one in (columns.stamp_ns, columns.log_time_ns))
    return Sampled(stamps, values, received)


def _field(arrays: Mapping[str, Any], texts: Mapping[str, Any], field: str, path: Path, key: str) -> Array:
    """A number of a message, or an entry of an array of it, by number or by the name that stands beside it."""
    found, indexed = arrays.get(field), _INDEXED.match(field)
    if found is None and indexed and indexed[1] in arrays:
        found, which = arrays[indexed[1]], indexed[2]
        names = next((t for t in texts.values() if isinstance(t, tuple) and which in t), None)
        place = int(which) if which.isdigit() else names.index(which) if names else -1
        if found.ndim != 2 or not 0 <= place < found.shape[1]:
            known = [n for t in texts.values() if isinstance(t, tuple) for n in t]
            raise not_one_of("no such entry", which, known or ["0 ..."], where=path, key=key)
        found = found[:, place]
    if found is None:
        raise not_one_of("no such field", field, arrays, where=path, key=key)
    if found.ndim != 1 or found.dtype == object:
        raise InputError("not one number a message", where=path, key=key, value=field, allowed=f"such as {field}[0]")
    return np.asarray(found, dtype=float)
