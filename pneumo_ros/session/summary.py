# SPDX-License-Identifier: Apache-2.0
"""What a session's log says about the ride, the valves, the estimates and the loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.log.decoded import SECOND, Log
from pneumo_ros.log.inspection import read_setups
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.topic_data import Joint
from pneumo_ros.ride.comfort import Ride, judge
from pneumo_ros.rig import Rig
from pneumo_ros.rig.channels import (
    ESTIMATED_AREAS,
    TRUE_AREAS,
    TRUE_HEAVE_ACCELERATION,
    TRUE_PITCH_ACCELERATION,
    TRUE_TYRE_FORCES,
    spring_heights,
)
from pneumo_ros.session.warnings import MISSED
from pneumo_ros.units import GRAVITY

SETTLED = 1.0  # s; figures of ride and estimate leave out the start before it
LONGEST = 1800.0  # s of a session that are read for figures and picture, its last: 3 GB of memory
SAMPLED = (topics.COMMAND, topics.ESTIMATE, topics.TRUTH, topics.ROAD, *topics.MEASUREMENTS)
NEAR_LIMIT = 1e-9  # of the valve's range: a command this close to an end is saturated


@dataclass(frozen=True)
class Recorded:
    """A session as arrays, SI; times are from the first sample, s.

    Attributes
    ----------
    rig : as logged
    time, command : (N,), (N, 4) of /valve/command, m2
    estimate_time, estimate : (M,), (M, 16) of /estimate/state
    truth_time, truth : (K,), (K, 16) of /sim/truth; empty on hardware
    road_time, road : (L,), (L, 2), m
    measured_time, measured : (J,), (J, 6) displacements, m, and pressures, Pa, in the order of their topics
    mode : lockstep, realtime, or empty where the log does not say
    left_out : s of the session before the first sample here, where it is longer than what is read of one
    """

    rig: Rig
    time: NDArray[np.float64]
    command: NDArray[np.float64]
    estimate_time: NDArray[np.float64]
    estimate: NDArray[np.float64]
    truth_time: NDArray[np.float64]
    truth: NDArray[np.float64]
    road_time: NDArray[np.float64]
    road: NDArray[np.float64]
    measured_time: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    measured: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 6)))
    mode: str = ""
    left_out: float = 0.0


@dataclass(frozen=True)
class Summary:
    """Figures of one session after the first second.

    Attributes
    ----------
    ride : accelerations, rating, tyre load, workspace; None where no motion was logged
    saturation : share of time each inlet is fully open or closed, front and rear
    area_error : rms of estimated minus true effective area, front and rear, m2; None on hardware
    loop : node -> key -> text of its last /diagnostics
    speed : session time over wall time between first and last sample, 1 for real time; NaN if it was not logged
    mode : as in :class:`Recorded`
    judged_by : what the ride's figures come from: "truth" of a simulation, or "sensors"
    warnings : what a reader of the figures must know, one line each
    stretch : of the session that ride, valves and estimates are judged in, for people
    """

    ride: Ride | None
    saturation: tuple[float, float]
    area_error: tuple[float, float] | None
    loop: dict[str, dict[str, str]]
    speed: float
    mode: str = ""
    judged_by: str = "truth"
    warnings: tuple[str, ...] = ()
    stretch: str = "after the first second"


def load_session(path: Path | str, longest: float = LONGEST) -> Recorded:
    """Read what summary and picture need, of a long session its last ``longest`` seconds.

    Raises
    ------
    InputError
        if the log cannot be read or holds no session of this rig.
    """
    told = read_log(path, [topics.CONFIG.name, topics.SETUP.name])
    if told.config is None:
        raise InputError("no /rig/config in the log", where=path, remedy="record it, or give a log of this rig")
    first, last = told.span_ns or (0, 0)
    since = max(last - round(longest * SECOND), first)
    log = read_log(path, [topic.name for topic in SAMPLED], since)
    begun = [int(log.joint(t.name).stamp_ns[0]) for t in (topics.COMMAND, topics.DISPLACEMENT) if _has(log, t)]
    if not begun:
        raise InputError(f"holds neither {topics.COMMAND.name} nor {topics.DISPLACEMENT.name}", where=path,
                         remedy="record one of them, or give a log of this rig")  # fmt: skip
    start = min(begun)

    def columns(topic: topics.Topic) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        if not _has(log, topic):
            return np.empty(0), np.empty((0, len(topic.names)))
        joint: Joint = log.select(topic.name, list(topic.names))
        return np.asarray((joint.stamp_ns - start) * 1e-9, dtype=np.float64), joint.position

    return Recorded(
        told.config, *columns(topics.COMMAND), *columns(topics.ESTIMATE), *columns(topics.TRUTH), *columns(topics.ROAD),
        *_measured(log, start), mode=_mode(told), left_out=(since - first) / SECOND,
    )  # fmt: skip


def _measured(log: Log, start: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Every displacement, with the pressures interpolated to its instants."""
    pressures = (topics.FRONT_PRESSURE, topics.REAR_PRESSURE)
    if not all(_has(log, topic) for topic in topics.MEASUREMENTS):
        return np.empty(0), np.empty((0, 6))
    joint = log.select(topics.DISPLACEMENT.name, list(topics.DISPLACEMENT.names))
    found = [log.pressure(topic.name) for topic in pressures]
    columns = [np.interp(joint.stamp_ns, one.stamp_ns, one.value) for one in found]
    time = np.asarray((joint.stamp_ns - start) * 1e-9, dtype=np.float64)
    return time, np.column_stack([joint.position, *columns])


def _mode(log: Log) -> str:
    return next((str(s.parameters["mode"]) for s in read_setups(log) if "mode" in s.parameters), "")


def summarise(
    session: Recorded,
    loop: dict[str, dict[str, str]] | None = None,
    wall: float = float("nan"),
    warnings: Sequence[str] = (),
) -> Summary:
    """Figures of a session; the first :data:`SETTLED` seconds are left out.

    Parameters
    ----------
    loop : of :func:`loop_timing`
    wall : of :func:`wall_time`, s
    warnings : of :func:`pneumo_ros.session.warnings.warnings_of`
    """
    command = session.command[session.time >= SETTLED]
    top = session.rig.inlet_area_max.value
    saturated = [
        float(np.mean((column <= NEAR_LIMIT * top) | (column >= (1.0 - NEAR_LIMIT) * top))) if len(column) else 0.0
        for column in command[:, :2].T
    ]
    by_truth = len(session.truth) > 1
    return Summary(
        _ride(session) if by_truth else _ride_of_sensors(session),
        (saturated[0], saturated[1]),
        area_error(session),
        loop or {},
        _last(session) / wall,
        session.mode,
        "truth" if by_truth else "sensors",
        tuple(warnings),
        _stretch(session),
    )


def _stretch(session: Recorded) -> str:
    if not session.left_out:
        return "after the first second"
    length = _last(session) - session.left_out
    return f"the last {length / 60.0:.0f} min of {_last(session) / 3600.0:.1f} h"


def _last(session: Recorded) -> float:
    """Time of the last sample, s, with the period it stands for; NaN without any."""
    times = session.measured_time if len(session.measured_time) > 1 else session.time
    return float(session.left_out + times[-1] + np.median(np.diff(times))) if len(times) > 1 else float("nan")


def area_error(session: Recorded) -> tuple[float, float] | None:
    """Rms of estimated minus true effective area, front and rear, m2, after :data:`SETTLED`."""
    if not len(session.truth) or not len(session.estimate):
        return None
    keep = session.truth_time >= SETTLED
    errors = [
        np.interp(session.truth_time[keep], session.estimate_time, session.estimate[:, estimated])
        - session.truth[keep, true]
        for estimated, true in zip(ESTIMATED_AREAS, TRUE_AREAS, strict=True)
    ]
    front, rear = (float(np.sqrt(np.mean(e**2))) if len(e) else float("nan") for e in errors)
    return front, rear


def ride_rows(ride: Ride) -> list[tuple[str, str, list[float], str]]:
    """(name, unit, values, format) of every figure of a ride, for tables."""
    return [
        ("heave accel., rms", "m/s2", [ride.heave_rms], "%.3f"),
        (f"same, full scale (x {ride.scale:g})", "m/s2", [ride.full_scale_heave_rms], "%.3f"),
        ("pitch accel., rms", "rad/s2", [ride.pitch_rms], "%.3f"),
        ("mean personal rating", "0-5", [ride.rating if ride.rated else float("nan")], "%.2f"),
        ("tyre load variation, f / r", "%", [100.0 * v for v in ride.tyre_load_variation], "%.1f"),
        ("travel, f / r", "mm", [1e3 * v for v in ride.workspace], "%.1f"),
    ]


# A quartic over 46 ms passes what a road excites (30 Hz) and leaves 10 um of LVDT noise as about 0.1 m/s2.
ACCELERATION_WINDOW, ACCELERATION_ROWS = 0.046, 7  # s, samples at least
REAL = 0.005  # a real-time session this close to 1 ran in real time


def pace(summary: Summary) -> str:
    """``, in real time (factor 1.00)`` and the like, with the reason where a real-time session's factor is not 1."""
    if not np.isfinite(summary.speed):
        return ", in real time; stopped before its end, so without a factor" if summary.mode == "realtime" else ""
    if summary.mode != "realtime":
        return f", at {summary.speed:.1f} x real time"
    text = f", in real time (factor {summary.speed:.2f})"
    if abs(summary.speed - 1.0) <= REAL:
        return text
    missed = any(int(values.get(MISSED, "0")) for values in summary.loop.values())
    why = "periods were missed" if missed else "samples are missing at the start or end of the log"
    return f"{text}: {why}"


# Beside the table of loops.
STEPS_NOTE = "steps: up to each node's last report; it reports once a second, so the counts differ by up to that"


def counts_missed(summary: Summary) -> bool:
    """Whether a node of the session counts periods that it missed: not in lockstep, and not where a board samples."""
    return summary.mode != "lockstep" and any(MISSED in values for values in summary.loop.values())


OUT_OF_RANGE = "out of its range"
NOTHING = 1e-9  # of any figure, in its unit: a rig at trim on a flat road moves by what rounding does
LARGE = 3.0  # ratio from which a factor says more than per cent


def figures(values: Sequence[float], form: str) -> str:
    """Front and rear, or one value; NaN is a regression that was left."""
    return " / ".join(form % value if np.isfinite(value) else OUT_OF_RANGE for value in values)


def change(ours: Sequence[float], theirs: Sequence[float]) -> str:
    """Per cent from theirs to ours, or the factor where it is large; nothing where there is none."""
    return " / ".join(_change(a, b) for a, b in zip(ours, theirs, strict=False) if abs(b) > NOTHING and np.isfinite(a))


def _change(ours: float, theirs: float) -> str:
    ratio = ours / theirs
    return f"x {ratio:.3g}" if ratio > LARGE else f"{100.0 * (ratio - 1.0):+.0f} %"


def static_tyre_loads(rig: Rig) -> tuple[float, float]:
    """Front and rear tyre load at rest, N."""
    a, b = rig.front_arm.value, rig.rear_arm.value
    body = rig.sprung_mass.value * GRAVITY / (a + b)
    return (
        body * b + rig.unsprung_mass_front.value * GRAVITY,
        body * a + rig.unsprung_mass_rear.value * GRAVITY,
    )


def _ride(session: Recorded) -> Ride | None:
    keep = session.truth_time >= SETTLED
    x = session.truth[keep]
    if len(x) < 2:
        return None
    rig = session.rig
    heights = np.column_stack(spring_heights(x, rig.front_arm.value, rig.rear_arm.value))
    return judge(
        x[:, TRUE_HEAVE_ACCELERATION], x[:, TRUE_PITCH_ACCELERATION], x[:, TRUE_TYRE_FORCES],
        static_tyre_loads(rig), heights, rig.length_scale.value,
    )  # fmt: skip


def measured_tyre_forces(session: Recorded) -> NDArray[np.float64]:
    """(J, 2) front and rear tyre force at the measured instants, N, by stiffness and the measured axles."""
    rig, at = session.rig, session.measured_time
    if not len(session.road):
        return np.full((len(at), 2), np.nan)
    road = np.column_stack([np.interp(at, session.road_time, session.road[:, side]) for side in (0, 1)])
    stiffness = np.array([rig.tyre_stiffness_front.value, rig.tyre_stiffness_rear.value])
    return np.asarray(stiffness * (road - session.measured[:, 2:4]))


def _ride_of_sensors(session: Recorded) -> Ride | None:
    """The same from what hardware has: the body's LVDTs twice differentiated, tyres and travel from the LVDTs."""
    seen = session.measured_time >= SETTLED
    if np.count_nonzero(seen) < 2 * ACCELERATION_ROWS:
        return None
    heights = session.measured[seen, :2] - session.measured[seen, 2:4]
    heave, pitch = _body_accelerations(session, seen)
    return judge(heave, pitch, measured_tyre_forces(session)[seen], static_tyre_loads(session.rig), heights,
                 session.rig.length_scale.value)  # fmt: skip


def _body_accelerations(session: Recorded, seen: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Heave, m/s2, and pitch, rad/s2: looking both ways in time, which an estimator in the loop cannot."""
    from scipy.signal import savgol_filter

    period = float(np.median(np.diff(session.measured_time)))
    rows = max(ACCELERATION_ROWS, round(ACCELERATION_WINDOW / period) // 2 * 2 + 1)
    front, rear = savgol_filter(session.measured[seen, :2], rows, 4, deriv=2, delta=period, axis=0).T
    a, b = session.rig.front_arm.value, session.rig.rear_arm.value
    return (b * front + a * rear) / (a + b), (front - rear) / (a + b)


def loop_timing(log: Log) -> dict[str, dict[str, str]]:
    """The last /diagnostics of each node: node -> key -> text."""
    out: dict[str, dict[str, str]] = {}
    if not _has(log, topics.DIAGNOSTIC):
        return out
    for _, message in log.messages(topics.DIAGNOSTIC.name):
        for status in message.status:
            if status.name.endswith(": loop"):
                out[status.name.removesuffix(": loop")] = {v.key: v.value for v in status.values}
    return out


def wall_time(log: Log) -> float:
    """Seconds on the computer's clock between a session's first and last sample; NaN without both events."""
    stamps: dict[str, float] = {}
    for _, message in log.messages(topics.EVENTS.name) if _has(log, topics.EVENTS) else ():
        stamp = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
        stamps.update({v.value: stamp for status in message.status for v in status.values if v.key == "code"})
    return stamps.get("session_complete", float("nan")) - stamps.get("session_started", float("nan"))


def _has(log: Log, topic: topics.Topic) -> bool:
    return topic.name in log.topics and log.topics[topic.name].count > 0
