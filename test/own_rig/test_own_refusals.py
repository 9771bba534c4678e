# SPDX-License-Identifier: Apache-2.0
"""Every row of the table of bad inputs in docs/your-rig.md: its one line, exit code 2, nothing written."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from helpers.folders import ROOT
from helpers.own_rigs import CART, CART_YAML, cart_log, written
from pyarrow import parquet as pq
from scipy.io import savemat

from pneumo_ros.errors import InputError
from pneumo_ros.own_rig.description import read_description
from pneumo_ros.own_rig.from_files import prepared
from pneumo_ros.own_rig.records import read_record

Change = Callable[[Path], object]  # a name, where the log has another one


def changed(file: str, text: str, old: str, new: str) -> Change:
    def apply(folder: Path) -> None:
        (folder / file).write_text(text.replace(old, new))

    return apply


def py(old: str, new: str) -> Change:
    return changed("rig.py", CART, old, new)


def names(old: str, new: str) -> Change:
    return changed("rig.yaml", CART_YAML, old, new)


def column(change: Callable[[np.ndarray], np.ndarray]) -> Change:
    def apply(folder: Path) -> None:
        table = np.loadtxt(folder / "log.csv", delimiter=",", skiprows=1)
        np.savetxt(folder / "log.csv", change(table), "%.6f", ",", header="t,x,force", comments="")

    return apply


def with_column(k: int, value: float) -> Change:
    return column(lambda table: np.where(np.arange(3) == k, value, table))


def csv(change: Callable[[str], str | bytes]) -> Change:
    def apply(folder: Path) -> None:
        made = change((folder / "log.csv").read_text())
        (folder / "log.csv").write_bytes(made if isinstance(made, bytes) else made.encode())

    return apply


def instead(name: str, write: Callable[[Path, np.ndarray], object], topics: bool = False) -> Change:
    """A log of another kind with the columns of the table; of a bag where ``topics``."""

    def apply(folder: Path) -> str:
        table = np.loadtxt(folder / "log.csv", delimiter=",", skiprows=1)
        (folder / "log.csv").unlink()
        if topics:
            (folder / "rig.yaml").write_text(OF_A_BAG)
        write(folder / name, table)
        return name

    return apply


def parquet(**other: Callable[[np.ndarray], Any]) -> Change:
    def write(path: Path, table: np.ndarray) -> None:
        columns: dict[str, Any] = {name: table[:, k] for k, name in enumerate(("t", "x", "force"))}
        pq.write_table(pa.table(columns | {name: change(columns[name]) for name, change in other.items()}), path)

    return instead("log.parquet", write)


def mat(**other: Callable[[np.ndarray], Any]) -> Change:
    def write(path: Path, table: np.ndarray) -> None:
        columns = {name: table[:, k] for k, name in enumerate(("t", "x", "force"))}
        savemat(path, columns | {name: change(columns[name]) for name, change in other.items()})

    return instead("log.mat", write)


def bag(**files: bytes) -> Change:
    def write(path: Path, _: np.ndarray) -> None:
        path.mkdir()
        for name, content in files.items():
            (path / name.replace("_", ".")).write_bytes(content)

    return instead("bag", write, topics=True)


OF_A_BAG = (CART_YAML.replace("time: {field: t, unit: s}\n", "").replace("field: x", "topic: /x, field: data")
            .replace("{unit: N}", "{topic: /f, field: data, unit: N}"))  # fmt: skip
HDF5 = (
    b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Sun HDF5 schema 1.00 .".ljust(124)
    + b"\0\x02IM\x89HDF\r\n\x1a\n"
)
LISTED = b"rosbag2_bagfile_information: {relative_file_paths: [one.mcap]}"
WITHOUT_COORDINATES = "travel=lambda x, u, p: x.position, rate=lambda x, u, p: x.speed"
BAD: dict[str, Change] = {
    "rig.py is not there": lambda folder: (folder / "rig.py").unlink(),
    "rig.yaml is not there": lambda folder: (folder / "rig.yaml").unlink(),
    "rig.yaml is no YAML": names("channels:", "channels: {"),
    "a tab in rig.yaml": names("channels:\n  ", "channels:\n\t"),
    "a name twice in one table of rig.yaml": names("{mass: 2", "{mass: 3 kg, mass: 2"),
    "an entry of rig.yaml that does not exist": names("rig: cart", "rgi: cart"),
    "no channels": names("channels:\n  position: {field: x, unit: mm}", "channels: {}"),
    "a channel and an input of one name": names("inputs:", "inputs:\n  position: {field: x, unit: mm}"),
    "a unit that is not known": names("unit: mm", "unit: furlong"),
    "a unit that is left empty": names("unit: mm", "unit: "),
    "a number that is none": names("2 +- 0.05 kg", "about two"),
    "noise of zero": names("unit: mm", "unit: mm, noise: 0 mm"),
    "`hold` that is neither true nor false": names("unit: N", "unit: N, hold: maybe"),
    "a name that Python cannot use": names("mass: 2", "the mass: 2"),
    "a state that starts at no channel": names("speed: rate of position", "speed: rate of nothing"),
    "rig.py has a mistake": py("SLOTS = [", "SLOTS = [["),
    "rig.py imports what is not installed": py("SLOTS = [", "import nowhere_at_all\n\nSLOTS = ["),
    "rig.py ends the program": py("SLOTS = [", "raise SystemExit(0)\n\nSLOTS = ["),
    "rig.py does not come back": py("SLOTS = [", "while True:\n    pass\n\nSLOTS = ["),
    "a loop without end in rhs": py("    return x.speed", "    while x.speed < 2.0:\n        pass\n    return x.speed"),
    "no rhs, although there are states": py("def rhs", "def right_hand_side"),
    "rhs without f": py("def rhs(x, u, p, f)", "def rhs(x, u, p)"),
    "outputs return another number of values": py("return (x.position,)", "return x.position, x.speed"),
    "outputs return one number, not a tuple": py("return (x.position,)", "return x.position"),
    "a name in rhs that rig.yaml does not have": py("p.stiffness", "p.stiffnes"),
    "a model that is no number": py("return (x.position,)", "return (x.position / 0.0,)"),
    "no SLOTS": py("SLOTS", "PLACES"),
    "two slots of one name": py('Sensor("position"),', 'Sensor("position"), Sensor("position"),'),
    "a coordinate that is no function": py("travel=lambda x, u, p: x.position", "travel='position'"),
    "a force without rate and travel": py(WITHOUT_COORDINATES, ""),
    "a gas under a temperature": py(
        "Sensor\n\nSLOTS = [", 'Sensor, Flow\n\nSLOTS = [\n    Flow("wall", pressure_unit="K"),'),
    "a sensor of no channel": py('Sensor("position")', 'Sensor("pressure")'),
    "a family that its slot cannot have": names("rig: cart", "rig: cart\nfamilies: {rail: [leak]}"),
    "a column that is not there": names("field: x", "field: y"),
    "a column whose name stands twice": csv(lambda text: text.replace("t,x,force", "t,x,x", 1)),
    "one log as two": lambda folder: None,
    "the log that is fitted, held out": lambda folder: None,
    "a table without --rig-model": lambda folder: None,
    "an empty log": csv(lambda text: ""),
    "a log of names alone": csv(lambda text: text.partition("\n")[0]),
    "more cells in a row than names": csv(lambda text: text.replace("t,x,force", "t,x", 1)),
    "a log of 3 rows": column(lambda table: table[:3]),
    "a column of NaN": with_column(1, float("nan")),
    "a column of words": csv(lambda text: re.sub(r"(?m)^([\d.]+),[^,]+,", r"\1,high,", text)),
    "an input that ends after 10 rows": csv(lambda text: "\n".join(
        row if k < 11 else row.rpartition(",")[0] + "," for k, row in enumerate(text.splitlines()))),
    "a log's time in words": csv(lambda text: re.sub(r"(?m)^[\d.]+,", "noon,", text)),
    "times that do not increase": with_column(0, 1.0),
    "a channel that never moves": with_column(1, 2.0),
    "a value of 1e300": csv(lambda text: re.sub(r"(?m)^(1.5\d*),[^,]+,", r"\1,1e300,", text)),
    "nanoseconds that rig.yaml calls seconds": csv(lambda text: re.sub(
        r"(?m)^([\d.]+),", lambda t: f"{1_764_000_000_000_000_000 + round(float(t[1]) * 1e9)},", text)),
    "a nominal model that runs away": names("stiffness: 80", "stiffness: -8e9"),
    "a log that is no text": csv(lambda text: bytes(range(256)) * 4),
    "a spreadsheet": instead("log.xlsx", lambda path, _: path.write_bytes(b"PK\3\4")),
    "a .mat file of version 7.3": instead("log.mat", lambda path, _: path.write_bytes(HDF5)),
    "times and channel of another length in a .mat file": mat(x=lambda x: x[:-7]),
    "a .mat file's complex numbers": mat(x=lambda x: 1j * x),
    "a Parquet file that is none": instead("log.parquet", lambda path, _: path.write_bytes(b"PAR2" * 40)),
    "words in a Parquet file": parquet(x=lambda x: ["high"] * len(x)),
    "lists in a Parquet file": parquet(x=lambda x: [[v] for v in x]),
    "a bag, and no topic in rig.yaml": instead("bag", lambda path, _: path.mkdir()),
    "an empty bag folder": bag(),
    "a bag in SQLite storage, without its metadata.yaml": bag(one_db3=b""),
    "a bag whose metadata.yaml is broken": bag(metadata_yaml=LISTED[:-1]),
    "a bag whose file is missing": bag(metadata_yaml=LISTED),
    "an .mcap file of other bytes": instead("log.mcap", lambda path, _: path.write_bytes(b"12345678" * 9), topics=True),
}  # fmt: skip
MODEL = ("log.csv", "--rig-model", "rig.py")
WORDS = {
    "one log as two": ("log.csv", *MODEL),
    "the log that is fitted, held out": (*MODEL, "--holdout", "log.csv"),
    "a table without --rig-model": ("log.csv",),
}
ENDLESS = ("rig.py does not come back", "a loop without end in rhs")
TAKEN: dict[str, Change] = {
    "semicolons and decimal commas": csv(lambda text: text.replace(",", ";").replace(".", ",")),
    "tabs and decimal commas": csv(lambda text: text.replace(",", "\t").replace(".", ",")),
    "spaces": csv(lambda text: text.replace(",", "   ")),
    "quotes": csv(lambda text: re.sub(r"[^,\n]+", lambda cell: f'"{cell[0]}"', text)),
    "a separator at each row's end": csv(lambda text: text.replace("\n", ",\n")),
    "a row of units": csv(lambda text: text.replace("\n", "\ns,mm,N\n", 1)),
    "UTF-16": csv(lambda text: text.encode("utf-16")),
    "a degree sign of Western Windows": csv(
        lambda text: text.replace("\n", ",21\n").replace("force,21", "force,°C").encode("cp1252")),
    "line ends of Windows": csv(lambda text: text.replace("\n", "\r\n")),
    "dates": csv(lambda text: re.sub(r"(?m)^([\d.]+),", lambda t: f"2026-03-01 10:15:{float(t[1]):09.6f},", text)),
    "an input shorter than the channel": csv(lambda text: "\n".join(
        row if k < 1200 else row.rpartition(",")[0] + "," for k, row in enumerate(text.splitlines()))),
    "a .mat file": mat(),
    "a Parquet file": parquet(),
    "numbers as texts": parquet(x=lambda x: [f"{v:.6f}" for v in x]),
    "time stamps": parquet(t=lambda t: (1e9 * t).round().astype("datetime64[ns]")),
    "nothing in some rows": parquet(x=lambda x: [None if k % 40 == 7 else v for k, v in enumerate(x)]),
}  # fmt: skip


def rows() -> dict[str, str]:
    """What is wrong -> what is said, of the page's table."""
    text = (ROOT / "docs/your-rig.md").read_text(encoding="utf-8").partition("## What is refused")[2]
    cells = re.findall(r"^\| (.+?) \| (.+?) \|$", text, re.MULTILINE)
    return dict(cells[1:] if cells[0][0] == "what is wrong" else cells)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> str:
    return cart_log(tmp_path_factory.mktemp("cart") / "log.csv", friction=0.0).read_text()


def test_the_page_lists_what_is_tested() -> None:
    assert set(rows()) == set(BAD)


def diagnosed(folder: Path, given: tuple[str, ...], patience: float) -> subprocess.CompletedProcess[str]:
    """The verb on log.csv, with another patience."""
    program = (
        f"import sys; from pneumo_ros.cli import main, patience; patience.PATIENCE = {patience}; sys.exit(main.main())"
    )
    words = ["diagnose", *given, "-o", "out"]
    return subprocess.run(
        [sys.executable, "-c", program, *words], cwd=folder, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize("wrong", sorted(BAD))
def test_a_bad_input_is_told_in_one_line(wrong: str, whole: str, tmp_path: Path) -> None:
    written(tmp_path)
    (tmp_path / "log.csv").write_text(whole)
    log = BAD[wrong](tmp_path)
    words = WORDS.get(wrong, MODEL)
    if wrong in WORDS or wrong in ("rig.py is not there", "rig.yaml is not there", "rig.py ends the program", *ENDLESS):
        done = diagnosed(tmp_path, words, patience=12.0 if wrong in ENDLESS else 180.0)
        assert done.returncode == 2 and not (tmp_path / "out" / "report.html").exists()
        said = done.stderr or done.stdout
    else:
        with pytest.raises(InputError) as told:
            prepared(tmp_path / "rig.py", [tmp_path / (log if isinstance(log, str) else "log.csv")])
        said = str(told.value)
    assert rows()[wrong] in said and len(said.strip().splitlines()) == 1


@pytest.mark.parametrize("log", sorted(TAKEN))
def test_what_other_recorders_write_is_taken_as_it_is(log: str, whole: str, tmp_path: Path) -> None:
    """The same numbers, whatever the log looks like."""
    written(tmp_path)
    (tmp_path / "log.csv").write_text(whole)
    rig = read_description(tmp_path / "rig.yaml")
    plain = read_record(tmp_path / "log.csv", rig)
    name = TAKEN[log](tmp_path)
    found = read_record(tmp_path / (name if isinstance(name, str) else "log.csv"), rig)
    rows = min(len(found.measured), len(plain.measured))
    # Between rows a line stands for what is not there.
    there = (found.weight[:rows] > 0.0).all(axis=1) & (np.arange(rows) % 40 != 7)
    assert rows > 1000 and np.count_nonzero(there) > 0.9 * rows and found.period == pytest.approx(plain.period)
    assert np.allclose(found.measured[:rows][there], plain.measured[:rows][there], atol=1e-6)
    assert np.allclose(found.inputs[:rows], plain.inputs[:rows], atol=1e-5)


def test_nanoseconds_since_1970_are_a_time(whole: str, tmp_path: Path) -> None:
    written(tmp_path, names=CART_YAML.replace("unit: s}", "unit: ns}"))
    (tmp_path / "log.csv").write_text(whole)
    BAD["nanoseconds that rig.yaml calls seconds"](tmp_path)
    record = read_record(tmp_path / "log.csv", read_description(tmp_path / "rig.yaml"))
    assert record.period == pytest.approx(0.01, rel=1e-4) and len(record.measured) >= 1599
