# SPDX-License-Identifier: Apache-2.0
"""Deadlines never drift, missed ones are counted; timing figures are percentiles of what was marked."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneumo_ros.session.timing import Deadlines, LoopTiming


@given(st.lists(st.integers(0, 10_000_000), min_size=1, max_size=50), st.integers(1, 5_000_000))
def test_deadlines_stay_on_their_grid_and_account_for_every_period(delays: list[int], period: int) -> None:
    deadlines, now = Deadlines(1_000, period), 1_000
    for delay in delays:
        now = max(now, deadlines.next_ns) + delay
        assert deadlines.due(now)
        deadlines.advance(now)
        assert (deadlines.next_ns - 1_000) % period == 0
        assert deadlines.next_ns > now >= deadlines.next_ns - period
    assert deadlines.ticks + deadlines.missed == (deadlines.next_ns - 1_000) // period - 1


def test_figures_of_a_known_loop() -> None:
    timing = LoopTiming()
    for i in range(200):
        timing.mark(i * 2_000_000, i * 2_000_000 + 50_000)
        if i == 99:
            timing.summary()
    timing.mark(200 * 2_000_000 + 900_000, 200 * 2_000_000 + 1_800_000)
    figures = timing.summary()
    assert figures["steps"] == "201"
    assert float(figures["period p50 (us)"]) == pytest.approx(2000.0)
    assert float(figures["period max (us)"]) == pytest.approx(2900.0)
    assert float(figures["step p50 (us)"]) == pytest.approx(50.0)
    assert float(figures["step max (us)"]) == pytest.approx(900.0)


def test_nothing_marked_gives_zeros() -> None:
    assert set(LoopTiming().summary().values()) == {"0", "0.0"}
