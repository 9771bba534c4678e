"""Ask the system to run this process before ordinary ones: a stalled driver trips, a stalled emulator is no board."""

from __future__ import annotations

import contextlib
import os

PRIORITY = 20  # SCHED_FIFO: above ordinary programs, below the kernel's own threads (50)
NICE = -10  # where real-time scheduling is not allowed


def prefer_this_process() -> str:
    """Real-time scheduling if allowed, else a better nice value, else nothing; returns which.

    Linux allows it to root and to users with an rtprio limit (/etc/security/limits.d).
    """
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
        return "fifo"
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, NICE)
        return "nice"
    return "ordinary"
