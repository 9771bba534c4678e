# SPDX-License-Identifier: Apache-2.0
"""Pieces of work at a time: in their order, by more than one thread, from within a piece, and after an error."""

from __future__ import annotations

import threading
import time

import pytest

from pneumo_ros.diagnosis.fit.together import each


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_results_come_in_the_order_of_the_items(threads: int) -> None:
    def late(k: int) -> int:
        time.sleep(0.002 * (20 - k))
        return k * k

    assert each(threads, late, range(20)) == [k * k for k in range(20)]
    assert each(threads, late, []) == []


def test_two_threads_work_at_the_same_time() -> None:
    both = threading.Barrier(2, timeout=20.0)  # passed by two at once or broken

    assert each(2, lambda k: both.wait() >= 0, range(6)) == [True] * 6


def test_work_may_ask_for_work_in_the_same_way() -> None:
    def product(k: int, depth: int) -> int:
        return sum(each(2, lambda m: product(m, depth - 1), range(4))) + k if depth else k

    assert each(2, lambda k: product(k, 4), range(4)) == [product(k, 4) for k in range(4)]


def test_an_error_ends_it_and_nobody_begins_another() -> None:
    begun: list[int] = []

    def work(k: int) -> int:
        begun.append(k)
        if k == 3:
            raise ValueError("the fourth")
        time.sleep(0.005)
        return k

    with pytest.raises(ValueError, match="the fourth"):
        each(2, work, range(100))
    assert len(begun) < 10
