# SPDX-License-Identifier: Apache-2.0
"""What a driver of hardware made of the commands: openings as applied, stretches left out, messages that came late."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.rig_logs import RATE, noisy, simulated, topics_of_channels

from pneumo_ros.diagnosis.half_car.signals import Signals, TopicData, prepare
from pneumo_ros.diagnosis.half_car.signals.interruptions import LoggedEvent
from pneumo_ros.diagnosis.half_car.signals.prepare import APPLIED, DISPLACEMENT, ROAD, VALVE
from pneumo_ros.errors import InputError
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig

SECONDS, TRIP, ARMED_AGAIN = 8.0, 1.0, 1.5  # s
Topics = dict[str, TopicData]
EVENTS = (
    LoggedEvent(-0.1, 0, "daq", "armed"),
    LoggedEvent(TRIP, 2, "daq", "command_stale"),
    LoggedEvent(ARMED_AGAIN, 0, "daq", "armed"),
    LoggedEvent(5.0, 1, "controller", "reference_lost"),
)


@pytest.fixture(scope="module")
def tripped() -> Topics:
    """A rig whose valves were shut from the trip to the next arming; /valve/command says what was wanted."""
    _, road, wanted = simulated(SECONDS, 3)
    t = np.arange(len(wanted)) / RATE
    applied = np.where(((t >= TRIP) & (t < ARMED_AGAIN))[:, None], 0.0, wanted)
    car, trim = nominal_half_car(load_rig())
    states = car.simulate(trim.state, applied[:-1], road, 1.0 / RATE)
    rig = load_rig()
    ends = [states[:, 0] + rig.front_arm.value * states[:, 1], states[:, 0] - rig.rear_arm.value * states[:, 1]]
    clean = np.column_stack([*ends, states[:, 2], states[:, 3], states[:, 8], states[:, 9]])
    topics = topics_of_channels(noisy(clean, 3), road, wanted)
    names = topics[VALVE].channels
    sent = TopicData(t, dict(zip(names, applied.T, strict=True)), t + 1e-4)
    return {**topics, APPLIED: sent}


def codes(signals: Signals) -> list[str]:
    return [limit.code for limit in signals.limitations]


def said(signals: Signals, code: str) -> str:
    return next(limit.text for limit in signals.limitations if limit.code == code)


def test_the_openings_that_were_applied_drive_the_model(tripped: Topics) -> None:
    signals = prepare(tripped, load_rig(), events=EVENTS)
    assert np.array_equal(signals.commands[:, 0], tripped[APPLIED].channels["front_inlet"])
    assert len(signals.measured) == SECONDS * RATE and signals.confidence_cap == 1.0
    share = (ARMED_AGAIN - TRIP) / SECONDS
    assert f"in {share:.1%} of the log" in said(signals, "applied_differs")


def test_applied_as_commanded_is_worth_no_word(tripped: Topics) -> None:
    same = tripped[VALVE]
    assert codes(prepare({**tripped, APPLIED: same}, load_rig(), events=EVENTS[:1])) == codes(
        prepare({t: d for t, d in tripped.items() if t != APPLIED}, load_rig())
    )


def test_without_them_the_stretch_is_left_out_and_said(tripped: Topics) -> None:
    """From the trip to half a second after arming the command tells nothing; the rest of the log does."""
    without = {topic: data for topic, data in tripped.items() if topic != APPLIED}
    signals = prepare(without, load_rig(), events=EVENTS)
    assert signals.start == pytest.approx(ARMED_AGAIN + 0.5, abs=2.0 / RATE)
    assert "1.4 s are left out" in said(signals, "valves_safe") and signals.confidence_cap < 1.0
    assert "1 complaints" in said(signals, "commands_refused")


def test_a_busy_computer_is_told_where_the_stamps_leave_the_boards_pace(tripped: Topics) -> None:
    """A road that begins late, and a clock that was learnt late; a crystal that is merely fast is neither."""
    assert not {"road_late", "off_pace"} & set(codes(prepare(tripped, load_rig())))
    fast = {topic: data._replace(stamp=data.stamp * (1.0 + 2e-4)) for topic, data in tripped.items()}
    assert not {"road_late", "off_pace"} & set(codes(prepare(fast, load_rig())))
    road = tripped[ROAD]
    late = prepare({**tripped, ROAD: road._replace(stamp=road.stamp + 0.012)}, load_rig())
    assert "begins 12 ms after" in said(late, "road_late") and late.confidence_cap <= 0.5
    heights = tripped[DISPLACEMENT]
    learnt = heights._replace(stamp=heights.stamp + np.where(heights.stamp < 2.0, 0.0015, 0.0))
    off = prepare({**tripped, DISPLACEMENT: learnt}, load_rig())
    assert "even pace by up to 0.8 ms" in said(off, "off_pace") and off.confidence_cap <= 0.8
    # Another recorder's road need not begin with the rig.
    foreign = {topic: data for topic, data in tripped.items() if topic != APPLIED}
    assert "road_late" not in codes(prepare({**foreign, ROAD: road._replace(stamp=road.stamp + 0.012)}, load_rig()))


def test_openings_that_went_out_late_are_told(tripped: Topics) -> None:
    """One in fifty is sent five milliseconds late, as by a computer with other work; in shut valves it is nothing."""
    sent = tripped[APPLIED]
    late = np.where(np.arange(len(sent.stamp)) % 50 == 0, 0.005, 0.0)
    busy = prepare({**tripped, APPLIED: sent._replace(stamp=np.maximum.accumulate(sent.stamp + late))}, load_rig())
    assert "One opening in 100" in said(busy, "openings_uneven") and "not 2 ms" in said(busy, "openings_uneven")
    assert busy.confidence_cap <= 0.5
    even = {**sent.channels, "front_inlet": np.zeros(len(late))}
    shut = sent._replace(stamp=sent.stamp + late, channels={name: 0.0 * values for name, values in even.items()})
    assert "openings_uneven" not in codes(prepare({**tripped, APPLIED: shut}, load_rig()))


def test_events_of_other_nodes_cut_nothing(tripped: Topics) -> None:
    without = {topic: data for topic, data in tripped.items() if topic != APPLIED}
    told = prepare(without, load_rig(), events=[LoggedEvent(4.0, 2, "plant", "trip")])
    assert len(told.measured) == SECONDS * RATE


def test_messages_that_came_late_are_no_clock_that_was_set(tripped: Topics) -> None:
    """The network held one topic up by 0.2 s from the middle on: its stamps are as even as before."""
    data = tripped["/rig/rear/pressure"]
    late = data._replace(received=data.stamp + np.where(data.stamp > 0.5 * SECONDS, 0.2, 1e-4))
    signals = prepare({**tripped, "/rig/rear/pressure": late}, load_rig())
    assert "arrived 0.2 s later" in said(signals, "delayed") and len(signals.measured) == SECONDS * RATE
    moved = data._replace(stamp=data.stamp + np.where(data.stamp > 0.5 * SECONDS, 0.2, 0.0))
    with pytest.raises(InputError, match="was set while the log ran"):
        prepare({**tripped, "/rig/rear/pressure": moved._replace(received=data.received)}, load_rig())
