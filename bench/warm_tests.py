# SPDX-License-Identifier: Apache-2.0
"""Test runs that start from a process in which the libraries are imported: most of a short run's time.

``python warm_tests.py serve SOCKET PYTEST_ARGUMENTS...`` imports them and waits; ``python warm_tests.py ask SOCKET``
has it run the tests once, in a fork, and ends with their exit code. Nothing of pneumo_ros is imported beforehand: a
changed file counts from the next question on.
"""

from __future__ import annotations

import os
import socket
import sys
from contextlib import suppress

LIBRARIES = ("hypothesis", "mcap.reader", "numba", "numpy", "rosbags.typesys", "scipy.optimize", "scipy.signal", "yaml")
LOOK = 0.02  # s between looks at a run


def serve(place: str, arguments: list[str]) -> None:
    """Answer questions one after the other until killed."""
    import importlib

    import pytest

    for name in LIBRARIES:
        importlib.import_module(name)
    with socket.socket(socket.AF_UNIX) as door:
        door.bind(place)
        door.listen()
        while True:
            asked, _ = door.accept()
            with asked:
                child = os.fork()
                if not child:
                    door.close()
                    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
                    os.dup2(1, 2)
                    os._exit(int(pytest.main(arguments)))
                code = _code(child, asked)
                with suppress(BrokenPipeError):  # who asked has stopped waiting (a mutant that hangs)
                    asked.sendall(bytes([code]))


def _code(child: int, asked: socket.socket) -> int:
    """Exit code of a run; one whose asker has gone is killed."""
    asked.settimeout(LOOK)
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return min(abs(os.waitstatus_to_exitcode(status)), 255)
        try:
            if not asked.recv(1):
                os.kill(child, 9)
                os.waitpid(child, 0)
                return 1
        except TimeoutError:
            continue


def ask(place: str) -> int:
    """Exit code of one run of the tests; 1 if its answer does not come."""
    with socket.socket(socket.AF_UNIX) as door:
        door.connect(place)
        answer = door.recv(1)
    return answer[0] if answer else 1


if __name__ == "__main__":
    if sys.argv[1] == "serve":
        serve(sys.argv[2], sys.argv[3:])
    raise SystemExit(ask(sys.argv[2]))
