# SPDX-License-Identifier: Apache-2.0
"""Files that this package makes: whole or not at all, and never through a link that stands in their place."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_UMASK = os.umask(0o022)
os.umask(_UMASK)


@contextmanager
def new_file(target: Path) -> Iterator[Path]:
    """A name beside ``target`` to write to; it becomes the target once everything is written.

    The name is new, so that no link made beforehand can lead elsewhere, and a link in the target's place is replaced
    rather than followed. After an error nothing is left.
    """
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name[:100]}.", suffix=".part")
    os.close(handle)
    part = Path(name)
    try:
        yield part
        part.chmod(0o666 & ~_UMASK)
        part.replace(target)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
