# SPDX-License-Identifier: Apache-2.0
"""Many independent pieces of work over local processes, or over a Dask cluster: results in order, or left in files."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from types import FrameType
from typing import TypeVar

from pneumo_ros.errors import InputError, is_interruption

Item = TypeVar("Item")
Result = TypeVar("Result")
Outcome = tuple[Item, str]  # item and '' or what went wrong
RESTARTS = 3  # a worker that dies (killed, out of memory) costs a new pool, not the run
FEW = 64  # pieces below which starting processes costs more than it saves


def run_in_order(function: Callable[[Item], Result], items: Sequence[Item], workers: int | None = None) -> list[Result]:
    """``function`` of every item, on ``workers`` processes (all cores by default); the first exception ends it.

    ``function`` must live at module level. Threads would do for compiled code, were it not that numba holds the
    interpreter lock.
    """
    count = workers or os.cpu_count() or 1
    if count == 1 or len(items) < FEW:
        return [function(item) for item in items]
    with _pool(count) as pool:
        return list(pool.map(function, items, chunksize=max(1, len(items) // (4 * count))))


def run_each(
    work: Callable[[Item], object], items: Sequence[Item], workers: int = 1, scheduler: str | None = None
) -> Iterator[Outcome[Item]]:
    """Yield (item, error) as pieces finish, in any order.

    Parameters
    ----------
    work : module-level function that leaves its result in a file, whole or not at all; doing an item twice is harmless
    items : what to do, hashable
    workers : local processes
    scheduler : address of a Dask scheduler (``tcp://host:8786``); its workers need the package and the files' folder
    """
    if scheduler:
        yield from _over_dask(work, items, scheduler)
    elif workers <= 1:
        yield from ((item, _attempt(work, item)) for item in items)
    else:
        yield from _over_processes(work, items, workers)


def _pool(workers: int) -> ProcessPoolExecutor:
    """Fresh interpreters: a fork would copy locks and threads of libraries in whatever state they are."""
    return ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"), initializer=_heed_ctrl_c)


def _heed_ctrl_c() -> None:
    """A terminal sends it to workers too, whatever they do, waiting and importing included: the first process tells."""
    signal.signal(signal.SIGINT, _end_at_once)


def _end_at_once(number: int, frame: FrameType | None) -> None:
    os._exit(128 + number)


def _attempt(work: Callable[[Item], object], item: Item) -> str:
    try:
        work(item)
    except Exception as error:  # one bad case must not end the batch; it is reported and can be run again
        if is_interruption(error):
            raise KeyboardInterrupt from error
        return f"{type(error).__name__}: {error}"
    return ""


def _over_processes(work: Callable[[Item], object], items: Sequence[Item], workers: int) -> Iterator[Outcome[Item]]:
    left = list(items)
    for restart in range(RESTARTS + 1):
        try:
            for item, error in _one_pool(work, left, workers):
                left.remove(item)
                yield item, error
        except BrokenProcessPool:
            if restart == RESTARTS:
                yield from ((item, "its worker died again and again") for item in left)
            continue
        return


def _one_pool(work: Callable[[Item], object], items: Sequence[Item], workers: int) -> Iterator[Outcome[Item]]:
    with _pool(workers) as pool:
        futures = {pool.submit(_attempt, work, item): item for item in items}
        for future in as_completed(futures):
            yield futures[future], future.result()


def _over_dask(work: Callable[[Item], object], items: Sequence[Item], scheduler: str) -> Iterator[Outcome[Item]]:
    try:
        from distributed import Client
        from distributed import as_completed as finished
    except ImportError as error:
        raise InputError("Dask is not installed", key="--scheduler", value=scheduler,
                         remedy="pip install 'pneumo_ros[cluster]'") from error  # fmt: skip
    try:
        client = Client(scheduler, timeout="8s")
    except OSError as error:
        raise InputError(f"no scheduler answers ({error})", key="--scheduler", value=scheduler,
                         remedy="start one with `dask scheduler`, workers with `dask worker`") from error  # fmt: skip
    with client:
        futures = {client.submit(_attempt, work, item, pure=False): item for item in items}
        for future in finished(list(futures)):
            failure = future.exception() if future.status == "error" else None
            yield futures[future], str(failure) if failure is not None else future.result()
