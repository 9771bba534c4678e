# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C as an exception that a verb may catch."""

from __future__ import annotations

from types import FrameType


class Interrupted(KeyboardInterrupt):
    """Somebody asked for an end.

    Not KeyboardInterrupt itself: the interpreter notes one that passes through ``exec`` of a text (how the library
    makes dataclasses and named tuples, so any import may hold it) and kills itself with SIGINT when it ends, whether
    or not it was caught since.
    """


def interrupt(number: int, frame: FrameType | None) -> None:
    """Handler of a signal.

    Raises
    ------
    Interrupted
        always.
    """
    raise Interrupted
