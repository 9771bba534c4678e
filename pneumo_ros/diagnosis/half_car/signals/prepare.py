# SPDX-License-Identifier: Apache-2.0
"""From the topics of a log to :class:`Signals`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.signals.doubts import check_clocks, check_gauge, check_pace, check_road_unit
from pneumo_ros.diagnosis.half_car.signals.health import all_limits, check_channel, missing
from pneumo_ros.diagnosis.half_car.signals.initial import estimate_initial
from pneumo_ros.diagnosis.half_car.signals.interruptions import LoggedEvent, as_applied, as_commanded, stretches_unknown
from pneumo_ros.diagnosis.half_car.signals.types import COMMANDS, MEASURED, ROADS, Signals
from pneumo_ros.diagnosis.signals.timebase import (
    drivable_span,
    held,
    in_order,
    sampled,
    split_at_jumps,
    timing,
    uniform_grid,
)
from pneumo_ros.diagnosis.signals.types import Limitation, TopicData
from pneumo_ros.errors import InputError
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import Rig

ROAD: Final = "/road/profile"  # topic of the contract [definition]
VALVE: Final = "/valve/command"  # topic of the contract [definition]
DISPLACEMENT: Final = "/rig/displacement"  # topic of the contract [definition]
APPLIED: Final = "/valve/applied"  # topic of what hardware made of the command [definition]
# Topics of the contract [definition]
PRESSURE: Final = {"front_pressure": "/rig/front/pressure", "rear_pressure": "/rig/rear/pressure"}
# topic of each measured channel [definition]
TOPIC_OF: Final = {name: PRESSURE.get(name, DISPLACEMENT) for name in MEASURED}
# Columns of COMMANDS that fill and empty it [definition]
VALVES_OF: Final = {"front_pressure": [0, 2], "rear_pressure": [1, 3]}
MIN_DURATION: Final = 2.0  # s: about four periods of the body [physics]
SHORT_DURATION: Final = 6.0  # s, below which intervals are wide, and that is said [taste]
SLOWEST: Final = 0.05  # s between samples of the fastest measured topic [physics]
SLOW: Final = 0.02  # s between samples above which there are fewer than 5 in a period of wheel hop [physics]


def prepare(
    topics: Mapping[str, TopicData],
    rig: Rig,
    name: str = "log",
    origin: float = 0.0,
    events: Sequence[LoggedEvent] = (),
) -> Signals:
    """Bring the topics of one log onto one uniform time base.

    Parameters
    ----------
    topics : topic -> samples, with the contract's topic and channel names; a pressure topic's channel is ``pressure``
    rig : the rig the log was made on
    name : of the log, for messages
    origin : s since the epoch that the stamps count from (float64 stamps since the epoch are coarse to 0.2 us)
    events : of the log; they tell where hardware held the valves safe, if the openings were not logged

    The openings that were applied (``/valve/applied``) take the command's place where they are logged. The base has the
    rate of the fastest measured topic and starts at that topic's first sample.

    Raises
    ------
    InputError
        if the log cannot drive the model: road or inlet commands missing, no measured channel, clocks that disagree,
        a wrong unit, or less than ``MIN_DURATION`` of usable time.
    """
    limits: list[Limitation] = []
    clean = _one_clock(topics, name, limits)
    grid, period = _grid(clean, name, limits, events)
    if APPLIED in clean and DISPLACEMENT in clean:
        limits += check_pace(clean[ROAD], clean[DISPLACEMENT], clean[APPLIED], name)
    commands, road = _inputs(clean, grid, period, rig, name, limits)
    check_road_unit(road, name)
    measured, weight, noise, stated = _measured(clean, grid, commands, rig, name, limits)
    check_gauge(*_middles(measured, weight), rig, name)
    limits += all_limits(weight, measured, noise)
    return Signals(
        name=name,
        rig=rig,
        start=origin + float(grid[0]),
        period=period,
        measured=measured,
        weight=weight,
        commands=commands,
        road=road,
        noise=noise,
        noise_stated=stated,
        start_state=estimate_initial(measured, weight, noise, period, rig),
        topics=tuple(timing(topic, data, float(grid[0])) for topic, data in sorted(clean.items())),
        limitations=tuple(limits),
    )


def _one_clock(topics: Mapping[str, TopicData], name: str, limits: list[Limitation]) -> dict[str, TopicData]:
    """Every topic in order of time, on the longest piece between places where the clock was set back."""
    full = {topic: data for topic, data in topics.items() if len(data.stamp) >= 2}
    for topic, data in full.items():
        if not np.all(np.isfinite(data.stamp)) or np.ptp(data.stamp) == 0.0:
            raise InputError(
                "stamps are not set", where=f"{name}, {topic}", value=float(data.stamp[0]),
                remedy="record with header.stamp = the sample's time",
            )  # fmt: skip
    pieces = {topic: split_at_jumps(data) for topic, data in full.items()}
    counts = {len(p) for p in pieces.values()}
    if len(counts) > 1:
        jumped = ", ".join(topic for topic, p in pieces.items() if len(p) > 1)
        raise InputError(
            "the clock was set back in some topics only, so the topics share no time base",
            where=f"{name}, {jumped}", remedy="cut the log before the jump, or record it again",
        )  # fmt: skip
    if counts and counts != {1}:
        best = _longest(pieces)
        pieces = {topic: [p[best]] for topic, p in pieces.items()}
        text = "The clock was set back during the log; only the longest piece between jumps is used."
        limits.append(Limitation("clock_jump", text, (), 0.9))
    limits += check_clocks({topic: p[0] for topic, p in pieces.items()}, name)
    ordered = {topic: in_order(p[0]) for topic, p in pieces.items()}
    for topic, (_, reordered, repeated) in ordered.items():
        if reordered or repeated:
            text = f"{topic}: {reordered} samples were out of order and {repeated} stamps repeated; sorted, first kept."
            limits.append(Limitation("out_of_order", text))
    return {topic: entry.data for topic, entry in ordered.items() if len(entry.data.stamp) >= 2}


def _longest(pieces: Mapping[str, list[TopicData]]) -> int:
    spans = np.array([[np.ptp(piece.stamp) for piece in p] for p in pieces.values()])
    return int(np.argmax(spans.min(axis=0)))


def _grid(
    topics: Mapping[str, TopicData], name: str, limits: list[Limitation], events: Sequence[LoggedEvent]
) -> tuple[Array, float]:
    needed = _required(topics, name)
    measured = {t: topics[t] for t in (DISPLACEMENT, *PRESSURE.values()) if t in topics}
    if not measured:
        raise InputError(
            "nothing was measured", where=name, allowed=", ".join((DISPLACEMENT, *PRESSURE.values())),
            remedy="record the sensors' topics",
        )  # fmt: skip
    periods = {topic: float(np.median(np.diff(data.stamp))) for topic, data in measured.items()}
    fastest = min(periods, key=lambda topic: periods[topic])
    safe = [] if APPLIED in topics else stretches_unknown(events, float(needed[1].stamp[-1]))
    start, end = drivable_span([data.stamp for data in needed], name, safe)
    if APPLIED not in topics:
        inside = [(max(a, needed[0].stamp[0]), min(b, needed[0].stamp[-1])) for a, b in safe]
        limits += as_commanded(events, float(sum(max(b - a, 0.0) for a, b in inside)))
    base = measured[fastest].stamp
    whole = max(end, base[-1]) - min(start, base[0])
    start, end = max(start, base[0]), min(end, base[-1])
    if end - start < MIN_DURATION:
        raise InputError(
            "too short to tell anything", where=name, value=f"{max(end - start, 0.0):.3g} s",
            allowed=f"at least {MIN_DURATION:g} s with road, command and sensors together", remedy="record longer",
        )  # fmt: skip
    period = _nice(periods[fastest])
    _judge_span(end - start, whole, period, name, limits)
    first = base[np.searchsorted(base, start - 1e-6)]
    return uniform_grid(float(first), end, period), period


def _nice(period: float) -> float:
    """The period without the rounding of stamps: whole microseconds where that changes nothing."""
    rounded = round(period, 6)
    return rounded if abs(rounded - period) < 2e-7 else period


def _judge_span(used: float, whole: float, period: float, name: str, limits: list[Limitation]) -> None:
    if period > SLOWEST:
        raise InputError(
            "sampled too slowly", where=name, value=f"{1.0 / period:.3g} Hz",
            allowed=f"at least {1.0 / SLOWEST:g} Hz", remedy="record faster: wheel hop is at 9 Hz",
        )  # fmt: skip
    if period > SLOW:
        text = f"Sampled at {1.0 / period:.3g} Hz only: wheel hop (9 Hz) is poorly resolved."
        limits.append(Limitation("slow_sampling", text, (), 0.7))
    if used < SHORT_DURATION:
        limits.append(Limitation("short", f"Only {used:.3g} s can be used: intervals are wide.", (), 0.7))
    if used < 0.9 * whole:
        text = f"{used:.3g} s of {whole:.3g} s are used: elsewhere road, command or sensors are missing."
        limits.append(Limitation("cut", text, (), 0.95))


def _required(topics: Mapping[str, TopicData], name: str) -> list[TopicData]:
    for topic, channels in ((ROAD, ROADS), (VALVE, COMMANDS[:2])):
        if topic not in topics:
            raise InputError(
                f"no {topic}, so the model cannot be driven", where=name, value=", ".join(sorted(topics)) or "no topic",
                remedy="record it, or rename the topic",
            )  # fmt: skip
        for channel in channels:
            values = topics[topic].channels.get(channel)
            if values is None:
                raise InputError(
                    f"no '{channel}' in {topic}", where=name, allowed=", ".join(channels),
                    value=", ".join(topics[topic].channels) or "no names",
                    remedy="name the channels as docs/topics.md does",
                )  # fmt: skip
            if np.count_nonzero(np.isfinite(values)) < 2:
                raise InputError(
                    f"'{channel}' of {topic} holds no number, so the model cannot be driven", where=name,
                    remedy="record it again",
                )  # fmt: skip
    return [topics[ROAD], topics[VALVE]]


def _inputs(
    topics: Mapping[str, TopicData], grid: Array, period: float, rig: Rig, name: str, limits: list[Limitation]
) -> tuple[Array, Array]:
    road, valve = topics[ROAD], topics[VALVE]
    _count_nan(ROAD, road, ROADS, limits)
    _count_nan(VALVE, valve, COMMANDS, limits)
    heights = [_linear(road.stamp, road.channels[side], grid) for side in ROADS]
    areas = []
    for channel, constant in zip(COMMANDS, (None, None, rig.outlet_area_front, rig.outlet_area_rear), strict=True):
        values = valve.channels.get(channel)
        if values is not None and np.count_nonzero(np.isfinite(values)) >= 2:
            areas.append(held(valve.stamp, values, grid, period))
        elif constant is not None:
            areas.append(np.full(len(grid), constant.value))
            text = f"{channel} is not in {VALVE}: the config's constant {constant.value:.3g} m2 is used."
            limits.append(Limitation("assumed_outlet", text, (), 0.95))
    commands = np.column_stack(areas)
    if APPLIED in topics:
        commands = _as_applied(topics[APPLIED], commands, grid, period, limits)
    if commands.min() < 0.0 or commands.max() > 1e-3:
        raise InputError(
            "orifice area not in m2", where=f"{name}, {VALVE}", value=float(commands.max()),
            allowed="0 to 0.001 m2", remedy="convert the log",
        )  # fmt: skip
    return commands, np.column_stack(heights)


def _as_applied(data: TopicData, commands: Array, grid: Array, period: float, limits: list[Limitation]) -> Array:
    """The openings that reached the valves, (N, 4); the command for a valve that the topic does not name."""
    applied = commands.copy()
    for column, channel in enumerate(COMMANDS):
        values = data.channels.get(channel)
        if values is not None and np.count_nonzero(np.isfinite(values)) >= 2:
            applied[:, column] = held(data.stamp, values, grid, period)
    said = as_applied(applied, commands)
    limits += [said] if said is not None else []
    return applied


def _linear(stamp: Array, values: Array, grid: Array) -> Array:
    real = np.isfinite(values)
    return np.interp(grid, stamp[real], values[real])


def _count_nan(topic: str, data: TopicData, names: tuple[str, ...], limits: list[Limitation]) -> None:
    for channel in names:
        values = data.channels.get(channel)
        if values is None:
            continue
        bad = int(np.count_nonzero(~np.isfinite(values)))
        if bad:
            share = bad / len(values)
            text = f"{topic} {channel}: {bad} samples ({100 * share:.2g} %) are not numbers and are bridged."
            limits.append(Limitation("nan", text, (), 1.0 if share < 0.01 else 0.8))


def _middles(measured: Array, weight: Array) -> tuple[Array, Array]:
    """Median height and pressure of both springs, (2,) each; NaN where not measured."""
    known = np.where(weight.any(axis=0), np.median(measured, axis=0), np.nan)
    return known[:2] - known[2:4], known[4:]


def _measured(
    topics: Mapping[str, TopicData], grid: Array, commands: Array, rig: Rig, log: str, limits: list[Limitation]
) -> tuple[Array, Array, Array, Array]:
    period = float(grid[1] - grid[0])
    values, weights, noises, stated = [], [], [], []
    for channel in MEASURED:
        expected = rig.pressure_noise.value if channel in PRESSURE else rig.displacement_noise.value
        data = topics.get(TOPIC_OF[channel])
        key = "pressure" if channel in PRESSURE else channel
        raw = None if data is None else data.channels.get(key)
        column, weight = np.zeros(len(grid)), np.zeros(len(grid))
        if data is not None and raw is not None and np.isfinite(raw).any():
            _count_nan(TOPIC_OF[channel], replace_name(data, key, channel), (channel,), limits)
            column, weight = sampled(data.stamp, raw, grid, period)
        valves = commands[:, VALVES_OF[channel]] if channel in VALVES_OF else None
        checked = check_channel(channel, column, weight, expected, log, valves)
        limits += checked.limitations if weight.any() else [missing(channel, _why_missing(channel, data, raw))]
        values.append(column)
        weights.append(checked.weight)
        noises.append(checked.noise)
        stated.append(expected)
    columns, weight = np.column_stack(values), np.column_stack(weights)
    return _filled(columns, weight, rig), weight, np.array(noises), np.array(stated)


def _why_missing(channel: str, data: TopicData | None, raw: Array | None) -> str:
    topic = TOPIC_OF[channel]
    if data is None:
        return f"is not in the log (no {topic})"
    if raw is None:
        return f"is not in {topic} (which names {', '.join(data.channels) or 'nothing'})"
    return f"holds no number in {topic}"


def _filled(measured: Array, weight: Array, rig: Rig) -> Array:
    """Channels without a sample get plausible values, so that no equation meets a vacuum; their weight stays zero.

    A displacement is its partner's at the same end, a design height away; a pressure is the static one.
    """
    out, used = measured.copy(), np.asarray(weight.any(axis=0))
    rest = trim(rig)
    height = rig.design_height.value
    for end in (0, 1):
        sprung, axle, pressure = end, 2 + end, 4 + end
        if not used[axle]:
            out[:, axle] = measured[:, sprung] - height if used[sprung] else rest.state[axle]
        if not used[sprung]:
            out[:, sprung] = out[:, axle] + height
        if not used[pressure]:
            out[:, pressure] = rest.pressures[end]
    return out


def replace_name(data: TopicData, old: str, new: str) -> TopicData:
    """The same samples with one channel under another name."""
    return data._replace(channels={new: data.channels[old]})
