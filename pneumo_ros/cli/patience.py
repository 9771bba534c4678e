# SPDX-License-Identifier: Apache-2.0
"""What a user's code is given of time before it must have answered once."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pneumo_ros.errors import InputError

PATIENCE = 180.0  # s: numba compiles the largest of the examples in a tenth of it on a busy computer


@contextmanager
def answered(path: Path) -> Iterator[None]:
    """The command ends in one line, code 2, where the block has not ended in time.

    A loop without end cannot be left by an exception, least of all a compiled one: the process ends.
    """
    line = InputError("the model does not come back", where=path, value=f"{PATIENCE:g} s", allowed="within that",
                      remedy="look for a loop without end")  # fmt: skip

    def give_up() -> None:
        os.write(2, f"error: {line}\n".encode())
        os._exit(2)

    timer = threading.Timer(PATIENCE, give_up)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
