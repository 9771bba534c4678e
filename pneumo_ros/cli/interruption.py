# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C as an exception that a verb may catch."""

from __future__ import annotations

import os
import threading
from types import FrameType

COMPILER = "llvmlite.binding"  # calls back from compiled code
FINALISER = "__del__"  # the interpreter drops what it raises, and says so
LATER = 0.02  # s


class Interrupted(KeyboardInterrupt):
    """Somebody asked for an end.

    Not KeyboardInterrupt itself: the interpreter notes one that passes through ``exec`` of a text (how the library
    makes dataclasses and named tuples, so any import may hold it) and kills itself with SIGINT when it ends, whether
    or not it was caught since.
    """


def interrupt(number: int, frame: FrameType | None) -> None:
    """Handler of a signal; where what is raised would be dropped, it comes again: the compiler has called back, or an
    object is being taken away.

    Raises
    ------
    Interrupted
        anywhere else.
    """
    while frame is not None:
        if frame.f_code.co_name == FINALISER or str(frame.f_globals.get("__name__")).startswith(COMPILER):
            threading.Timer(LATER, os.kill, (os.getpid(), number)).start()
            return
        frame = frame.f_back
    raise Interrupted
