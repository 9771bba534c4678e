# SPDX-License-Identifier: Apache-2.0
"""A piece of work for a batch whose process is still busy with taking it in."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any


def arrive(folder: str) -> str:
    """A piece of work is taken from the queue; what it is made of takes a minute to import."""
    (Path(folder) / "arrives").touch()
    time.sleep(60)
    return folder


class Arriving:
    """A piece of work that arrives slowly."""

    def __init__(self, folder: str) -> None:
        self.folder = folder

    def __reduce__(self) -> Any:
        return arrive, (self.folder,)
