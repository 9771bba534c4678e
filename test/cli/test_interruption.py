# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C that was caught stays caught, wherever it met the program."""

from __future__ import annotations

import subprocess
import sys


def ended(program: str) -> tuple[int, str, str]:
    """Exit code, output and errors of a Python program."""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    return done.returncode, done.stdout, done.stderr


CAUGHT = """
import os, signal
from pneumo_ros.cli.interruption import interrupt
signal.signal(signal.SIGINT, interrupt)
try:
    exec("os.kill(os.getpid(), signal.SIGINT)\\nfor _ in range(1000): pass")
except KeyboardInterrupt:
    print("caught")
"""


def test_a_caught_interruption_of_generated_code_does_not_kill_the_process_at_its_end() -> None:
    assert ended(CAUGHT) == (0, "caught\n", "")


DROPPED = """
import ctypes, os, signal, time
from pneumo_ros.cli.interruption import interrupt
signal.signal(signal.SIGINT, interrupt)
compiler = {"__name__": "llvmlite.binding.executionengine", "os": os, "signal": signal}
exec("def notify():\\n    os.kill(os.getpid(), signal.SIGINT)\\n    for _ in range(1000): pass", compiler)
try:
    ctypes.CFUNCTYPE(None)(compiler["notify"])()
    time.sleep(10)
except KeyboardInterrupt:
    print("caught")
"""


def test_an_interruption_that_meets_a_callback_of_the_compiler_is_not_lost() -> None:
    """ctypes drops what is raised there: a batch went on to its end, exit code 0."""
    assert ended(DROPPED) == (0, "caught\n", "")


TAKEN_AWAY = """
import os, signal, time
from pneumo_ros.cli.interruption import interrupt
signal.signal(signal.SIGINT, interrupt)
class Held:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000): pass
try:
    held = Held()
    del held
    time.sleep(10)
except KeyboardInterrupt:
    print("caught")
"""


def test_an_interruption_that_meets_an_object_taken_away_is_neither_lost_nor_told_as_a_fault() -> None:
    """As a process's handle is, when the session has ended: a traceback stood among the last lines."""
    assert ended(TAKEN_AWAY) == (0, "caught\n", "")


LOADED = """
import sys, signal
before = set(sys.modules)
def first(number, handler):
    print(*sorted(set(sys.modules) - before))
    raise SystemExit
signal.signal, sys.argv = first, ["pneumo"]
import pneumo_ros.cli.main
"""


def test_nothing_is_loaded_before_ctrl_c_is_heeded() -> None:
    """What is takes its time, in which Ctrl-C ends in a traceback: 30 ms for the package's version alone."""
    _, loaded, errors = ended(LOADED)
    assert loaded.split() == ["pneumo_ros", "pneumo_ros.cli", "pneumo_ros.cli.main"], errors
