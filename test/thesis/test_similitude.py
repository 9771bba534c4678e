# SPDX-License-Identifier: Apache-2.0
"""Similitude: Pi-numbers by linear algebra, and the proof that equal numbers make one car of two."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from pneumo_ros.errors import InputError
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig
from pneumo_ros.thesis.chapter3 import PRINTED, in_words, read_car
from pneumo_ros.thesis.half import conventional_car
from pneumo_ros.thesis.models.conventional import Conventional, simulate_conventional
from pneumo_ros.thesis.models.similar_systems import half_rates, rig_car, simulate
from pneumo_ros.thesis.models.similitude import (
    HONDA_CIVIC,
    Scales,
    evaluate,
    pi_number,
    representative_pi_numbers,
    scaled_down,
    scaled_up,
)
from pneumo_ros.thesis.similitude_proof import SYSTEMS, difference, laws_of

SAME = 1e-6  # standard deviations of each state
OTHER = 1e-2


def test_pi_numbers_are_the_printed_ones() -> None:
    found = representative_pi_numbers()
    for name, powers in PRINTED.items():
        ours = tuple(int(found[name].get(q, Fraction(0))) for q in ("length", "mass", "frequency"))
        assert ours == powers and found[name][name] == 1
    assert in_words(found["stiffness"]) == "stiffness / (mass frequency^2)"


def test_pi_numbers_have_no_dimension_whatever_the_primary_quantities() -> None:
    """Their value does not change when every unit is rescaled."""
    values = {"pressure": 3e5, "stiffness": 2e4, "damping": 70.0, "volume": 7e-5, "force": 90.0}
    primary = ("force", "damping", "volume")
    scales = Scales(2.0, 3.0, 0.7)
    for name in ("pressure", "stiffness"):
        powers = pi_number(name, primary)
        before = evaluate(powers, values)
        after = evaluate(powers, {q: scales.up(v, q) for q, v in values.items()})
        assert after == pytest.approx(before, rel=1e-12)


def test_primary_quantities_must_span_and_be_independent() -> None:
    with pytest.raises(InputError, match="depend on each other"):
        pi_number("force", ("length", "area", "mass"))
    with pytest.raises(InputError, match="no Pi-number"):
        pi_number("pressure", ("length", "frequency"))


def test_scaling_laws_are_the_printed_ones() -> None:
    f = HONDA_CIVIC.factor
    assert f("stiffness") == f("damping") == f("mass") == 12.0
    assert f("force") == 60.0 and f("pressure") == pytest.approx(2.4)
    assert HONDA_CIVIC.orifice_area == pytest.approx(5.0**3)
    general = Scales(3.0, 7.0, 0.5, 1.2)
    assert general.factor("stiffness") * 0.5**2 / 7.0 == pytest.approx(1.0)  # Eq. 3.44
    assert general.factor("damping") * 0.5 / 7.0 == pytest.approx(1.0)  # Eq. 3.45
    assert general.factor("force") * 0.5**2 / (7.0 * 3.0) == pytest.approx(1.0)  # Eq. 3.46
    assert 1.2**0.5 * 0.5 * general.orifice_area / 3.0**3 == pytest.approx(1.0)  # Eq. 4.44
    assert general.factor("pressure") * 3.0 * 0.5**2 / 7.0 == pytest.approx(1.0)  # Eq. 4.47


def test_a_car_goes_down_and_up_again() -> None:
    civic = read_car("table_3_3_honda_civic.csv")
    down = scaled_down(civic, HONDA_CIVIC)
    assert down["curb_weight"][0] / 2.0 == pytest.approx(load_rig().sprung_mass.value, rel=1e-3)
    back = scaled_up(down, HONDA_CIVIC)
    assert all(back[name][0] == pytest.approx(civic[name][0]) for name in civic)


@pytest.mark.parametrize("system", SYSTEMS)
def test_full_scale_scaled_and_dimensionless_coincide(system: str) -> None:
    for scales in (HONDA_CIVIC, Scales(3.0, 7.0, 0.5, 1.2)):
        full, numbers = difference(system, scales)
        assert full < SAME and numbers < SAME


@pytest.mark.slow
@pytest.mark.parametrize("system", SYSTEMS)
def test_they_stop_coinciding_when_one_law_is_broken(system: str) -> None:
    for law in laws_of(system):
        full, numbers = difference(system, HONDA_CIVIC, law)
        assert full > OTHER and numbers > OTHER, law


def test_parametrised_half_car_is_the_compiled_plant() -> None:
    """The systems tried for similitude are the rig: same trajectory as the plant every other figure rests on."""
    car, at_rest = nominal_half_car(load_rig())
    t = np.arange(401) * 5e-4
    road = np.column_stack([3e-3 * np.sin(20.0 * t), 2e-3 * np.sin(31.0 * t)])
    valves = np.tile(at_rest.command * 1.4, (400, 1))
    ours = simulate(half_rates(rig_car(*at_rest.pressures)), at_rest.state, valves, road, 5e-4)
    plant = HalfCar(car.body, car.front, car.rear, car.surface, 5e-4).simulate(at_rest.state, valves, road, 5e-4)
    np.testing.assert_allclose(ours, plant, rtol=1e-8, atol=1e-10)


def test_conventional_car_has_its_static_stiffness_and_conserves_energy() -> None:
    car = conventional_car(skyhook=False)
    road = np.full((4001, 2), 0.003)
    settled = simulate_conventional(np.zeros(8), road, 0.005, 10, car)[-1]
    np.testing.assert_allclose(settled[[0, 2, 3]], 0.003, atol=1e-6)
    free = Conventional(*car[:8], 0.0, 0.0, *car[10:12])
    start = np.array([0.004, 0.01, 0.0, 0.001, 0.0, 0.0, 0.0, 0.0])
    x = simulate_conventional(start, np.zeros((1001, 2)), 0.002, 8, free)
    energy = 0.5 * (
        free.sprung_mass * x[:, 4] ** 2
        + free.pitch_inertia * x[:, 5] ** 2
        + free.unsprung_mass_front * x[:, 6] ** 2
        + free.unsprung_mass_rear * x[:, 7] ** 2
        + free.stiffness_front * (x[:, 0] + free.front_arm * x[:, 1] - x[:, 2]) ** 2
        + free.stiffness_rear * (x[:, 0] - free.rear_arm * x[:, 1] - x[:, 3]) ** 2
        + free.tyre_stiffness_front * x[:, 2] ** 2
        + free.tyre_stiffness_rear * x[:, 3] ** 2
    )
    assert np.ptp(energy) < 1e-6 * energy[0]
