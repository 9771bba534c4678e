# SPDX-License-Identifier: Apache-2.0
"""The user's own folder for generated code: nobody else can write to it, and a file there is what its name says.

What is executed from here was put here by this package under a name that holds the hash of its content; a file whose
content is another is written anew before it is used.
"""

from __future__ import annotations

import os
import stat
import tempfile
from functools import lru_cache
from pathlib import Path

PRIVATE = 0o700


def cache_folder() -> Path:
    """Where generated code lives: PNEUMO_KERNEL_CACHE, else the user's cache, else a temporary folder; mode 0700."""
    named = os.environ.get("PNEUMO_KERNEL_CACHE")
    folder = Path(named) if named else Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "pneumo_ros"
    return folder if _private(folder) else _fallback()


def kept(name: str, content: bytes) -> Path:
    """The file ``name`` of the cache with exactly this content; a file of another content is replaced.

    Parameters
    ----------
    name : with the hash of the content in it
    """
    path = cache_folder() / name
    if _holds(path, content):
        return path
    handle, part = tempfile.mkstemp(dir=path.parent, prefix=name, suffix=".part")
    with os.fdopen(handle, "wb") as stream:
        stream.write(content)
    Path(part).replace(path)
    return path


def _holds(path: Path, content: bytes) -> bool:
    try:
        return not path.is_symlink() and path.read_bytes() == content
    except OSError:
        return False


def _private(folder: Path) -> bool:
    """Make the folder, or take the user's own; one that others own or that cannot be written is no place for code."""
    try:
        folder.mkdir(mode=PRIVATE, parents=True, exist_ok=True)
        found = folder.stat()
        if found.st_uid != os.getuid():
            return False
        if stat.S_IMODE(found.st_mode) != PRIVATE:
            folder.chmod(PRIVATE)
        return os.access(folder, os.W_OK)
    except OSError:
        return False


@lru_cache(maxsize=1)
def _fallback() -> Path:
    """In the temporary folder everybody may make names: one that is there already is taken only if it is a folder
    of the user's own, and no link."""
    folder = Path(tempfile.gettempdir()) / f"pneumo_ros-{os.getuid()}"
    if not folder.is_symlink() and _private(folder):
        return folder
    return Path(tempfile.mkdtemp(prefix="pneumo_ros-"))
