# SPDX-License-Identifier: Apache-2.0
"""Add the SPDX line to source files that lack it; ``--check`` only lists them (exit code 1 if there are any)."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TEXT = "SPDX-License-Identifier: Apache-2.0"
LINES = {".py": f"# {TEXT}\n", ".c": f"/* {TEXT} */\n", ".h": f"/* {TEXT} */\n"}


def lacking() -> list[Path]:
    """Tracked and new source files without the line among their first two."""
    listed = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "--cached", "--others", "--exclude-standard"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    files = [ROOT / name for name in listed if Path(name).suffix in LINES]
    return [file for file in files if file.exists() and TEXT not in "".join(_lines(file)[:2])]


def _lines(file: Path) -> list[str]:
    return file.read_text(encoding="utf-8").splitlines(keepends=True)


def main() -> int:
    found = lacking()
    print("".join(f"{file.relative_to(ROOT)}\n" for file in found), end="")
    if "--check" in sys.argv[1:]:
        return 1 if found else 0
    for file in found:
        lines = _lines(file)
        at = 1 if lines and lines[0].startswith("#!") else 0
        lines.insert(at, LINES[file.suffix])
        file.write_text("".join(lines), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
