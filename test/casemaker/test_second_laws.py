# SPDX-License-Identifier: Apache-2.0
"""Second laws: at rest, in their own place, of the form that their equations say, and contained in no other one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from pneumo_ros.casemaker import catalogue
from pneumo_ros.casemaker.laws import gas, ground, slots, strut
from pneumo_ros.casemaker.parameters import RicherRig, richer_rig
from pneumo_ros.casemaker.registry import LATER, SECOND, Effect, ends_of
from pneumo_ros.casemaker.trim import residual, rest_of
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig

RIG = load_rig()
CAR, TRIM = nominal_half_car(RIG)
RICHER = richer_rig(RIG, TRIM.pressures)
SECONDS = [(name, law) for name, laws in SECOND.items() for law in laws] + [(name, "") for name in LATER]


def row(number: int, *values: float) -> NDArray[np.float64]:
    """A row of the second laws' table."""
    return slots.table((slots.Law("front", slots.FRICTION, number, values),))[0, slots.FRICTION]


def driven(step: Callable[[float, float], tuple[float, float]], speeds: NDArray[np.float64], dt: float) -> list[float]:
    """Forces of a law with one memory that is driven at given speeds."""
    memory, out = 0.0, []
    for speed in speeds:
        force, rate = step(memory, float(speed))
        memory += dt * rate
        out.append(force)
    return out


@pytest.mark.parametrize(("name", "law"), SECONDS)
def test_every_second_law_starts_at_rest_and_moves_its_own_end(name: str, law: str) -> None:
    effect = catalogue.get(name, law)
    for side in effect.sides:
        applied = effect.apply(RICHER, 0.3, side, np.random.default_rng(1))
        rates = residual(applied.rig, rest_of(applied.rig, TRIM.outlets, CAR.surface), CAR.surface)
        assert np.abs(rates[:8]).max() < 1e-6
        assert np.abs(rates[8:10]).max() < 1.0  # Pa/s
        assert np.abs(rates[10:]).max() < 1e-6
        assert changed_ends(applied.rig) <= set(ends_of(side))
        assert changed_ends(applied.rig) or applied.rig.frame != RICHER.frame or applied.rig.laws
        assert applied.parameters
        assert applied.places


def changed_ends(rig: RicherRig) -> set[str]:
    """Ends at which a rig is not the nominal one."""
    out = {end for end in ("front", "rear") if getattr(rig, end) != getattr(RICHER, end)}
    return out | {law.end for law in rig.laws if law.row not in slots.SHARED}


def test_every_family_has_two_laws_that_the_library_does_not_contain() -> None:
    for name in catalogue.known_effects():
        assert len(catalogue.laws_of(name, foreign=True)) >= 2, name
        assert catalogue.laws_of(name, foreign=False), name
    assert len(catalogue.outside_all()) >= 14
    assert not set(catalogue.outside_all()) & set(catalogue.known_effects())


def test_first_law_is_what_a_set_of_0_3_gets() -> None:
    assert catalogue.get("leak").law == "laminar"
    assert catalogue.get("leak", "slit").law == "slit"
    assert isinstance(catalogue.get("rod_end_backlash"), Effect)


def test_friction_levels_are_those_of_their_equations() -> None:
    speeds = np.full(4000, 0.05)
    load = row(1, 10.0, 3.0, 200.0, 2e-4)
    for spring, level in ((200.0, 10.0), (240.0, 16.0), (100.0, 1.0)):  # 10 (1 + 3 (S/200 - 1)), never below a tenth
        forces = driven(lambda z, v, s=spring: strut.friction(load, z, v, s), speeds, 1e-5)
        assert forces[-1] == pytest.approx(-level, rel=1e-3)
    lip = row(2, 12.0, 0.4, 2e-4)
    assert driven(lambda z, v: strut.friction(lip, z, v, 0.0), speeds, 1e-5)[-1] == pytest.approx(-12.0, rel=1e-3)
    assert driven(lambda z, v: strut.friction(lip, z, v, 0.0), -speeds, 1e-5)[-1] == pytest.approx(4.8, rel=1e-3)
    corner = row(4, 8.0, 1e-4)
    elastic = driven(lambda z, v: strut.friction(corner, z, v, 0.0), np.full(2, 0.05), 1e-3)
    assert elastic == pytest.approx([0.0, -4.0])
    sticky = row(5, 6.0, 5e-3, 0.0, 0.01, 20.0)
    assert strut.friction(sticky, 0.0, 0.5, 0.0)[0] == pytest.approx(-16.0)


def test_dahl_approaches_its_level_by_a_power() -> None:
    """dz/dx = (1 - z)^2/g from rest gives z = x/(x + g)."""
    law, dt = row(3, 10.0, 2.0, 3e-4), 1e-5
    forces = driven(lambda z, v: strut.friction(law, z, v, 0.0), np.full(3001, 0.02), dt)
    x = 0.02 * dt * 3000
    assert forces[-1] == pytest.approx(-10.0 * x / (x + 3e-4), rel=1e-2)


def test_iwan_sliders_slip_one_after_the_other_and_close_their_loop() -> None:
    law, x, dx = row(1, 20.0, 5e-3, -0.5), np.zeros(6), np.zeros(6)
    forces = []
    for travel in np.concatenate([np.full(600, 1e-5), np.full(1200, -1e-5), np.full(1200, 1e-5)]):
        forces.append(strut.hysteresis(law, x, dx, 0, 1, float(travel), 0.0))
        x[1:] += dx[1:]
    assert forces[599] == pytest.approx(-20.0, rel=0.01)
    assert forces[1799] == pytest.approx(20.0, rel=0.01)
    assert forces[2999] == pytest.approx(forces[599], rel=1e-3)
    stiff, soft = forces[0] - forces[50], forces[400] - forces[450]
    assert stiff > 3.0 * soft > 0.0


def test_dampers_and_stops_keep_their_one_side() -> None:
    assert strut.damping(row(2, 100.0, 0.1), 0.1) == pytest.approx(-10.0)
    assert strut.damping(row(2, 100.0, 0.1), -0.1) == pytest.approx(1.0)
    assert strut.damping(row(3, 100.0, 0.05, 0.1), 0.15) == pytest.approx(-6.0)
    assert strut.damping(row(1, 100.0, 0.5, 0.1), 0.4) == pytest.approx(-20.0, rel=1e-3)
    one_sided = row(2, 0.04, 2e4, 10.0)
    assert strut.stop(one_sided, 0.041, -1.0) == 0.0
    assert strut.stop(one_sided, 0.039, -0.1) == pytest.approx(40.0)
    assert strut.stop(one_sided, 0.039, 0.1) == pytest.approx(20.0)
    assert strut.stop(row(4, 0.04, 1e4, 1e5, 1e-3), 0.038, 0.0) == pytest.approx(120.0)
    assert strut.stop(row(3, 0.04, 5.0, 1e-3), 0.039, 0.0) == pytest.approx(5.0 * (np.e - 1.0))


def test_leaks_flow_as_their_equations_say() -> None:
    a, b, pressure, ambient = 3e-12, 2e-16, 3e5, 101325.0
    flow = gas.leak(row(1, a, b), pressure, ambient, 293.15, 1.4)
    assert flow / a + flow**2 / b == pytest.approx((pressure**2 - ambient**2) / 293.15)
    assert gas.leak(row(2, 1e-9, 2.8e5), 2.7e5, ambient, 293.15, 1.4) == 0.0
    assert gas.leak(row(2, 1e-9, 2.8e5), 2.9e5, ambient, 293.15, 1.4) == pytest.approx(1e-5)
    half, whole = (gas.leak(row(3, 1e-7, 2e5, 2.0), p, ambient, 293.15, 1.4) for p in (201325.0, 301325.0))
    assert whole / half == pytest.approx(4.0 * 301325.0 / 201325.0, rel=0.03)


def test_inlet_factors_are_one_where_they_should_be() -> None:
    assert gas.inlet_factor(row(1, 1.0, 0.3, 0.5283), 7e-7, 0.2) == 1.0
    assert gas.inlet_factor(row(1, 1.0, 0.3, 0.5283), 7e-7, 0.6) < 0.95
    assert gas.inlet_factor(row(2, 0.5, 7e-7), 7e-7, 0.4) == 1.0
    assert gas.inlet_factor(row(3, 7e-7, np.sqrt(2.0)), 7e-7, 0.4) == pytest.approx(1.0)


def test_followers_know_up_from_down_and_their_limit() -> None:
    assert ground.follow(row(1, 0.1, 0.01), 1.0, 0.0) == pytest.approx(10.0)
    assert ground.follow(row(1, 0.1, 0.01), -1.0, 0.0) == pytest.approx(-100.0)
    assert ground.follow(row(2, 1e-3, 5.0), 1.0, 0.0) == 5.0
    assert ground.follow(row(3, 10.0, 1.0), 400.0, 0.0) == pytest.approx(200.0, rel=1e-3)


def test_ports_delays_and_sensors() -> None:
    soft = row(1, 2e-7, 5e-8)
    assert ground.port(soft, 0.0) == 0.0
    assert ground.port(soft, 1e-6) == pytest.approx(8e-7, rel=0.01)
    assert 0.0 < ground.port(soft, 1e-7) < 1e-8
    assert ground.port(row(2, 3e-7, 0.2), 5e-7) == pytest.approx(2.6e-7)
    assert ground.late(row(1, 0.05), 0.12, 0.002) == pytest.approx(0.02)
    delays = [ground.late(row(2, 0.04, 0.05, 0.6, 1.0), 0.05 * k + 0.01, 0.002) for k in range(200)]
    assert 0.016 <= min(delays) < 0.02
    assert 0.06 < max(delays) <= 0.064
    assert ground.sensor_error(row(1, 1e-3, 0.03, 5e-3), 0.035, 0.0) == pytest.approx(1e-3)
    assert ground.sensor_error(row(2, 0.1, 2e5, 1.0), 1.5e5, 0.0) == 0.0
    assert ground.sensor_error(row(3, 2.0), 1.0, 3.0) == 6.0
    assert ground.sensor_error(row(5, 0.0, 0.0, 2e5), 2.1e5, 0.0) == pytest.approx(-1e4)


def test_lifting_tyres_push_only_and_agree_at_rest() -> None:
    for law in (row(1, 1.1), row(2, 0.3)):
        assert ground.lift(law, 1.0) == pytest.approx(1.0)
        assert 0.0 <= ground.lift(law, -3.0) < 0.02
