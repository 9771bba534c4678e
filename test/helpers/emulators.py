# SPDX-License-Identifier: Apache-2.0
"""`pneumo emulate` with any words, each board in a process of its own.

The processes are forked off one that has loaded what they need (:mod:`helpers.warm_board`): to load it takes a
processor three seconds.
"""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from multiprocessing import forkserver
from multiprocessing.process import BaseProcess
from pathlib import Path

import pytest

PATIENCE = 60.0  # s; a loaded computer is slow, not wrong
TESTS = Path(__file__).resolve().parents[1]
_processes = multiprocessing.get_context("forkserver")


@cache
def _server() -> None:
    """Start the process that boards are forked off; it looks for what it loads along PYTHONPATH only."""
    _processes.set_forkserver_preload(["helpers.warm_board"])
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(TESTS), prepend=os.pathsep)
        forkserver.ensure_running()


def started(link: Path, *words: str) -> BaseProcess:
    """A board whose port is there."""
    _server()
    process = _processes.Process(target=_emulate, args=(("--link", str(link), *words), dict(os.environ)), daemon=True)
    process.start()
    end = time.monotonic() + PATIENCE
    while not link.is_symlink():
        if not process.is_alive() or time.monotonic() > end:
            ended(process)
            raise AssertionError(f"the emulator did not start: exit code {process.exitcode}")
        time.sleep(0.02)
    return process


def ended(process: BaseProcess) -> None:
    """Ended as by a user, its record written."""
    process.terminate()
    process.join(30.0)
    if process.is_alive():
        process.kill()
        process.join()


@contextmanager
def emulated(link: Path, *words: str) -> Iterator[BaseProcess]:
    """A board for the time of a context."""
    process = started(link, *words)
    try:
        yield process
    finally:
        ended(process)


def _emulate(words: tuple[str, ...], environment: Mapping[str, str]) -> None:
    from pneumo_ros.cli.emulate import app

    os.environ.clear()
    os.environ.update(environment)
    app(["--quiet", *words])
