# SPDX-License-Identifier: Apache-2.0
"""A place in the ROS graph belongs to one session at a time: a locked file says who has it. Knows no ROS.

Looking at the graph is not enough: two sessions that start together would both see nobody. The lock is the kernel's and
is inherited by the session's nodes, so it ends with the last of them, however they end.
"""

from __future__ import annotations

import fcntl
import json
import os
import tempfile
from datetime import datetime
from pathlib import Path
from typing import Any

from pneumo_ros.errors import InputError

REMEDY = "end it, or give this one a place of its own: --isolate, --domain N, or --namespace NAME"


class Claim:
    """A place that is held until :meth:`release`, or until the last process that inherited it has ended.

    Parameters
    ----------
    domain : DDS domain
    namespace : '' or of the form /rig1
    what : words about the session, for whom it keeps out
    folder : of the locks; the user's runtime folder by default

    Raises
    ------
    InputError
        naming the session that has the place.
    """

    def __init__(self, domain: int, namespace: str, what: str, folder: Path | None = None) -> None:
        self.domain, self.namespace = domain, namespace
        path = (folder or runtime_folder()) / f"domain-{domain}{namespace.replace('/', '.')}.lock"
        flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
        self.descriptor = os.open(path, flags, 0o600)
        try:
            fcntl.flock(self.descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = _holder(self.descriptor)
            os.close(self.descriptor)
            raise taken(domain, namespace, holder) from None
        started = datetime.now().astimezone().isoformat(timespec="seconds")
        os.ftruncate(self.descriptor, 0)
        os.pwrite(self.descriptor, json.dumps({"pid": os.getpid(), "started": started, "what": what}).encode(), 0)

    def release(self) -> None:
        """This process needs the place no more."""
        os.close(self.descriptor)


def taken(domain: int, namespace: str, holder: str) -> InputError:
    """The refusal: who has the place, and what to do."""
    where = f"domain {domain}" + (f", namespace {namespace}" if namespace else "")
    return InputError(f"a session runs here already ({holder})", where=where, remedy=REMEDY)


def runtime_folder() -> Path:
    """This user's folder for what does not survive a restart of the computer."""
    base = os.environ.get("XDG_RUNTIME_DIR")
    path = Path(base) / "pneumo_ros" if base else Path(tempfile.gettempdir()) / f"pneumo_ros-{os.getuid()}"
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        if path.is_symlink() or path.stat().st_uid != os.getuid():
            raise PermissionError("it belongs to somebody else")
    except OSError as error:
        raise InputError(
            f"cannot use the folder of locks ({error})", where=path, remedy="set XDG_RUNTIME_DIR"
        ) from error
    return path


def _holder(descriptor: int) -> str:
    try:
        said: Any = json.loads(os.pread(descriptor, 4096, 0))
        return f"{said['what']}, process {said['pid']}, since {said['started']}"
    except (ValueError, KeyError, TypeError):
        return "it has not said yet what it is"
