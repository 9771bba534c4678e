# SPDX-License-Identifier: Apache-2.0
"""Where each numbered equation of the thesis is used: read from the docstrings, so it cannot go stale."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from pathlib import Path

import pneumo_ros

_NUMBER = r"[2-6]\.\d{1,2}"
_MENTION = re.compile(rf"Eqs?\.\s+({_NUMBER}(?:\s*(?:,|and|-|to)\s*{_NUMBER})*)")
_RANGE = re.compile(rf"({_NUMBER})\s*(?:-|to)\s*({_NUMBER})")


def mentioned(text: str) -> set[tuple[int, int]]:
    """Equation numbers (chapter, number) in a text: "Eqs. 6.91-6.93, 5.8" gives four."""
    found: set[tuple[int, int]] = set()
    for match in _MENTION.finditer(" ".join(text.split())):
        numbers = match.group(1)
        for first, last in _RANGE.findall(numbers):
            (chapter, low), (other, high) = _split(first), _split(last)
            if chapter == other:
                found |= {(chapter, n) for n in range(low, high + 1)}
        found |= {_split(number) for number in re.findall(_NUMBER, numbers)}
    return found


def _split(number: str) -> tuple[int, int]:
    chapter, tail = number.split(".")
    return int(chapter), int(tail)


def equation_index(root: Path | None = None) -> dict[tuple[int, int], list[str]]:
    """Equation (chapter, number) -> dotted names of the modules, classes and functions whose docstrings cite it."""
    root = root or Path(pneumo_ros.__file__).parent
    index: dict[tuple[int, int], list[str]] = defaultdict(list)
    for path in sorted(root.rglob("*.py")):
        module = ".".join((root.name, *path.relative_to(root).with_suffix("").parts)).removesuffix(".__init__")
        for name, doc in _docstrings(ast.parse(path.read_text(encoding="utf-8")), module):
            for number in mentioned(doc):
                index[number].append(name)
    return dict(sorted(index.items()))


def _docstrings(tree: ast.Module, module: str) -> list[tuple[str, str]]:
    out = [(module, ast.get_docstring(tree) or "")]
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            out.append((f"{module}.{node.name}", ast.get_docstring(node) or ""))
            for inner in node.body if isinstance(node, ast.ClassDef) else ():
                if isinstance(inner, ast.FunctionDef):
                    out.append((f"{module}.{node.name}.{inner.name}", ast.get_docstring(inner) or ""))
    return out
