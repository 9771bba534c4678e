# SPDX-License-Identifier: Apache-2.0
"""The null table behind the thresholds of evidence: enough rigs that what chance wins is known."""

from __future__ import annotations

import numpy as np
import pytest

from pneumo_ros.diagnosis.search.selection import NULL_QUANTILE, Thresholds, null_thresholds, null_wins

RESAMPLES = 2000


@pytest.mark.parametrize("added", [1, 2])
def test_the_quantile_of_what_chance_wins_is_known_within_a_fifth(added: int) -> None:
    """Standard error over resampled rigs (bootstrap), of the training cost that an effect that is not there takes."""
    wins = null_wins("cost", added)
    rng = np.random.default_rng(1)
    quantiles = np.quantile(rng.choice(wins, (RESAMPLES, len(wins))), NULL_QUANTILE, axis=1)
    assert np.std(quantiles) < 0.2 * np.quantile(wins, NULL_QUANTILE)


def test_the_floors_lie_above_what_chance_wins() -> None:
    """Simulated nulls are cleaner than any rig: were one to win by more than a floor, the floor would be wrong."""
    assert null_thresholds() == Thresholds()
    for column, added, floor in (
        ("advantage", 1, Thresholds().first),
        ("advantage", 2, Thresholds().second),
        ("fall", 1, Thresholds().least),
    ):
        assert np.quantile(null_wins(column, added), NULL_QUANTILE) < 0.5 * floor
