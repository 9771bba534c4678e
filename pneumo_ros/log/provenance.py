# SPDX-License-Identifier: Apache-2.0
"""What a log should say about the software that made it."""

from __future__ import annotations

import platform
import subprocess
from importlib import metadata
from pathlib import Path

from pneumo_ros import __version__

PACKAGES = ("numpy", "scipy", "numba", "mcap", "ros-jazzy-rclpy", "ros-rmw-fastrtps-cpp")


def versions() -> dict[str, str]:
    """Versions of the package, Python and what the numbers depend on, and the git commit of a checkout."""
    found = {"pneumo_ros": __version__, "python": platform.python_version(), "platform": platform.platform()}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    commit = git_commit()
    if commit:
        found["git_commit"] = commit
    return found


def git_commit() -> str:
    """Commit of the checkout this package runs from, with '+changes' if edited; '' elsewhere."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return ""

    def git(*words: str) -> str:
        result = subprocess.run(
            ["git", "-C", str(root), *words], capture_output=True, text=True, timeout=5, check=False
        )
        return result.stdout.strip()

    try:
        commit = git("rev-parse", "HEAD")
        return f"{commit}+changes" if commit and git("status", "--porcelain", "-uno") else commit
    except (OSError, subprocess.TimeoutExpired):
        return ""
