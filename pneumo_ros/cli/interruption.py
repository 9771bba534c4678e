# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C as an exception that a verb may catch."""

from __future__ import annotations

import os
import threading
from types import FrameType

COMPILER = "llvmlite.binding"  # calls back from compiled code
LATER = 0.02  # s


class Interrupted(KeyboardInterrupt):
    """Somebody asked for an end.

    Not KeyboardInterrupt itself: the interpreter notes one that passes through ``exec`` of a text (how the library
    makes dataclasses and named tuples, so any import may hold it) and kills itself with SIGINT when it ends, whether
    or not it was caught since.
    """


def interrupt(number: int, frame: FrameType | None) -> None:
    """Handler of a signal; while the compiler has called back, which drops what is raised there, it comes again.

    Raises
    ------
    Interrupted
        anywhere else.
    """
    while frame is not None:
        if str(frame.f_globals.get("__name__")).startswith(COMPILER):
            threading.Timer(LATER, os.kill, (os.getpid(), number)).start()
            return
        frame = frame.f_back
    raise Interrupted
