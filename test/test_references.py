# SPDX-License-Identifier: Apache-2.0
"""Names that docstrings and comments refer to exist: roles such as :func:`x`, modules by dotted name, files by path."""

from __future__ import annotations

import ast
import importlib
import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from helpers.folders import ROOT

PACKAGE = ROOT / "pneumo_ros"
FILES = sorted(PACKAGE.rglob("*.py"))
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
ROLE = re.compile(r":(?:mod|class|func|meth|data|attr|exc):`~?([^`<]+)`", re.DOTALL)
DOTTED = re.compile(r"\bpneumo_ros(?:\.[A-Za-z_][A-Za-z0-9_]*)+")
ROOMS = "docs|config|test|bench|examples|firmware|launch|nodes|session|log|daq|rig|effects|thesis"
PATH = re.compile(rf"(?<![\w/.-])(?:{ROOMS})/[\w/.-]*\w\.(?:py|md|yaml|json|csv|png|c|h|txt)\b")
FOLDER = re.compile(r"(?<![\w/.-])pneumo_ros/[\w/.]*\w/?")  # a room, or a file of it
CONSTANT = re.compile(r"(?<![\w.])([a-z]\w+)\.([A-Z][A-Z0-9_]{2,})\b")  # fit.REACH: a module's last name and a constant


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def resolved(name: str) -> bool:
    """Whether a dotted name leads to a module, or to an attribute or field of one."""
    parts = name.split(".")
    for cut in range(len(parts), 0, -1):
        try:
            found: Any = importlib.import_module(".".join(parts[:cut]))
        except ModuleNotFoundError:
            continue
        return all((found := step(found, part)) is not MISSING for part in parts[cut:])
    return False


MISSING = object()


def step(owner: Any, name: str) -> Any:
    if hasattr(owner, name):
        return getattr(owner, name)
    return None if name in getattr(owner, "__annotations__", {}) else MISSING


def texts(path: Path) -> list[tuple[str, str]]:
    """(class around it or "", docstring) of a file."""
    tree, found = ast.parse(path.read_text(encoding="utf-8")), []

    def walk(node: ast.AST, owner: str) -> None:
        for child in ast.iter_child_nodes(node):
            inside = child.name if isinstance(child, ast.ClassDef) else owner
            if (
                isinstance(child, ast.Expr)
                and isinstance(child.value, ast.Constant)
                and isinstance(child.value.value, str)
            ):
                found.append((owner, child.value.value))
            walk(child, inside)

    walk(tree, "")
    return found


def broken(path: Path) -> list[str]:
    module, out = module_of(path), []
    for owner, text in texts(path):
        for name in ("".join(hit.split()) for hit in ROLE.findall(text)):
            places = [name, f"{module}.{name}", f"{module}.{owner}.{name}" if owner else name]
            if not any(resolved(place) for place in places):
                out.append(name)
        out += [name for name in DOTTED.findall(text) if not resolved(name) and not (ROOT / name).exists()]
        out += stale(text)
    return out


def stale(text: str) -> list[str]:
    """Files and constants that a text names and that do not exist."""
    files = [name for name in PATH.findall(text) if not (ROOT / name).exists() and not (PACKAGE / name).exists()]
    files += [name for name in FOLDER.findall(text) if not (ROOT / name).exists()]
    constants = [f"{m}.{name}" for m, name in CONSTANT.findall(text) if not any(hasattr(o, name) for o in owners(m))]
    return files + constants


@cache
def owners(name: str) -> list[Any]:
    """Modules of the package whose last name this is."""
    found = [module_of(path) for path in FILES]
    return [importlib.import_module(m) for m in found if m.rpartition(".")[2] == name and not m.endswith("__main__")]


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_what_a_docstring_names_exists(path: Path) -> None:
    assert broken(path) == []


def test_a_stale_name_is_found() -> None:
    made = PACKAGE / "units.py"
    assert resolved("pneumo_ros.units.INCH") and not resolved("pneumo_ros.units.CUBIT")
    assert module_of(made) == "pneumo_ros.units"
    assert stale("see docs/safety.md and fit.REACH, not units.INCH.") == ["docs/safety.md", "fit.REACH"]


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))], ids=lambda page: page.name
)
def test_what_a_page_names_exists(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    names = [name for name in DOTTED.findall(text) if not resolved(name) and not (ROOT / name).exists()]
    assert names + stale(text) == []
