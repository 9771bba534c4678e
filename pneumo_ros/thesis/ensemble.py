# SPDX-License-Identifier: Apache-2.0
"""Many runs on all cores: one picklable job each, results in order."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")

FEW = 64  # jobs below which starting processes costs more than it saves


def run_all(function: Callable[[Job], Result], jobs: Sequence[Job], workers: int | None = None) -> list[Result]:
    """``function`` of every job, on ``workers`` processes (all cores by default).

    ``function`` must live at module level. Threads would do for compiled code, were it not that numba holds the
    interpreter lock.
    """
    count = workers or os.cpu_count() or 1
    if count == 1 or len(jobs) < FEW:
        return [function(job) for job in jobs]
    chunk = max(1, len(jobs) // (4 * count))
    with ProcessPoolExecutor(count, mp_context=get_context("spawn")) as pool:
        return list(pool.map(function, jobs, chunksize=chunk))
