# SPDX-License-Identifier: Apache-2.0
"""Bringing a log onto one time base, and what is said about logs that are not what they should be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.practice import OTHER_WRITER
from helpers.rig_logs import DISPLACEMENT_NOISE, PRESSURE_NOISE, RATE, simulated, topics, write_log
from helpers.topic_tables import DISPLACEMENT, FRONT, REAR, ROAD, VALVE, Topics, codes, rows, with_channel

from pneumo_ros.diagnosis.half_car.signals import MEASURED, TopicData, prepare, read_signals
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig


@pytest.fixture(scope="module")
def clean() -> Topics:
    return topics()


def test_a_clean_log_passes_unchanged(clean: Topics) -> None:
    signals = prepare(clean, load_rig())
    assert signals.limitations == () and signals.confidence_cap == 1.0
    assert signals.period == pytest.approx(1.0 / RATE) and signals.weight.all()
    for column, name in enumerate(MEASURED[:4]):
        assert np.array_equal(signals.measured[:, column], clean[DISPLACEMENT].channels[name])
    np.testing.assert_allclose(signals.road[:, 0], clean[ROAD].channels["front"], atol=1e-12)
    assert np.array_equal(signals.commands[:, 1], clean[VALVE].channels["rear_inlet"])


def test_noise_is_estimated_from_the_data(clean: Topics) -> None:
    expected = [DISPLACEMENT_NOISE] * 4 + [PRESSURE_NOISE] * 2
    np.testing.assert_allclose(prepare(clean, load_rig()).noise, expected, rtol=0.1)


def test_noise_that_differs_from_the_config_is_said(clean: Topics) -> None:
    rig = load_rig().with_values(pressure_noise=10.0)
    found = [limit for limit in prepare(clean, rig).limitations if limit.code == "noise_differs"]
    assert {limit.channels for limit in found} == {("front_pressure",), ("rear_pressure",)}


def test_initial_state_is_within_its_own_uncertainty(clean: Topics) -> None:
    signals = prepare(clean, load_rig())
    truth = trim(load_rig()).state
    off = np.abs(signals.initial - truth) / signals.initial_std
    assert np.all(off < 4.0) and np.any(off > 0.05)
    assert np.all(signals.initial_std[4:8] < 4e-3)


def test_slice_estimates_its_own_initial_state(clean: Topics) -> None:
    whole = prepare(clean, load_rig())
    part = whole.slice(1500, 3500)
    assert len(part.measured) == 2000 and part.start == pytest.approx(3.0)
    assert part.initial[8] == pytest.approx(whole.measured[1500, 4], abs=5 * PRESSURE_NOISE)
    assert not np.allclose(part.initial[4:8], 0.0, atol=5e-3)


def test_topics_of_different_rates_and_starts_meet_on_one_base(clean: Topics) -> None:
    """Pressure at 100 Hz from 0.3 s, command at 250 Hz, road at 200 Hz: real samples keep their weight and value."""
    mixed = dict(clean)
    mixed[FRONT] = rows(clean[FRONT], np.arange(150, 4000, 5))
    mixed[VALVE] = rows(clean[VALVE], np.arange(0, 4000, 2))
    mixed[ROAD] = rows(clean[ROAD], np.arange(0, 3996, 5))
    signals = prepare(mixed, load_rig())
    column = MEASURED.index("front_pressure")
    assert signals.weight[:, column].sum() == pytest.approx(len(mixed[FRONT].stamp), abs=2)
    assert signals.weight[:150, column].sum() == 0
    real = signals.weight[:, column] > 0
    assert np.allclose(signals.measured[real, column], clean[FRONT].channels["pressure"][: len(real)][real], atol=1e-6)
    rates = {timing.topic: timing.rate for timing in signals.topics}
    assert rates[FRONT] == pytest.approx(100.0) and rates[DISPLACEMENT] == pytest.approx(500.0)


def test_held_command_delivers_the_air_that_was_commanded() -> None:
    """A command at 70 Hz, off the grid: the integral over the log stays what was commanded."""
    base = topics(4.0)
    stamp = 0.003 + np.arange(275) / 70.0
    opening = 1e-6 * (1.0 + 0.5 * np.sin(7.0 * stamp))
    channels = dict.fromkeys(base[VALVE].channels, opening)
    signals = prepare({**base, VALVE: TopicData(stamp, channels)}, load_rig())
    first = signals.start
    last = first + len(signals.commands) * signals.period
    edges = np.clip(np.append(stamp, last), first, last)
    commanded = float(np.sum(opening * np.diff(edges)))
    assert signals.commands[:, 0].sum() * signals.period == pytest.approx(commanded, rel=2e-3)


def test_jitter_does_not_distort_the_signal() -> None:
    clean, _, _ = simulated(4.0)
    base = topics(4.0)
    rng = np.random.default_rng(5)
    jittered = base[DISPLACEMENT].stamp + rng.uniform(-4e-4, 4e-4, len(clean))
    smooth = {name: np.interp(jittered, base[DISPLACEMENT].stamp, clean[:, i]) for i, name in enumerate(MEASURED[:4])}
    signals = prepare({**base, DISPLACEMENT: TopicData(jittered, smooth)}, load_rig())
    on_base = np.interp(signals.time + signals.start, base[DISPLACEMENT].stamp, clean[:, 2])
    assert np.abs(signals.measured[:, 2] - on_base)[5:-5].max() < 0.01 * clean[:, 2].std()
    timing = next(t for t in signals.topics if t.topic == DISPLACEMENT)
    assert 1e-4 < timing.jitter < 1e-3


def test_missing_samples_are_counted_and_carry_no_weight(clean: Topics) -> None:
    keep = np.ones(4000, dtype=bool)
    keep[1000:1040] = False
    signals = prepare({**clean, REAR: rows(clean[REAR], np.flatnonzero(keep))}, load_rig())
    column = MEASURED.index("rear_pressure")
    assert signals.weight[1000:1040, column].sum() == 0 and signals.weight[:, column].sum() == 3960
    timing = next(t for t in signals.topics if t.topic == REAR)
    assert timing.missing == 40 and timing.longest_gap == pytest.approx(41 / RATE)


def test_names_decide_not_positions(clean: Topics) -> None:
    turned = dict(reversed(list(clean[DISPLACEMENT].channels.items())))
    signals = prepare({**clean, DISPLACEMENT: clean[DISPLACEMENT]._replace(channels=turned)}, load_rig())
    assert np.array_equal(signals.measured, prepare(clean, load_rig()).measured)


@pytest.mark.parametrize("channel", MEASURED)
def test_a_missing_channel_is_a_limitation(clean: Topics, channel: str) -> None:
    if channel.endswith("pressure"):
        lacking = {t: d for t, d in clean.items() if t != f"/rig/{channel.removesuffix('_pressure')}/pressure"}
    else:
        rest = {k: v for k, v in clean[DISPLACEMENT].channels.items() if k != channel}
        lacking = {**clean, DISPLACEMENT: clean[DISPLACEMENT]._replace(channels=rest)}
    signals = prepare(lacking, load_rig())
    [limit] = signals.limitations
    assert limit.code == "missing_channel" and limit.channels == (channel,) and limit.cap < 0.9
    assert not signals.usable[MEASURED.index(channel)] and np.all(np.isfinite(signals.initial))


def test_too_few_channels_forbid_a_verdict(clean: Topics) -> None:
    signals = prepare({t: d for t, d in clean.items() if t != DISPLACEMENT}, load_rig())
    assert signals.blocked and "too_few_channels" in codes(signals)


def test_nan_is_bridged_and_said(clean: Topics) -> None:
    values = clean[DISPLACEMENT].channels["sprung_rear"].copy()
    values[100:110] = np.nan
    signals = prepare({**clean, DISPLACEMENT: with_channel(clean[DISPLACEMENT], "sprung_rear", values)}, load_rig())
    assert "nan" in codes(signals) and np.all(np.isfinite(signals.measured))
    assert signals.weight[100:110, 1].sum() == 0 and signals.weight[:, 1].sum() == 3990


def test_a_constant_channel_is_left_out(clean: Topics) -> None:
    flat = np.full(4000, 0.02)
    signals = prepare({**clean, DISPLACEMENT: with_channel(clean[DISPLACEMENT], "sprung_front", flat)}, load_rig())
    assert "constant" in codes(signals) and not signals.usable[0] and signals.confidence_cap < 1.0


def test_a_saturated_channel_loses_its_flat_samples(clean: Topics) -> None:
    values = clean[DISPLACEMENT].channels["unsprung_front"]
    top = np.quantile(values, 0.8)
    clipped = with_channel(clean[DISPLACEMENT], "unsprung_front", np.minimum(values, top))
    signals = prepare({**clean, DISPLACEMENT: clipped}, load_rig())
    assert "saturated" in codes(signals) and signals.confidence_cap <= 0.8
    assert signals.weight[:, 2].mean() == pytest.approx(0.8, abs=0.05)


def test_quantised_data_are_not_called_saturated(clean: Topics) -> None:
    step = 1e-4
    values = np.round(clean[DISPLACEMENT].channels["unsprung_front"] / step) * step
    coarse = with_channel(clean[DISPLACEMENT], "unsprung_front", values)
    signals = prepare({**clean, DISPLACEMENT: coarse}, load_rig())
    assert not codes(signals) & {"saturated", "frozen", "constant"}
    assert signals.noise[2] >= 0.9 * step / np.sqrt(12.0)


def test_a_frozen_stretch_is_masked(clean: Topics) -> None:
    values = clean[FRONT].channels["pressure"].copy()
    values[2000:2300] = values[2000]
    signals = prepare({**clean, FRONT: with_channel(clean[FRONT], "pressure", values)}, load_rig())
    assert "frozen" in codes(signals) and signals.weight[2000:2300, 4].sum() == 0


def test_glitches_are_masked(clean: Topics) -> None:
    values = clean[REAR].channels["pressure"].copy()
    values[[500, 1500, 2500]] += 5e4
    signals = prepare({**clean, REAR: with_channel(clean[REAR], "pressure", values)}, load_rig())
    assert "glitches" in codes(signals) and np.all(signals.weight[[500, 1500, 2500], 5] == 0)


def test_a_clock_set_back_leaves_the_longest_piece(clean: Topics) -> None:
    late = {
        topic: data._replace(stamp=np.where(np.arange(4000) < 1000, data.stamp, data.stamp - 1.5))
        for topic, data in clean.items()
    }
    signals = prepare(late, load_rig())
    assert "clock_jump" in codes(signals) and len(signals.measured) == 3000
    assert np.array_equal(signals.measured[:, 0], clean[DISPLACEMENT].channels["sprung_front"][1000:])


def test_out_of_order_and_repeated_samples_are_sorted(clean: Topics) -> None:
    order = np.arange(4000)
    order[[700, 701]] = [701, 700]
    stamp = clean[FRONT].stamp[order].copy()
    stamp[900] = stamp[899]
    shuffled = rows(clean[FRONT], order)._replace(stamp=stamp)
    signals = prepare({**clean, FRONT: shuffled}, load_rig())
    assert "out_of_order" in codes(signals)
    assert signals.measured[700, 4] == clean[FRONT].channels["pressure"][700]


def test_a_pause_in_the_command_cuts_the_log(clean: Topics) -> None:
    keep = np.r_[0:800, 1200:4000]
    signals = prepare({**clean, VALVE: rows(clean[VALVE], keep)}, load_rig())
    assert "cut" in codes(signals) and signals.start == pytest.approx(1200 / RATE)


def test_a_short_log_is_a_limitation() -> None:
    assert "short" in codes(prepare(topics(3.0), load_rig()))


def test_nothing_moving_forbids_a_verdict() -> None:
    at_rest = topics(4.0)
    rng = np.random.default_rng(0)
    state = trim(load_rig()).state
    still = {}
    for i, name in enumerate(MEASURED[:4]):
        still[name] = at_rest[DISPLACEMENT].channels[name][0] + rng.normal(size=2000) * (1 + 0 * i) * DISPLACEMENT_NOISE
    quiet = {
        **at_rest,
        DISPLACEMENT: at_rest[DISPLACEMENT]._replace(channels=still),
        FRONT: with_channel(at_rest[FRONT], "pressure", state[8] + rng.normal(size=2000) * PRESSURE_NOISE),
        REAR: with_channel(at_rest[REAR], "pressure", state[9] + rng.normal(size=2000) * PRESSURE_NOISE),
    }
    signals = prepare(quiet, load_rig())
    assert signals.blocked and "no_motion" in codes(signals)


def test_a_recorder_that_stalls_is_no_jump_of_a_clock(clean: Topics) -> None:
    late = {k: v._replace(received=v.stamp + np.where(v.stamp > 4.0, 0.4, 0.0)) for k, v in clean.items()}
    assert codes(prepare(late, load_rig())) == codes(prepare(clean, load_rig()))


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_a_channel_that_mostly_stands_does_not_excuse_itself(clean: Topics, share: float) -> None:
    values = clean[FRONT].channels["pressure"]
    values = np.where(np.arange(4000) < share * 4000, np.median(values), values)
    signals = prepare({**clean, FRONT: with_channel(clean[FRONT], "pressure", values)}, load_rig())
    assert "frozen" in codes(signals) and signals.usable[4] == (share < 0.5)
    assert signals.noise[4] == pytest.approx(PRESSURE_NOISE, rel=0.15)


def test_a_log_of_another_writer_is_read() -> None:
    signals = read_signals(OTHER_WRITER)
    assert signals.measured.shape == (1101, 6)
    assert signals.rig.name == "half-car-2m2a" and signals.period == 0.002


def test_a_written_log_reads_as_it_was_made(tmp_path: Path) -> None:
    clean, road, commands = simulated(3.0)
    signals = read_signals(write_log(tmp_path / "one.mcap", clean, road, commands, [load_rig().to_yaml()]))
    np.testing.assert_array_equal(signals.measured, clean)
    np.testing.assert_allclose(signals.commands, commands, rtol=1e-12)
    assert signals.start == pytest.approx(1e9) and signals.rig == load_rig()


def test_the_tips_of_a_chattering_pressure_are_no_glitches(clean: Topics) -> None:
    """A valve that is opened and closed every other sample, for a while: as our own closed loop logs it."""
    values = clean[REAR].channels["pressure"].copy()
    rng = np.random.default_rng(5)
    tips = rng.exponential(1500.0, 3000) * (rng.random(3000) < 0.1)
    values[500:3500] += tips * np.resize((1.0, -1.0), 3000)
    signals = prepare({**clean, REAR: with_channel(clean[REAR], "pressure", values)}, load_rig())
    assert "glitches" not in codes(signals) and signals.weight[:, 5].all()
