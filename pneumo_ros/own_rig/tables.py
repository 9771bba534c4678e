# SPDX-License-Identifier: Apache-2.0
"""Numbers out of any log: MCAP and bag folders, CSV, Parquet, .mat; a signal is samples over their own times."""

from __future__ import annotations

import codecs
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
_DECIMAL, _POINTED = re.compile(r"[-+]?\d*,\d+(e[-+]?\d+)?$", re.I), re.compile(r"[-+]?\d*\.\d+(e[-+]?\d+)?$", re.I)
_DATE = re.compile(r"\d{4}-\d\d-\d\d([T ]\d\d:\d\d(:\d\d(\.\d+)?)?)?Z?$")
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


class Columns(dict[str, Array]):
    """Columns by name; those that are there as well and cannot be taken stand in ``others``, by what they are."""

    def __init__(self, *columns: Any) -> None:
        super().__init__(*columns)
        self.others: dict[str, str] = {}


def table_of(path: Path) -> Columns:
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


def _column(columns: Columns, field: str, path: Path, key: str) -> Array:
    if field in columns:
        return columns[field]
    indexed = _INDEXED.match(field)
    if indexed and indexed[1] in columns and indexed[2].isdigit():
        table = columns[indexed[1]]
        if table.ndim == 2 and int(indexed[2]) < table.shape[1]:
            return np.asarray(table[:, int(indexed[2])])
    if field in columns.others:
        raise InputError(f"columns {columns.others[field]}" if "twice" in columns.others[field]
                         else f"a column {columns.others[field]}, not of numbers", where=path, key=key, value=field,
                         allowed=", ".join(columns))  # fmt: skip
    raise not_one_of("no such column", field, columns, where=path, key=key)


def _csv(path: Path) -> Columns:
    lines = [line for line in _text_of(path).splitlines() if line.strip()]
    lines = [line for line in lines if not line.lstrip().startswith(("#", "%"))]
    if not lines:
        raise InputError("the table is empty", where=path, remedy="give the log itself")
    mark = next((m for m in (";", "\t", ",") if m in lines[0]), None)
    cells = [[cell.strip().strip('"').strip() for cell in line.split(mark)] for line in lines]
    # Between semicolons and tabs a comma is a decimal's, where no point stands for one.
    comma = mark != "," and any(_DECIMAL.match(c) for c in cells[-1]) and not any(_POINTED.match(c) for c in cells[-1])
    number = (lambda cell: _number(cell.replace(",", "."))) if comma else _number
    named = any(number(cell) is None for cell in cells[0])
    names = cells[0] if named else [str(k) for k in range(len(cells[0]))]
    whole = [row[: len(names)] for row in cells[int(named) :] if len(row) >= len(names) and not any(row[len(names) :])]
    if not whole and len(cells) > int(named):
        raise InputError("rows and names of another number", where=path, value=(len(cells[-1]), len(names)),
                         remedy="give each column one name, and names without commas")  # fmt: skip
    if not whole:
        raise InputError("the table has no rows", where=path, remedy="give the log itself")
    table = np.array([[np.nan if (v := number(cell)) is None else v for cell in row] for row in whole])
    found = Columns((_told_apart(name, k, names), table[:, k]) for k, name in enumerate(names))
    found.others = {name: "that stand twice" for name in names if names.count(name) > 1}
    return found


def _told_apart(name: str, k: int, names: list[str]) -> str:
    """Columns of one name by number among them."""
    return f"{name}[{names[:k].count(name)}]" if names.count(name) > 1 else name


def _text_of(path: Path) -> str:
    """A text in the encoding that it is in: UTF-8, UTF-16 where it says so, else of Western Windows.

    Raises
    ------
    InputError
        if it is no text.
    """
    raw = path.read_bytes()
    if raw[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return raw.decode("utf-16")
    if b"\0" in raw:
        raise InputError("the table cannot be read: it is no text", where=path, allowed=", ".join(TABLES))
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")


def _number(cell: str) -> float | None:
    """A number, 1.003.000 with points between thousands as well; a date as s since 1970; None for a text, NaN for
    nothing.
    """
    if not cell:
        return float("nan")
    if cell.count(".") > 1:
        whole, _, part = cell.rpartition(".")
        cell = whole.replace(".", "") + "." + part
    try:
        return float(cell)
    except ValueError:
        return _moment(cell)


def _moment(cell: str) -> float | None:
    if not _DATE.match(cell):
        return None
    try:
        return float(np.datetime64(cell.rstrip("Z").replace(" ", "T"), "ns").astype(np.int64)) * SECOND
    except ValueError:
        return None


def _parquet(path: Path) -> Columns:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError as error:
        raise InputError("Parquet needs pyarrow", where=path, remedy="pip install 'pneumo_ros[parquet]'") from error
    try:
        table = parquet.read_table(path)
    except pa.ArrowException as error:
        raise InputError("no Parquet table", where=path, remedy="check the file") from error
    found = Columns()
    for name in table.column_names:
        kind, column = table[name].type, table[name]
        if pa.types.is_timestamp(kind):
            found[name] = np.asarray(column.cast(pa.timestamp("ns")).to_numpy().astype(np.int64) * SECOND)
        elif pa.types.is_string(kind) or pa.types.is_large_string(kind):
            numbers = [_number(cell or "") for cell in column.to_pylist()]
            found[name] = np.array([np.nan if v is None else v for v in numbers])
        elif pa.types.is_decimal(kind) or pa.types.is_boolean(kind):
            found[name] = np.array([np.nan if v is None else float(v) for v in column.to_pylist()])
        elif pa.types.is_floating(kind) or pa.types.is_integer(kind):
            found[name] = np.asarray(column.to_numpy(), dtype=float)
        else:
            found.others[name] = f"of type {kind}"
    return found


def _mat(path: Path) -> Columns:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        held = loadmat(path, simplify_cells=True)
    except MatReadError as error:
        raise InputError("no .mat file", where=path, remedy="check the file") from error
    except NotImplementedError as error:
        raise InputError("a .mat file of version 7.3", where=path, remedy="save it with -v7") from error
    out = Columns()
    _flattened("", {k: v for k, v in held.items() if not k.startswith("__")}, out)
    return out


def _flattened(path: str, value: Any, out: Columns) -> None:
    """Arrays of a .mat file; structures by path, ``data.u``."""
    if isinstance(value, dict):
        for name, inner in value.items():
            _flattened(f"{path}.{name}" if path else str(name), inner, out)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and 0 < value.ndim <= 2:
        array = value.astype(float)
        out[path] = array.ravel() if array.ndim == 1 or 1 in array.shape else array
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        out[path] = np.array([float(value)])
    else:
        out.others[path] = f"of shape {np.shape(value)} and type {getattr(value, 'dtype', type(value).__name__)}"


_READERS: dict[str, Callable[[Path], Columns]] = {".parquet": _parquet, ".mat": _mat}


def _of_bag(path: Path, spec: SignalSpec) -> Sampled:
    from pneumo_ros.log.reading import read_log

    if not (path.is_dir() or ".mcap" in path.name.lower()):
        raise InputError("no table and no bag", where=path, value=path.suffix or "no ending",
                         allowed=f"{', '.join(TABLES)}, .mcap, the folder of a bag")  # fmt: skip
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
