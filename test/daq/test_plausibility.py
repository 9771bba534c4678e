# SPDX-License-Identifier: Apache-2.0
"""Whether a sensor can be believed, reading by reading; thresholds of config/safety.yaml."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from pneumo_ros.daq.calibration import SENSORS
from pneumo_ros.daq.plausibility import BALANCE_EVERY, ForceBalance, PlausibilityMonitor, stuck_after
from pneumo_ros.daq.reasons import Finding, Reason
from pneumo_ros.daq.safety_config import load_safety
from pneumo_ros.daq.scaling import InputScale
from pneumo_ros.plant.air_spring import effective_area, load_surface
from pneumo_ros.plant.half_car import BUMP_STOP_HEIGHT
from pneumo_ros.rig import load_rig
from pneumo_ros.units import GRAVITY

CONFIG = load_safety().plausibility
RIG = load_rig()
SURFACE = load_surface()
PERIOD = 0.002  # s
# A count is 4 um or 50 Pa: the noise of 10 um and 150 Pa moves it.
SLOPES = (4e-6,) * 4 + (50.0,) * 3
SCALE = InputScale(tuple(range(7)), SLOPES, (0.0,) * 7, -(1 << 15), (1 << 15) - 1)
AMBIENT = RIG.ambient_pressure.value
HEIGHT = 0.0445  # m


def gauge(load: float, height: float = HEIGHT) -> float:
    """Pa over ambient at which a spring carries ``load``, N: by bisection on force = gauge x area."""
    low, high = 0.0, 8e5
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle * effective_area(height, middle, SURFACE) < load:
            low = middle
        else:
            high = middle
    return low


WEIGHT = RIG.sprung_mass.value * GRAVITY
LOADS = (WEIGHT * RIG.rear_arm.value / RIG.wheelbase, WEIGHT * RIG.front_arm.value / RIG.wheelbase)
PRESSURES = tuple(AMBIENT + gauge(load) for load in LOADS)
AT_REST = (0.06, 0.07, 0.06 - HEIGHT, 0.07 - HEIGHT, *PRESSURES, 6.9e5)


class Sensors:
    """Seven channels that a test moves; every reading differs from the one before by a count."""

    def __init__(self, **changed: float) -> None:
        self.monitor = PlausibilityMonitor(replace(CONFIG, **changed), SCALE, RIG, PERIOD, SURFACE)
        self.values = list(AT_REST)
        self.frozen: set[int] = set()
        self.last: list[int] = [0] * 7
        self.turn = 0

    def step(self, dt: float = PERIOD) -> tuple[tuple[bool, ...], list[Finding]]:
        self.turn += 1
        counts = [round(v / slope) + self.turn % 2 for v, slope in zip(self.values, SLOPES, strict=True)]
        for channel in self.frozen:
            counts[channel] = self.last[channel]
        self.last = counts
        return self.monitor.step(counts, SCALE.values(counts), dt)

    def until_found(self, limit: int = 100) -> tuple[int, Finding]:
        """Samples until the first finding, and it."""
        for number in range(1, limit + 1):
            _, found = self.step()
            if found:
                return number, found[0]
        raise AssertionError(f"nothing found in {limit} samples")


def test_a_run_of_equal_readings_is_as_rare_as_asked() -> None:
    """Noise of half a count about the middle of one repeats it with erf(1 / sqrt 2) = 0.6827."""
    run = stuck_after(0.5, 1.0, 1e-12)
    assert run == math.ceil(math.log(1e-12) / math.log(math.erf(math.sqrt(0.5)))) + 1 == 74
    assert math.erf(math.sqrt(0.5)) ** (run - 1) <= 1e-12 < math.erf(math.sqrt(0.5)) ** (run - 2)
    assert stuck_after(0.5, 1.0, 1e-3) == 20
    assert stuck_after(0.0, 1.0, 1e-12) == math.inf and stuck_after(0.01, 1.0, 1e-12) == math.inf


def test_readings_of_a_healthy_rig_are_believed() -> None:
    sensors = Sensors()
    for _ in range(3000):  # 6 s, the balance's window and twice more
        assert sensors.step() == ((True,) * 7, [])
    assert sensors.monitor.unwatched == [] and sensors.monitor.balance.ratios == pytest.approx([1.0, 1.0], rel=1e-3)


@pytest.mark.parametrize("channel", range(7))
@pytest.mark.parametrize("end", ["low", "high"])
def test_bad_readings_are_withheld_at_once_and_told_after_some(channel: int, end: str) -> None:
    sensors = Sensors(displacement_rate=1e9, pressure_rate=1e12)
    sensors.step()
    low, high = CONFIG.displacement_range if channel < 4 else CONFIG.pressure_range
    edge, beyond = (low, low - 3 * SLOPES[channel]) if end == "low" else (high, high + 3 * SLOPES[channel])
    sensors.values[channel] = edge + (SLOPES[channel] if end == "low" else -SLOPES[channel])
    assert sensors.step()[0] == (True,) * 7
    sensors.values[channel] = beyond
    for number in range(1, CONFIG.bad_samples + 1):
        valid, found = sensors.step()
        assert [good for good in valid if not good] == [False] and not valid[channel]
        assert bool(found) is (number == CONFIG.bad_samples)
    assert found[0].reason is Reason.SENSOR_RANGE and found[0].subject == SENSORS[channel]
    assert f"({sensors.last[channel]} counts)" in found[0].text
    assert sensors.step()[1] != []  # and as long as it lasts
    sensors.values[channel] = AT_REST[channel]
    assert sensors.step() == ((True,) * 7, [])
    sensors.values[channel] = beyond
    assert sensors.step()[1] == []  # the count of bad ones began anew


@pytest.mark.parametrize(("counts", "good"), [(-(1 << 15), False), (-(1 << 15) + 1, True), ((1 << 15) - 1, False)])
def test_a_reading_at_a_rail_is_none(counts: int, good: bool) -> None:
    scale = SCALE._replace(slopes=(1e-7,) * 7)
    config = replace(CONFIG, displacement_range=(-1.0, 1.0), pressure_range=(-1.0, 1.0), stuck_at_most=0.0)
    monitor = PlausibilityMonitor(config, scale, RIG, PERIOD, SURFACE)
    for number in range(CONFIG.bad_samples):
        turn = [number] * 7
        turn[5] = counts
        valid, found = monitor.step(turn, scale.values(turn), PERIOD)
        assert valid == (True,) * 5 + (good, True)
    assert [finding.reason for finding in found] == ([] if good else [Reason.SENSOR_RAIL])


@pytest.mark.parametrize(("channel", "rate"), [(0, 3.0), (3, 3.0), (4, 5e7), (6, 5e7)])
def test_a_jump_is_believed_once_its_rate_is_possible(channel: int, rate: float) -> None:
    assert rate == (CONFIG.displacement_rate if channel < 4 else CONFIG.pressure_rate)
    sensors = Sensors()
    sensors.step()
    sensors.values[channel] += 0.9 * rate * PERIOD
    assert sensors.step()[0][channel]
    sensors.values[channel] -= 1.9 * rate * PERIOD  # from the last one believed, within two periods
    assert not sensors.step()[0][channel]
    assert not sensors.step(0.0)[0][channel]
    assert sensors.step()[0][channel]
    sensors.values[channel] = AT_REST[channel]
    assert not sensors.step(0.1 * PERIOD)[0][channel]
    sensors.monitor.reset()
    assert sensors.step(0.1 * PERIOD)[0][channel]  # after a gap there is nothing to jump from


def test_a_frozen_channel_is_told_by_its_noise_and_others_are_not() -> None:
    sensors = Sensors()
    expected = stuck_after(RIG.displacement_noise.value, SLOPES[1], CONFIG.stuck_probability)
    assert (
        sensors.monitor.stuck_runs
        == [expected] * 4 + [stuck_after(RIG.pressure_noise.value, 50.0, CONFIG.stuck_probability)] * 3
    )
    sensors.step()
    sensors.frozen = {1}
    number, finding = sensors.until_found()
    assert (number, finding.reason, finding.subject) == (expected - 1, Reason.SENSOR_STUCK, SENSORS[1])
    assert sensors.step()[0] == (True, False) + (True,) * 5
    sensors.frozen = set()
    sensors.step()
    assert sensors.step()[0] == (True,) * 7
    sensors.frozen = {1}
    assert sensors.until_found()[0] == expected - 1
    sensors.monitor.reset()
    assert sensors.until_found()[0] == expected


def test_a_channel_whose_noise_hardly_moves_it_is_said_to_be_unwatched() -> None:
    monitor = PlausibilityMonitor(CONFIG, SCALE._replace(slopes=(-1e-4,) * 4 + (50.0,) * 3), RIG, PERIOD, SURFACE)
    assert monitor.unwatched == list(SENSORS[:4]) and monitor.stuck_runs[4] < 35e-3 / PERIOD
    slow = PlausibilityMonitor(CONFIG, SCALE, RIG, 2.2e-3, SURFACE)
    assert slow.unwatched == list(SENSORS[:4])  # 16 readings of 2.2 ms are more than 35 ms, 15 are not


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("share", [0.5, 0.68, 0.72, 1.28, 1.32, 1.5])
def test_pressure_and_height_must_carry_the_load(side: int, share: float) -> None:
    values = list(AT_REST)
    values[4 + side] = AMBIENT + gauge(share * LOADS[side])
    balance = ForceBalance(RIG, CONFIG.force_balance, CONFIG.force_balance_window, SURFACE)
    found: list[Finding] = []
    seconds = 0.0
    while not found and seconds < 20.0:
        found = balance.step(values, 0.04)
        seconds += 0.04
    assert bool(found) is (abs(share - 1.0) > CONFIG.force_balance)
    if found:
        name = ("front", "rear")[side]
        assert seconds >= 2.0 * CONFIG.force_balance_window - 1e-9
        assert [f.subject for f in found] == [f"{name}_spring"] and found[0].reason is Reason.SENSOR_DISAGREE
        assert f"{name} spring force is {balance.ratios[side]:.0%} of its load" == found[0].text
    assert balance.ratios[1 - side] == pytest.approx(1.0, abs=1e-6)


def test_the_mean_force_follows_over_the_window() -> None:
    values = list(AT_REST)
    values[4] = AMBIENT + gauge(0.8 * LOADS[0])
    balance = ForceBalance(RIG, 0.3, 1.0, SURFACE)
    balance.step(values, 0.25)
    assert balance.ratios == pytest.approx([1.0 - 0.2 * 0.25 / 1.25, 1.0])
    scaled = ForceBalance(
        replace(RIG, effective_area_scale=replace(RIG.effective_area_scale, value=1.1)), 0.3, 1.0, SURFACE
    )
    scaled.step(AT_REST, 1.0)
    assert scaled.ratios == pytest.approx([1.05, 1.05])


@pytest.mark.parametrize("window", [0.5, 1.0, 1.5])
def test_nothing_is_told_before_two_windows(window: float) -> None:
    values = list(AT_REST)
    values[4] = AMBIENT + gauge(0.4 * LOADS[0])
    balance = ForceBalance(RIG, 0.3, window, SURFACE)
    steps = next(n for n in range(1, 1000) if balance.step(values, 0.04))
    assert (steps - 1) * 0.04 < 2.0 * window <= steps * 0.04 + 1e-9
    balance.reset()
    assert steps == next(n for n in range(1, 1000) if balance.step(values, 0.04))


@pytest.mark.parametrize("deep", [0.0, 2e-3])
def test_a_spring_on_its_stop_is_not_judged(deep: float) -> None:
    values = list(AT_REST)
    values[5] = AMBIENT + gauge(0.4 * LOADS[1])
    balance = ForceBalance(RIG, 0.3, 1.0, SURFACE)
    while not balance.step(values, 0.04):
        pass
    pressed = [*values]
    pressed[2] = pressed[0] - BUMP_STOP_HEIGHT + deep
    assert balance.step(pressed, 0.04) == [] and balance.ratios == [1.0, 1.0]
    assert balance.step(values, 0.04) == []  # two windows from here on
    pressed[2] -= deep + 1e-6
    balance.step(pressed, 0.04)
    assert balance.ratios[1] < 1.0


def test_the_balance_is_looked_at_every_so_many_samples_if_all_can_be_believed() -> None:
    sensors = Sensors()
    sensors.values[4] = AMBIENT + gauge(1.2 * LOADS[0])
    for number in range(1, 2 * BALANCE_EVERY + 1):
        before = sensors.monitor.balance.ratios[0]
        sensors.step()
        assert (sensors.monitor.balance.ratios[0] != before) is (number % BALANCE_EVERY == 0)
    first = 1.0 + 0.2 * 0.04 / 1.04
    assert sensors.monitor.balance.ratios[0] == pytest.approx(first + (1.2 - first) * 0.04 / 1.04, rel=1e-3)
    sensors.values[6] = 0.0
    for _ in range(BALANCE_EVERY):
        before = sensors.monitor.balance.ratios[0]
        sensors.step()
        assert sensors.monitor.balance.ratios[0] == before
    sensors.monitor.reset()
    assert sensors.monitor.balance.ratios == [1.0, 1.0]
