# SPDX-License-Identifier: Apache-2.0
"""What may ring where no family has a place: a part of the body takes its momentum from it, ground gives way."""

from __future__ import annotations

import math

import numpy as np
import pytest
from helpers.rig_logs import signals_of, simulated

from pneumo_ros.effects.curves import SWEPT, ringing
from pneumo_ros.effects.hooks import Air, Strut, Tyre, air_of
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.effects.shapes import outside
from pneumo_ros.effects.shapes.families import anything_at
from pneumo_ros.rig import load_rig
from pneumo_ros.rig.channels import CHANNELS
from pneumo_ros.units import GAS_CONSTANT, GRAVITY

STEP = 1e-4  # s
STIFFNESS, LOAD = 2e4, 290.0  # N/m, N


def strut_at(top: float, rate: float) -> Strut:
    """A strut whose axle stands still at the ground."""
    return Strut(top, rate, 2e5, 5e-3, 1e3, 0.5 * top, 0.5 * rate)


def tyre_on(road: float, axle: float) -> Tyre:
    squeeze = road - axle
    return Tyre(squeeze, 0.0, STIFFNESS * squeeze, axle, 0.0, LOAD / STIFFNESS, LOAD, road, 0.0)


@pytest.mark.parametrize("ahead", [0.5, 1.2])
def test_the_body_feels_the_momentum_that_the_part_loses_where_it_hangs(ahead: float) -> None:
    p = (3.0, 6.0, 0.1, ahead, 0.0, 0.0)
    shaken = 2.0 * math.pi * 4.0  # rad/s
    impulse = np.zeros(2)
    z = outside.start_swing(strut_at(0.3, 0.01 * shaken), strut_at(0.3, 0.0), p)
    before = z[1]
    for i in range(4700):
        front = strut_at(0.3 + 0.01 * math.sin(shaken * i * STEP), 0.01 * shaken * math.cos(shaken * i * STEP))
        later = outside.swing(z, front, strut_at(0.3, 0.0), STEP, p)
        middle = (0.5 * (z[0] + later[0]), 0.5 * (z[1] + later[1]))  # half a step apart
        impulse += np.array(outside.on_body(front, strut_at(0.3, 0.0), middle, p)) * STEP
        z = later
    assert abs(z[1] - before) > 0.01  # or nothing was asked
    assert impulse.sum() == pytest.approx(-p[0] * (z[1] - before), rel=0.02)
    assert impulse[0] == pytest.approx(ahead * impulse.sum())


def test_a_part_that_is_held_firmly_is_a_part_of_the_body() -> None:
    log, model = signals_of(*simulated(seconds=4.0)), RigModel(load_rig())
    body = model.plant().body
    mass, at_centre = 2.0, body.rear_arm / (body.front_arm + body.rear_arm)
    held = Active("anything.body", "", (mass, 40.0, 0.9, at_centre, mass * GRAVITY, mass))
    loose = Active("anything.body", "", (mass, 3.0, 0.1, at_centre, mass * GRAVITY, mass))
    rigid, firm, swinging = (model.simulate(log, active=active) for active in ((), (held,), (loose,)))
    moved = np.abs(rigid - rigid[0]).max(axis=0)
    assert np.all(np.abs(firm - rigid).max(axis=0) < 0.03 * moved)
    assert np.all(np.abs(swinging - rigid).max(axis=0)[:2] > 0.05 * moved[:2])


def test_ground_gives_way_to_a_lasting_force_and_follows_a_slow_road() -> None:
    p = (0.05, 8.0, 0.3, 300.0)
    pressed, still = tyre_on(0.02, 0.0), tyre_on(LOAD / STIFFNESS, 0.0)
    z = outside.start_shaken(still, still, p)
    assert outside.on_axles(still, still, z, p) == (0.0, 0.0)
    for _ in range(20000):
        z = outside.shake(z, pressed, still, STEP, p)
    lost = p[0] * (STIFFNESS * 0.02 - LOAD)
    assert outside.on_axles(pressed, still, z, p) == pytest.approx((-lost, -lost), rel=1e-3)


def test_what_holds_the_body_pulls_it_back_to_where_it_began() -> None:
    p = (400.0, 100.0, 7.0, 1.0, 0.002)
    z = outside.start_held(strut_at(0.3, 0.0), strut_at(0.3, 0.0), p)
    assert outside.hold(strut_at(0.302, 0.0), strut_at(0.3, 0.0), z, p) == pytest.approx((0.0, 0.0))
    assert outside.hold(strut_at(0.312, 0.1), strut_at(0.3, 0.0), z, p) == pytest.approx((-4.0 - 0.7, 0.0))
    assert outside.hold(strut_at(0.292, 0.0), strut_at(0.3, 0.0), z, p) == pytest.approx((1.0, 0.0))


def test_a_bar_works_against_a_difference_of_heights_and_stores_what_it_takes() -> None:
    log, model = signals_of(*simulated(seconds=3.0)), RigModel(load_rig())
    p = (500.0, 0.0)
    z = outside.start_tied(strut_at(0.3, 0.0), strut_at(0.29, 0.0), p)
    assert outside.tie(strut_at(0.31, 0.0), strut_at(0.30, 0.0), z, p) == pytest.approx((0.0, 0.0))
    assert outside.tie(strut_at(0.31, 0.0), strut_at(0.29, 0.0), z, p) == pytest.approx((-5.0, 5.0))
    free, tied = (model.simulate(log, active=active) for active in ((), (Active("anything.bar", "", (1e5, 500.0)),)))
    heights = [[CHANNELS.index(f"{part}_{end}") for part in ("sprung", "unsprung")] for end in ("front", "rear")]
    moved = []
    for run in (free, tied):
        front, rear = (run[:, top] - run[:, axle] for top, axle in heights)
        moved.append(np.std(front - rear))
    assert moved[1] < 0.2 * moved[0], "a stiff bar keeps the struts alike"


def air_at(model: RigModel, pressure: float) -> Air:
    gas = model.plant(None, ()).front
    return air_of(pressure, 0.05, 0.0, 0.0, 0.0, gas.supply_pressure, gas.supply_power, gas)


# Over what a hole of the same size lets out, choked: ISO 6358 at 0.65 of the pressure; (P1^2 - P2^2) / (2 P1 3 bar)
@pytest.mark.parametrize("values, share", [((2e-7, 0.0), 0.97), ((0.0, 2e-7), 0.41)], ids=["hole", "gap"])
def test_what_one_spring_loses_through_a_pipe_the_other_gains(values: tuple[float, float], share: float) -> None:
    model = RigModel(load_rig())
    high, low = air_at(model, 4.3e5), air_at(model, 2.8e5)
    flows = []
    for front, rear in ((high, low), (low, high), (low, low)):
        rates = outside.exchange(front, rear, (), values)
        mass = [rate * air.volume / (air.exponent * GAS_CONSTANT * air.temperature)
                for rate, air in zip(rates, (front, rear), strict=True)]  # fmt: skip
        assert sum(mass) == pytest.approx(0.0, abs=1e-15)
        flows.append(mass[1])
    assert flows[0] > 0.0 and flows[1] == pytest.approx(-flows[0]) and flows[2] == 0.0
    assert flows[0] / (2e-7 * high.escape) == pytest.approx(share, rel=0.02)


def test_springs_that_share_their_air_come_to_one_pressure() -> None:
    log, model = signals_of(*simulated(seconds=3.0)), RigModel(load_rig())
    runs = [model.simulate(log, active=a) for a in ((), (Active("anything.pipe", "", (2e-5, 0.0)),))]
    front, rear = (CHANNELS.index(f"{end}_pressure") for end in ("front", "rear"))
    apart = [abs(float(np.mean(run[-50:, front] - run[-50:, rear]))) for run in runs]
    assert apart[1] < 0.2 * apart[0]
    own = [Active("anything.pipe", "", (2e-7, 0.0))]
    found = model.curve(log, np.array([p.nominal for p in model.parameters]), own, own, np.zeros((2, 2)))
    assert found is not None and np.all(found.points[:, 0] * found.points[:, 1] < 0.0), "air goes to the lower pressure"


@pytest.mark.parametrize("place", ["body_heave", "body_pitch", "road_input"])
def test_every_place_of_the_whole_rig_has_a_ceiling(place: str) -> None:
    found = anything_at(place)
    assert found and all(site == "" for _, site in found)
    assert all(place in outside_effect.places for outside_effect in outside.EFFECTS if (outside_effect.id, "") in found)


def test_the_curve_of_ground_is_the_answer_that_its_states_give() -> None:
    giving, frequency, damping_ratio, shaking = 0.05, 8.0, 0.2, 3000.0
    p, shaken = (giving, frequency, damping_ratio, shaking), 2.0 * math.pi * SWEPT[120]
    z = outside.start_shaken(tyre_on(0.0, 0.0), tyre_on(0.0, 0.0), p)
    moved = []
    for i in range(round(4.0 / STEP)):
        road, slope = 0.01 * math.sin(shaken * i * STEP), 0.01 * shaken * math.cos(shaken * i * STEP)
        held = Tyre(
            road, slope, STIFFNESS * road + LOAD, 0.0, 0.0, LOAD / STIFFNESS, LOAD, road, slope
        )  # at rest on a road at zero
        z = outside.shake(z, held, held, STEP, p)
        moved.append(-outside.on_axles(held, held, z, p)[0] / STIFFNESS)
    late = np.array(moved[len(moved) // 2 :])
    answer = ringing(Active("anything.ground", "", p), STIFFNESS)[120]
    assert np.abs(late).max() / 0.01 == pytest.approx(answer, rel=0.01)


@pytest.mark.parametrize(
    "part, stiffness",
    [
        (Active("anything.bar", "", (800.0, 0.0)), 800.0),
        (Active("anything.held", "", (500.0, 500.0, 0.0, 0.5, 0.0)), 500.0),
    ],
)
def test_the_curve_of_a_tie_is_its_stiffness(part: Active, stiffness: float) -> None:
    log, model = signals_of(*simulated(seconds=3.0)), RigModel(load_rig())
    nominal = np.array([p.nominal for p in model.parameters])
    found = model.curve(log, nominal, [part], [part], np.zeros((len(part.values), len(part.values))))
    assert found is not None and (found.x.unit, found.y.unit) == ("m", "N")
    x, y = np.asarray(found.points).T[:2]
    assert np.ptp(x) > 1e-3 and np.allclose(y, -stiffness * x, atol=1e-6)
