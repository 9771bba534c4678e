# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C that was caught stays caught, wherever it met the program."""

from __future__ import annotations

import subprocess
import sys

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
    done = subprocess.run([sys.executable, "-c", CAUGHT], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (0, "caught\n", "")
