# SPDX-License-Identifier: Apache-2.0
"""Every row of the table of bad inputs in docs/your-rig.md: its one line, exit code 2, nothing written."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from helpers.folders import ROOT
from helpers.own_rigs import CART, CART_YAML, cart_log, written

from pneumo_ros.errors import InputError
from pneumo_ros.own_rig.from_files import prepared

Change = Callable[[Path], None]


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


BAD: dict[str, Change] = {
    "rig.py is not there": lambda folder: (folder / "rig.py").unlink(),
    "rig.yaml is not there": lambda folder: (folder / "rig.yaml").unlink(),
    "an entry of rig.yaml that does not exist": names("rig: cart", "rgi: cart"),
    "no channels": names("channels:\n  position: {field: x, unit: mm}", "channels: {}"),
    "a unit that is not known": names("unit: mm", "unit: furlong"),
    "a number that is none": names("2 +- 0.05 kg", "about two"),
    "a name that Python cannot use": names("mass: 2", "the mass: 2"),
    "a state that starts at no channel": names("speed: rate of position", "speed: rate of nothing"),
    "rig.py has a mistake": py("SLOTS = [", "SLOTS = [["),
    "outputs return another number of values": py("return (x.position,)", "return x.position, x.speed"),
    "no SLOTS": py("SLOTS", "PLACES"),
    "a sensor of no channel": py('Sensor("position")', 'Sensor("pressure")'),
    "a family that its slot cannot have": names("rig: cart", "rig: cart\nfamilies: {rail: [leak]}"),
    "a column that is not there": names("field: x", "field: y"),
    "a log of 3 rows": column(lambda table: table[:3]),
    "a column of NaN": with_column(1, float("nan")),
    "a channel that never moves": with_column(1, 2.0),
    "times that do not increase": with_column(0, 1.0),
    "a nominal model that runs away": names("stiffness: 80", "stiffness: -8e9"),
}


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


@pytest.mark.parametrize("wrong", sorted(BAD))
def test_a_bad_input_is_told_in_one_line(wrong: str, whole: str, tmp_path: Path) -> None:
    written(tmp_path)
    (tmp_path / "log.csv").write_text(whole)
    BAD[wrong](tmp_path)
    if wrong in ("rig.py is not there", "rig.yaml is not there"):
        words = ["-m", "pneumo_ros.cli.main", "diagnose", "log.csv", "--rig-model", "rig.py", "-o", "out"]
        done = subprocess.run([sys.executable, *words], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 2 and not (tmp_path / "out").exists()
        said = done.stderr or done.stdout
    else:
        with pytest.raises(InputError) as told:
            prepared(tmp_path / "rig.py", [tmp_path / "log.csv"])
        said = str(told.value)
    assert rows()[wrong] in said and len(said.strip().splitlines()) == 1
