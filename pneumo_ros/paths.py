# SPDX-License-Identifier: Apache-2.0
"""Where the files that ship with the package are: a source checkout, a pip prefix or a colcon install."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

from pneumo_ros.errors import InputError

PACKAGE = "pneumo_ros"


def share_file(*parts: str) -> Path:
    """Path of a shipped file, for example ``share_file("config", "rig.yaml")``.

    Raises
    ------
    InputError
        if no installation holds the file.
    """
    for root in _share_roots():
        candidate = root.joinpath(*parts)
        if candidate.exists():
            return candidate
    raise InputError(
        f"shipped file {'/'.join(parts)} not found",
        where=PACKAGE,
        remedy="reinstall the package (pip install .)",
    )


def _share_roots() -> Iterator[Path]:
    # A checkout comes first, so that an edited config is the one that runs.
    checkout = Path(__file__).resolve().parent.parent
    if (checkout / "package.xml").exists():
        yield checkout
    # The wheels of rclpy set no AMENT_PREFIX_PATH, so the ament index cannot be the only way.
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        if prefix:
            yield Path(prefix) / "share" / PACKAGE
    yield Path(sys.prefix) / "share" / PACKAGE
    # pip's --user, --prefix and colcon's install space: <prefix>/lib/pythonX.Y/site-packages/pneumo_ros/paths.py
    for parent in Path(__file__).resolve().parents[3:5]:
        yield parent / "share" / PACKAGE
