"""Ask the system to run this process before ordinary ones: a stalled driver trips, a stalled emulator is no board.

Nice values, not SCHED_FIFO: a terminal's bytes pass through an ordinary kernel worker that real-time processes starve.
Measured with an emulator and a driver on two cores under a load of five: frame latency p99 4.6 ms at nice -20, 50 to
260 ms at 0, and stops of 2 to 12 s with SCHED_FIFO.
"""

from __future__ import annotations

import contextlib
import os

NICE = -20


def prefer_this_process() -> bool:
    """The best nice value, if the system allows it (root, or a nice limit in /etc/security/limits.d); says whether."""
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, NICE)
        return True
    return False
