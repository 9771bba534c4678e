# SPDX-License-Identifier: Apache-2.0
"""docs/constants.md: every module constant of the diagnosis with its meaning and where its value comes from.

A constant is declared as ``NAME: Final = value`` with a comment beside or above it that ends with its origin in
brackets, ``[taste]`` or ``[calibration: what gave it]``; :data:`ORIGINS` are allowed. The sources are read as text:
nothing of this runs when the diagnosis is imported.
"""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from pathlib import Path

ORIGINS = {
    "physics": "follows from the rig, its sensors or its time scales",
    "definition": "a name, a format or the unit of a quantity; another value would mean another thing",
    "calibration": "set by a measurement that is named with it",
    "numerics": "accuracy against computing time; verdicts hardly depend on it",
    "taste": "chosen, and kept because the blind check is content; nothing derives it",
    "display": "how a page looks or when it says something",
}
ROOM = Path(__file__).resolve().parents[1] / "diagnosis"
HEAD = """# Constants of the diagnosis

Made from the declarations in `pneumo_ros/diagnosis` by `make docs`. Each states what it is and where its value
comes from; a test fails where one does not.

| origin | meaning |
|---|---|
"""
_COMMENT = re.compile(r"(?P<text>.+) \[(?P<origin>\w+)(?:: (?P<detail>[^\]]+))?\]$")
_NAME = re.compile(r"_?[A-Z][A-Z0-9_]*$")
_LONGEST = 48  # characters of a value that a table shows


@dataclass(frozen=True)
class Constant:
    """A module constant as declared; ``text`` and ``origin`` are empty where the declaration does not say them."""

    name: str
    value: str
    final: bool
    text: str = ""
    origin: str = ""
    detail: str = ""


def constants_of(source: str) -> list[Constant]:
    """Constants of a module's source text, in order."""
    lines = source.split("\n")
    return [
        _constant(lines, node, name, isinstance(node, ast.AnnAssign) and _is_final(node.annotation))
        for node in ast.parse(source).body
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None
        for name in _names(node)
    ]


def _is_final(annotation: ast.expr) -> bool:
    """``Final``, or ``Final[type]`` where the value does not say its type."""
    return ast.unparse(annotation).partition("[")[0] == "Final"


def _names(node: ast.Assign | ast.AnnAssign) -> list[str]:
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    found = [part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)]
    return [name for name in found if _NAME.match(name)]


def _constant(lines: list[str], node: ast.Assign | ast.AnnAssign, name: str, final: bool) -> Constant:
    assert node.value is not None and node.end_lineno is not None
    value = ast.unparse(node.value)
    match = _COMMENT.match(_comment(lines, node.lineno - 1, node.end_lineno - 1, node.end_col_offset or 0))
    return Constant(
        name, value, final, *(match.group(key) or "" for key in ("text", "origin", "detail")) if match else ()
    )


def _comment(lines: list[str], first: int, last: int, column: int) -> str:
    """The comment behind a declaration, or else the block of lines above it."""
    behind = lines[last].encode()[column:].decode().strip().removeprefix("#").strip()
    if behind and not behind.startswith("fmt:"):
        return behind
    above: list[str] = []
    while first > 0 and lines[first - 1].startswith("#"):
        first -= 1
        above.insert(0, lines[first].removeprefix("#").strip())
    return " ".join(above)


def declared() -> dict[str, list[Constant]]:
    """File below pneumo_ros/diagnosis -> its constants; files without any are left out."""
    files = {str(path.relative_to(ROOM)): path for path in sorted(ROOM.rglob("*.py"))}
    found = {name: constants_of(path.read_text(encoding="utf-8")) for name, path in files.items()}
    return {name: constants for name, constants in found.items() if constants}


def constants_page() -> str:
    """The page, Markdown."""
    parts = [HEAD + "".join(f"| {origin} | {meaning} |\n" for origin, meaning in ORIGINS.items())]
    for name, constants in declared().items():
        rows = "".join(_row(constant) for constant in constants)
        parts.append(f"\n## {name}\n\n| constant | value | meaning | origin |\n|---|---|---|---|\n{rows}")
    return "".join(parts)


def _row(constant: Constant) -> str:
    value = constant.value if len(constant.value) <= _LONGEST else "(table)"
    origin = f"{constant.origin}: {constant.detail}" if constant.detail else constant.origin
    cells = (f"`{constant.name}`", f"`{value}`", constant.text, origin)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"
