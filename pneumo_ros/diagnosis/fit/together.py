# SPDX-License-Identifier: Apache-2.0
"""Independent pieces of work several at a time, also from within such a piece."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from functools import lru_cache
from typing import TypeVar

Item = TypeVar("Item")
Done = TypeVar("Done")


def each(threads: int, work: Callable[[Item], Done], items: Iterable[Item]) -> list[Done]:
    """``work`` done on each item, in their order, by so many threads at a time.

    Who asks works on the items as well, and waits at last only for those that others have begun: no thread waits for
    one that waits for it, and a candidate's fit may ask for its sensitivities in the same way.

    Parameters
    ----------
    threads : 1: one after the other; more pay where the work runs without the interpreter's lock
    work : its results must not depend on the order they are done in
    """
    todo = list(items)
    if threads < 2 or len(todo) < 2:
        return [work(item) for item in todo]
    done: dict[int, Done] = {}
    waiting = iter(range(len(todo)))  # an iterator of C gives each number once, whoever asks

    def take() -> None:
        try:
            for k in waiting:
                done[k] = work(todo[k])
        except BaseException:
            deque(waiting, maxlen=0)  # nobody begins another
            raise

    helpers = [_pool(threads).submit(copy_context().run, take) for _ in range(min(threads, len(todo)) - 1)]
    try:
        take()
    finally:
        begun = [helper for helper in helpers if not helper.cancel()]
    for helper in begun:
        helper.result()
    return [done[k] for k in range(len(todo))]


@lru_cache(maxsize=2)
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, "simulation")
