# SPDX-License-Identifier: Apache-2.0
"""A record that no diagnosis can use is told in one line, before anything is fitted; lengths come from the record."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pneumo_ros.diagnosis.diagnose import diagnose
from pneumo_ros.diagnosis.fit.pace import HALF_CAR, pace_of_signals
from pneumo_ros.diagnosis.fit.record_pace import pace_of
from pneumo_ros.errors import InputError

GOOD = np.random.default_rng(1).normal(size=(100, 1))


def record(measured: Any) -> Any:
    return SimpleNamespace(name="log", period=0.01, measured=measured, weight=np.ones(np.shape(measured)))


BAD = {"no table": GOOD[:, 0], "(N, 1)": np.ones((100, 2)), "too few rows": GOOD[:3], "a number": GOOD * np.nan}


@pytest.mark.parametrize(("told", "measured"), BAD.items())
def test_a_record_of_another_shape_is_refused(told: str, measured: Any) -> None:
    model: Any = SimpleNamespace(channels=("x",))
    for logs, held in (([record(measured)], record(GOOD)), ([record(GOOD)], record(measured))):
        with pytest.raises(InputError, match=re.escape(told)) as error:
            diagnose(model, logs, held)
        assert len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize("period", [4.0, 1.0 / 610.35, 0.002])
def test_lengths_follow_the_records_own_motion(period: float) -> None:
    """The same signal sampled slowly or fast: the same number of blocks, averages and effective samples."""
    k = np.arange(2000)
    signal = (np.sin(2.0 * np.pi * k / 160.0) + 0.2 * np.sin(2.0 * np.pi * k / 40.0))[:, None]
    one, other = pace_of_signals(signal, period), pace_of_signals(signal, 1.0)
    assert one.averaged == other.averaged and one.correlation == pytest.approx(other.correlation)
    assert one.block / period == pytest.approx(other.block)
    assert one.period / period == pytest.approx(160.0, rel=0.05)
    assert one.settle < one.block < 2000 * period / 8.0


def test_a_record_that_says_nothing_has_the_half_cars_lengths() -> None:
    assert pace_of(record(GOOD)) is HALF_CAR
