# SPDX-License-Identifier: Apache-2.0
"""Roads: their spectrum against Eq. 6.1, their delay, their start, their repeatability."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.signal import welch

from pneumo_ros.errors import InputError
from pneumo_ros.road import ISO_MEAN, LENGTH_SCALE, RoadSpec, build_road, iso_components, iso_psd, make_road
from pneumo_ros.units import KMH

PSD_TOLERANCE_DB = 1.0


@pytest.mark.parametrize("iso_class", ["A", "D", "H"])
def test_spectrum_is_within_1_db_of_eq_6_1_over_the_band(iso_class: str) -> None:
    rate, speed = 125.0, 80.0 * KMH
    spec = RoadSpec(iso_class=iso_class, seed=5, spacing_hz=0.05)
    heights, _ = make_road(spec).sample(np.arange(0.0, 600.0, 1.0 / rate))
    frequency, density = welch(heights[:, 0] * LENGTH_SCALE, rate, nperseg=500)
    inside = (frequency > spec.low_hz + 0.5) & (frequency < spec.high_hz - 0.5)
    level = 10.0 * np.log10(density[inside] / iso_psd(frequency[inside], iso_class, speed))
    third = np.array_split(level, 24)
    assert max(abs(float(np.mean(part))) for part in third) < PSD_TOLERANCE_DB
    assert abs(float(level.mean())) < 0.3


def test_variance_of_the_components_is_the_integral_of_the_spectrum() -> None:
    spec = RoadSpec()
    f = np.linspace(spec.low_hz, spec.high_hz, 200_001)
    whole = trapezoid(iso_psd(f, "D", 80.0 * KMH), f)
    _, amplitude, _ = iso_components(spec)
    assert np.sum(amplitude**2) / 2.0 == pytest.approx(whole, rel=0.02)


def test_spectrum_at_the_reference_is_per_cycle_while_omega_is_in_radians() -> None:
    speed = 80.0 * KMH
    at_reference = speed / (2.0 * np.pi)  # Hz, where Omega = 1 rad/m
    assert iso_psd(at_reference, "D", speed) * speed == pytest.approx(ISO_MEAN["D"])
    slopes = [
        np.log2(iso_psd(2 * f, "D", speed) / iso_psd(f, "D", speed)) for f in (at_reference / 4, at_reference * 2)
    ]
    np.testing.assert_allclose(slopes, [-2.0, -1.5])


def test_rear_meets_the_front_road_after_wheelbase_over_speed() -> None:
    road = build_road({"seed": 3}, wheelbase=0.508)
    assert road.spec.rear_delay == pytest.approx(0.1143, abs=1e-6)
    t = np.linspace(2.0, 4.0, 400)
    front, _ = road.sample(t)
    rear, _ = road.sample(t + road.spec.rear_delay)
    np.testing.assert_allclose(rear[:, 1], front[:, 0], atol=1e-12)


@pytest.mark.parametrize("kind", ["iso", "sine", "sweep", "bump", "step", "flat"])
def test_starts_flat_at_rest_and_its_velocity_is_its_derivative(kind: str) -> None:
    road = make_road(RoadSpec(kind=kind, start=0.25))
    t = np.arange(0.0, 4.0, 1e-4)
    z, v = road.sample(t)
    assert np.all(z[t <= 0.25] == 0.0) and np.all(v[t <= 0.25] == 0.0)
    assert np.max(np.abs(np.diff(z, axis=0))) < 1e-3
    middle = 0.5 * (v[1:] + v[:-1]) * 1e-4
    assert np.max(np.abs(np.diff(z, axis=0) - middle)) < 2e-6


def test_same_seed_is_the_same_road_and_another_is_not() -> None:
    t = np.linspace(0.0, 5.0, 101)
    one, again, other = (make_road(RoadSpec(seed=s)).sample(t)[0] for s in (7, 7, 8))
    assert np.array_equal(one, again) and not np.allclose(one, other)


def test_road_does_not_depend_on_how_it_is_sampled() -> None:
    road = make_road(RoadSpec())
    t = np.linspace(0.0, 2.0, 21)
    np.testing.assert_allclose(road.sample(t)[0][13], road.sample(t[13])[0][0], rtol=0.0, atol=1e-13)


def test_file_is_interpolated_and_its_rear_delayed(tmp_path: Path) -> None:
    path = tmp_path / "road.csv"
    path.write_text("time_s,front_m\n0,0\n1,0.01\n2,0.01\n")
    road = make_road(RoadSpec(kind="file", path=str(path), rear_delay=0.5))
    z, v = road.sample([-1.0, 0.5, 1.0, 5.0])
    np.testing.assert_allclose(z, [[0, 0], [0.005, 0], [0.01, 0.005], [0.01, 0.01]])
    np.testing.assert_allclose(v, [[0, 0], [0.01, 0.01], [0, 0.01], [0, 0]])


@pytest.mark.parametrize("text", ["", "a,b\n", "0,0\n0,1\n", "0,0\n1,nan\n", "0,0\nx,1\n"])
def test_bad_file_is_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "road.csv"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        make_road(RoadSpec(kind="file", path=str(path)))
    assert str(path) in str(error.value) and "\n" not in str(error.value)


def test_empty_band_and_unknown_names_are_refused() -> None:
    with pytest.raises(InputError, match="empty band"):
        make_road(RoadSpec(low_hz=40.0))
    with pytest.raises(InputError, match="iso_class"):
        build_road({"iso_class": "J"}, wheelbase=0.5)
    with pytest.raises(InputError, match="sped"):
        build_road({"sped": 3}, wheelbase=0.5)
