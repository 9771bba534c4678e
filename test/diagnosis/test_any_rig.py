# SPDX-License-Identifier: Apache-2.0
"""The engine knows no half car: no word of its ends and sensors, nothing imported of its equations."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from helpers.folders import ROOT

DIAGNOSIS = ROOT / "pneumo_ros" / "diagnosis"
ITS_OWN = {"half_car", "report"}  # the report draws its picture where the rig is one
ENGINE = [p for p in sorted(DIAGNOSIS.rglob("*.py")) if p.relative_to(DIAGNOSIS).parts[0] not in ITS_OWN]
WORDS = re.compile(r"front|rear|lvdt|\baxle|tyre|bellows", re.IGNORECASE)
ROOMS = ("half_car", "pneumo_ros.plant", "pneumo_ros.rig", "effects.rig_model", "effects.hooks", "pneumo_ros.road")


@pytest.mark.parametrize("path", ENGINE, ids=lambda path: str(path.relative_to(DIAGNOSIS)))
def test_the_engine_knows_no_half_car(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert not WORDS.findall(text)
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom)]
    assert not [n.module for n in nodes if any(room in f"{n.module}" for room in ROOMS)]


def test_the_engine_is_most_of_the_diagnosis() -> None:
    assert {"diagnose.py", "solver.py", "verdict.py", "growth.py"} <= {path.name for path in ENGINE}
