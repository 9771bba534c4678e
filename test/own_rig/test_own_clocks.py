# SPDX-License-Identifier: Apache-2.0
"""Topics with clocks of their own: moved where receipt tells by how much, left where it may be a delay, or refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pneumo_ros.errors import InputError
from pneumo_ros.own_rig.clocks import on_one_clock
from pneumo_ros.own_rig.tables import Sampled

sent = 1.7e9 + np.arange(4000) * 0.01  # s, 40 s at 100 Hz
TOPICS = {"x": "/cart", "u": "/motor"}


def signals(stamp: np.ndarray, delay: float = 0.0, seed: int = 3) -> dict[str, Sampled]:
    """Two topics whose messages take up to some ms; the second is stamped ``stamp`` and takes ``delay`` more."""
    rng = np.random.default_rng(seed)
    late = rng.exponential(2e-3, (2, len(sent)))
    stall = np.where((sent > sent[0] + 11.0) & (sent < sent[0] + 14.0), 0.3, 0.0)  # of the recorder
    x, u = (np.maximum.accumulate(sent + one + stall) for one in late)
    return {"x": Sampled(sent, np.sin(sent - sent[0]), x), "u": Sampled(stamp, np.cos(sent - sent[0]), u + delay)}


def aligned(stamp: np.ndarray, delay: float = 0.0) -> tuple[np.ndarray, list[str]]:
    """Error of the second topic's times, and what was said."""
    out, said = on_one_clock(signals(stamp, delay), TOPICS, Path("log"))
    assert np.array_equal(out["x"].time, sent)
    return out["u"].time - sent, [one.text for one in said]


def test_clocks_that_agree_are_left_to_the_bit() -> None:
    error, said = aligned(sent)
    assert not error.any() and not said


@pytest.mark.parametrize("offset", [0.35, -0.35, 3.0, -1.7e9])
@pytest.mark.parametrize("drift", [0.0, 400e-6, -1500e-6])
def test_offset_and_drift_are_taken_out(offset: float, drift: float) -> None:
    error, said = aligned(sent + offset + drift * (sent - sent[0]), delay=0.6 if -1.0 < offset < 0.0 else 0.0)
    wanted = 0.6 if -1.0 < offset < 0.0 else 0.0  # a delay of that length cannot be told from a clock that is behind
    assert np.abs(error - wanted).max() < 2e-3
    assert len(said) == 1 and "/motor" in said[0] and ("ppm" in said[0]) == (drift != 0.0)


def test_what_may_be_a_delay_is_left_and_said() -> None:
    error, said = aligned(sent, delay=0.08)
    assert not error.any()
    assert said == ["/motor arrives 0.08 s later after its stamps than /cart: taken for a delay on its way, its stamps "
                    "for true"]  # fmt: skip


def test_a_drift_below_half_an_interval_is_left() -> None:
    error, said = aligned(sent + 100e-6 * (sent - sent[0]) - 2e-3)
    assert np.abs(error).max() < 2.1e-3 and not said


@pytest.mark.parametrize("step", [0.2, -2.0])
def test_a_clock_that_was_set_while_the_log_ran_is_refused(step: float) -> None:
    with pytest.raises(InputError, match=r"log, /motor: the topic's clock does not keep to the others'") as told:
        aligned(sent + np.where(sent > sent[1500], step, 0.0))
    assert len(str(told.value).splitlines()) == 1


def test_tables_and_single_topics_have_one_clock() -> None:
    held = signals(sent + 5.0)
    assert on_one_clock(held, {"x": "/both", "u": "/both"}, Path("log"))[0]["u"] is held["u"]
    bare = {name: Sampled(one.time, one.values) for name, one in held.items()}
    assert on_one_clock(bare, TOPICS, Path("log")) == (bare, ())
