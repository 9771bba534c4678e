# SPDX-License-Identifier: Apache-2.0
"""Every argument of every compiled function is documented: what it is, and its unit.

In the function's docstring ("name : ..." or ``name``), in its module's section "Kernel arguments", in the class that
this section refers to, or by a type of the package that documents its fields.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import re
from functools import cache
from pathlib import Path

import pytest
from helpers.folders import ROOT

PACKAGE = ROOT / "pneumo_ros"
FILES = [path for path in sorted(PACKAGE.rglob("*.py")) if "njit" in path.read_text(encoding="utf-8")]
SECTION = re.compile(r"Kernel arguments\n-+\n(.*)", re.DOTALL)
REFERENCE = re.compile(r"Kernel arguments: :class:`([\w.]+)`")


@cache
def documented_types() -> frozenset[str]:
    """Classes of the package that have a docstring."""
    trees = (ast.parse(path.read_text(encoding="utf-8")) for path in PACKAGE.rglob("*.py"))
    nodes = (node for tree in trees for node in ast.walk(tree))
    return frozenset(n.name for n in nodes if isinstance(n, ast.ClassDef) and ast.get_docstring(n))


def names_in(text: str) -> set[str]:
    """What a text documents: names before " : " on a line (or after a semicolon), and quoted ones."""
    listed = re.findall(r"(?:^|;)\s*((?:\w+, )*\w+) (?::|of both)", text, re.MULTILINE)
    return {name for row in listed for name in row.split(", ")} | set(re.findall(r"``(\w+)``", text))


def shared(tree: ast.Module) -> set[str]:
    text = ast.get_docstring(tree) or ""
    section, reference = SECTION.search(text), REFERENCE.search(text)
    if reference:
        module, name = reference.group(1).rsplit(".", 1)
        return names_in(inspect.getdoc(getattr(importlib.import_module(module), name)) or "")
    return names_in(section.group(1)) if section else set()


def undocumented(path: Path) -> list[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    common, out = shared(tree), []
    for node in ast.walk(tree):
        if not isinstance(node, ast.FunctionDef) or not any("njit" in ast.unparse(d) for d in node.decorator_list):
            continue
        known = common | names_in(ast.get_docstring(node) or "")
        for argument in node.args.args:
            kind = ast.unparse(argument.annotation) if argument.annotation else ""
            if argument.arg not in known and kind not in documented_types():
                out.append(f"{node.name}({argument.arg})")
    return out


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_every_argument_of_a_kernel_is_documented(path: Path) -> None:
    assert not undocumented(path)


def test_a_kernel_without_documentation_is_found(tmp_path: Path) -> None:
    bare = tmp_path / "bare.py"
    bare.write_text('"""Room."""\n@njit\ndef push(x, load):\n    """Force, N; ``load`` in N."""\n')
    assert undocumented(bare) == ["push(x)"]
