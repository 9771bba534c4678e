# SPDX-License-Identifier: Apache-2.0
"""launch/rig.launch.py names executables, parameters and files that exist.

ROS 2's launch has no wheels: what `ros2 launch` does with the file is not tested here. Its syntax tree is read instead.
"""

from __future__ import annotations

import ast
import re
from typing import Any

import pytest
import yaml
from helpers.folders import ROOT

from pneumo_ros.cli.session_plan import node_tables

TREE = ast.parse((ROOT / "launch" / "rig.launch.py").read_text(encoding="utf-8"))


def assigned(name: str, tree: ast.AST = TREE) -> ast.expr:
    """What the one assignment to a name gives it."""
    found = [node.value for node in ast.walk(tree) if isinstance(node, ast.Assign)
             and any(isinstance(target, ast.Name) and target.id == name for target in node.targets)]  # fmt: skip
    assert len(found) == 1, name
    return found[0]


def keys(tree: ast.expr) -> dict[str, ast.expr]:
    """A dictionary display with constant keys."""
    assert isinstance(tree, ast.Dict)
    return {ast.literal_eval(key): value for key, value in zip(tree.keys, tree.values, strict=True) if key is not None}


SOURCES: dict[str, str] = ast.literal_eval(assigned("SOURCES"))
ARGUMENTS: dict[str, tuple[str, str]] = ast.literal_eval(assigned("ARGUMENTS"))
CHOICES = keys(assigned("CHOICES"))


def nodes_of(source: str) -> list[str]:
    """The nodes that are started for a source."""
    listed = assigned("names")
    assert isinstance(listed, ast.List)
    return [source if isinstance(entry, ast.Name) else ast.literal_eval(entry) for entry in listed.elts]


@pytest.mark.parametrize("source", SOURCES.values())
def test_every_node_is_an_installed_executable(source: str) -> None:
    setup = ast.parse((ROOT / "setup.py").read_text(encoding="utf-8"))
    executables = ast.literal_eval(assigned("NODES", setup))
    assert set(nodes_of(source)) <= set(executables) and len(nodes_of(source)) == 5
    for name in nodes_of(source):
        module = ast.parse((ROOT / "pneumo_ros" / "nodes" / f"{name}.py").read_text(encoding="utf-8"))
        assert any(isinstance(node, ast.FunctionDef) and node.name == "main" for node in module.body)


@pytest.mark.parametrize("source", SOURCES.values())
def test_every_parameter_is_declared_by_its_node(source: str) -> None:
    declared = {node: {p.name for p in table} for node, table in node_tables().items()}
    common, own = keys(assigned("common")), keys(assigned("own"))
    assert set(own) <= set(declared)
    for node in nodes_of(source):
        given = set(common) | (set(keys(own[node])) if node in own else set())
        assert given <= declared[node] | {"use_sim_time"}, node  # every node of ROS 2 has that one


def test_arguments_are_described_and_their_defaults_fit() -> None:
    assert ARGUMENTS["source"][0] in SOURCES
    assert all(text for _, text in ARGUMENTS.values())
    assert set(CHOICES) <= set(ARGUMENTS)
    assert {"namespace", "params_file", "log_folder", "use_sim_time"} <= set(ARGUMENTS)
    for name in ("mode", "use_sim_time"):
        assert ARGUMENTS[name][0] in ast.literal_eval(CHOICES[name])
    used = {ast.literal_eval(node.slice) for node in ast.walk(TREE) if isinstance(node, ast.Subscript)
            and isinstance(node.value, ast.Name) and node.value.id == "given"}  # fmt: skip
    assert used == set(ARGUMENTS)
    assert (ROOT / "config" / "calibration" / f"{ARGUMENTS['calibration'][0]}.yaml").is_file()


def test_the_default_parameter_file_holds_declared_parameters() -> None:
    tables: dict[str, Any] = node_tables()
    declared = {node: {p.name for p in table} for node, table in tables.items()}
    everywhere = set.intersection(*declared.values())
    for node, content in yaml.safe_load((ROOT / "config" / "session.yaml").read_text(encoding="utf-8")).items():
        bare = node.rpartition("/")[2]
        assert node.startswith("/**"), "a key without it holds in no namespace"
        assert set(content["ros__parameters"]) <= (everywhere if bare == "**" else declared[bare]), node


def test_what_it_imports_is_a_dependency_of_the_package() -> None:
    text = (ROOT / "package.xml").read_text(encoding="utf-8")
    modules = {node.module.split(".")[0] for node in ast.walk(TREE) if isinstance(node, ast.ImportFrom) and node.module}
    for module in modules - {"__future__", "datetime", "pathlib", "pneumo_ros"}:
        assert re.search(rf"<(exec_)?depend>{module}</", text), module
