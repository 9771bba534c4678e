# SPDX-License-Identifier: Apache-2.0
"""Comfort criteria against their published values."""

from __future__ import annotations

import numpy as np
import pytest

from pneumo_ros.thesis.comfort_limits import (
    Bands,
    healey,
    iso_1972_limit,
    janeway_use,
    permitted_hours,
    third_octaves,
    weighted_rms,
    wk,
)
from pneumo_ros.units import GRAVITY

RATE = 500.0


def sine(frequency: float, amplitude: float, seconds: float = 32.0) -> np.ndarray:
    t = np.arange(int(seconds * RATE)) / RATE
    return amplitude * np.sin(2 * np.pi * frequency * t)


def test_wk_has_the_values_of_the_standard() -> None:
    """ISO 2631-1:1997, table 3, factors x 1000."""
    published = {0.5: 0.418, 1.0: 0.482, 2.0: 0.531, 4.0: 0.967, 6.3: 1.054, 8.0: 1.036, 16.0: 0.768, 31.5: 0.405}
    ours = wk(np.array(list(published)))
    np.testing.assert_allclose(ours, list(published.values()), rtol=5e-3)


def test_weighted_rms_of_a_sine_is_its_rms_times_wk() -> None:
    assert weighted_rms(sine(4.0, 1.0), RATE) == pytest.approx(float(wk(4.0)) / np.sqrt(2.0), rel=1e-3)


def test_third_octaves_put_a_sine_in_its_band_and_keep_the_power() -> None:
    bands = third_octaves(sine(10.0, 2.0), RATE)
    assert bands.centres[np.argmax(bands.rms)] == pytest.approx(10.0, rel=1e-6)
    assert np.sqrt(np.sum(bands.rms**2)) == pytest.approx(np.sqrt(2.0), rel=0.02)
    noise = np.random.default_rng(1).standard_normal(200_000)
    white = third_octaves(noise, RATE)
    expected = np.sqrt(white.centres * (10**0.05 - 10**-0.05) / (RATE / 2))
    np.testing.assert_allclose(white.rms, expected, rtol=0.1)


def test_limits_of_1972() -> None:
    assert iso_1972_limit(6.0, 8.0) == pytest.approx(0.315) and iso_1972_limit(1.0, 8.0) == pytest.approx(0.63)
    assert iso_1972_limit(80.0, 8.0) == pytest.approx(3.15)
    assert 0.315 < iso_1972_limit(6.0, 6.0) < 0.53


def test_permitted_exposure_is_that_of_the_worst_band() -> None:
    centres = np.array([2.0, 5.0, 20.0])
    quiet, loud = Bands(centres, np.full(3, 0.3)), Bands(centres, np.array([0.1, 0.5, 0.1]))
    assert permitted_hours(quiet) == 8.0 and permitted_hours(loud) == 4.0
    assert permitted_hours(Bands(centres, np.full(3, 9.0))) == 0.0


def test_janeway_limits_at_their_edges() -> None:
    """A sine at the limit of each range uses it exactly (Section 2.2.2)."""
    for frequency, peak in ((2.0, 12.6 / (2 * np.pi * 2.0)), (10.0, 0.33), (40.0, 2.7e-3 * 2 * np.pi * 40.0)):
        assert janeway_use(Bands(np.array([frequency]), np.array([peak / np.sqrt(2)]))) == pytest.approx(1.0)


def test_healeys_table() -> None:
    assert healey(0.02 * GRAVITY) == ("smooth", "4-5")
    assert healey(0.04 * GRAVITY)[1] == "3-4" and healey(0.5 * GRAVITY)[1] == "2-3"
