# SPDX-License-Identifier: Apache-2.0
"""What the source may not contain: calls that turn a text into code, and shells."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = [file for folder in ("pneumo_ros", "bench", "launch", "firmware") for file in (ROOT / folder).rglob("*.py")]
BUILTINS = {"eval", "exec", "compile", "__import__"}
MODULES = {"pickle", "marshal", "shelve", "dill", "cloudpickle", "joblib"}


def calls(tree: ast.AST) -> list[tuple[str, ast.Call]]:
    return [(ast.unparse(node.func), node) for node in ast.walk(tree) if isinstance(node, ast.Call)]


@pytest.mark.parametrize("file", SOURCES, ids=lambda file: str(file.relative_to(ROOT)))
def test_no_text_becomes_code(file: Path) -> None:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        assert not {name.split(".")[0] for name in names} & MODULES
    for name, call in calls(tree):
        words = {k.arg: ast.unparse(k.value) for k in call.keywords}
        assert name not in BUILTINS, f"line {call.lineno}"
        assert name not in ("os.system", "os.popen") and words.get("shell", "False") == "False", f"line {call.lineno}"
        assert words.get("allow_pickle", "False") == "False", f"line {call.lineno}"
        if name in ("yaml.load", "yaml.parse"):
            assert words.get("Loader") == "_LOADER" and file.name == "documents.py", f"line {call.lineno}"
        assert name not in ("yaml.unsafe_load", "yaml.full_load", "yaml.load_all"), f"line {call.lineno}"


def test_every_package_of_the_lock_is_pinned_with_hashes() -> None:
    """Two at least where there is a wheel and a source, one in any case; pip then takes these files and no others."""
    entries = re.split(r"\n(?=\S)", (ROOT / "requirements.lock").read_text(encoding="utf-8").strip())
    assert len(entries) > 100
    for entry in entries:
        assert re.match(r"[a-z0-9._-]+==[0-9][^ ]*( ; [^\\]+)? \\\n", entry), entry
        assert re.search(r"--hash=sha256:[0-9a-f]{64}", entry), entry
    recipe = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert re.search(r"pip install [^\n]*\\\n\t\t--require-hashes -r requirements\.lock\n", recipe)
