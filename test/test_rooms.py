# SPDX-License-Identifier: Apache-2.0
"""The structure that CONTRIBUTING.md states is the one there is: imports point down its list, and in no circle."""

from __future__ import annotations

import ast
import re
from functools import cache
from graphlib import TopologicalSorter

from helpers.folders import ROOT

PACKAGE = ROOT / "pneumo_ros"


@cache
def modules() -> dict[str, ast.Module]:
    """Dotted name -> source, of the whole package."""
    found = {}
    for path in PACKAGE.rglob("*.py"):
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        found[name] = ast.parse(path.read_text(encoding="utf-8"))
    return found


@cache
def imports() -> dict[str, set[str]]:
    """Module -> modules of the package that it imports, inside functions and for types as well."""
    known = modules()
    out: dict[str, set[str]] = {}
    for name, tree in known.items():
        named = set()
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                named |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{name}: a relative import"
                whole = {f"{node.module}.{alias.name}" for alias in node.names}
                named |= {one if one in known else str(node.module) for one in whole}
        out[name] = (named & known.keys()) - {name, "pneumo_ros"}
    return out


def steps() -> list[list[str]]:
    """The list of CONTRIBUTING.md, from the top."""
    text = " ".join((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split())
    listed = re.search(r"one step: (.*?); and the ground that all stand on: (.*?)\. ", text)
    assert listed is not None
    return [step.split(", ") for step in (*listed.group(1).split("; "), listed.group(2))]


def room(module: str) -> str:
    return module.split(".")[1]


def test_every_room_has_its_step() -> None:
    listed = [name for step in steps() for name in step]
    assert sorted(listed) == sorted({room(name) for name in modules() if name != "pneumo_ros"})


def test_imports_point_down() -> None:
    step_of = {name: number for number, step in enumerate(steps()) for name in step}
    ground = len(steps()) - 1
    wrong = [
        f"{one} -> {other}"
        for one, others in imports().items()
        for other in others
        if one != "pneumo_ros" and room(one) != room(other)
        and not (step_of[room(one)] < step_of[room(other)] or step_of[room(one)] == step_of[room(other)] == ground)
    ]  # fmt: skip
    assert not wrong
    assert not [one for one, others in imports().items() if room(f"{one}.") == "nodes" for other in others
                if room(other) == "diagnosis"]  # fmt: skip


def test_no_module_imports_itself_over_others() -> None:
    assert len(list(TopologicalSorter(imports()).static_order())) == len(modules())


def test_the_diagnosis_knows_no_ros() -> None:
    for name, tree in modules().items():
        if room(f"{name}.") in ("diagnosis", "effects", "slots", "own_rig", "plant", "control", "estimation", "thesis"):
            whole = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
            whole |= {str(node.module) for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
            assert not [one for one in whole if one.split(".")[0] in ("rclpy", "std_msgs", "sensor_msgs")], name
