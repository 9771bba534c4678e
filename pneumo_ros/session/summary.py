"""What a session's log says about the ride, the valves, the estimates and the loop."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.log.reading import Joint, Log, read_log
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
from pneumo_ros.units import GRAVITY

SETTLED = 1.0  # s; figures of ride and estimate leave out the start before it
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
    """

    ride: Ride | None
    saturation: tuple[float, float]
    area_error: tuple[float, float] | None
    loop: dict[str, dict[str, str]]
    speed: float


def load_session(path: Path | str) -> Recorded:
    """Read what summary and picture need.

    Raises
    ------
    InputError
        if the log cannot be read or holds no session of this rig.
    """
    log = read_log(path)
    if log.config is None:
        raise InputError("no /rig/config in the log", where=path, remedy="record it, or give a log of this rig")
    start = min(int(log.joint(t.name).stamp_ns[0]) for t in (topics.COMMAND, topics.DISPLACEMENT) if _has(log, t))

    def columns(topic: topics.Topic) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        if not _has(log, topic):
            return np.empty(0), np.empty((0, len(topic.names)))
        joint: Joint = log.select(topic.name, list(topic.names))
        return np.asarray((joint.stamp_ns - start) * 1e-9, dtype=np.float64), joint.position

    return Recorded(log.config, *columns(topics.COMMAND), *columns(topics.ESTIMATE), *columns(topics.TRUTH),
                    *columns(topics.ROAD))  # fmt: skip


def summarise(session: Recorded, loop: dict[str, dict[str, str]] | None = None, wall: float = float("nan")) -> Summary:
    """Figures of a session; the first :data:`SETTLED` seconds are left out.

    Parameters
    ----------
    loop : of :func:`loop_timing`
    wall : of :func:`wall_time`, s
    """
    command = session.command[session.time >= SETTLED]
    top = session.rig.inlet_area_max.value
    saturated = [
        float(np.mean((column <= NEAR_LIMIT * top) | (column >= (1.0 - NEAR_LIMIT) * top))) if len(column) else 0.0
        for column in command[:, :2].T
    ]
    return Summary(_ride(session), (saturated[0], saturated[1]), area_error(session), loop or {},
                   float(session.time[-1]) / wall if len(session.time) else float("nan"))  # fmt: skip


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
        ("same, full scale", "m/s2", [ride.full_scale_heave_rms], "%.3f"),
        ("pitch accel., rms", "rad/s2", [ride.pitch_rms], "%.3f"),
        ("mean personal rating", "0-5", [ride.rating], "%.2f"),
        ("tyre load variation, f / r", "%", [100.0 * v for v in ride.tyre_load_variation], "%.1f"),
        ("travel, f / r", "mm", [1e3 * v for v in ride.workspace], "%.1f"),
    ]


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
        static_tyre_loads(rig), heights,
    )  # fmt: skip


def loop_timing(path: Path | str) -> dict[str, dict[str, str]]:
    """The last /diagnostics of each node: node -> key -> text."""
    log = read_log(path, [topics.DIAGNOSTIC.name])
    out: dict[str, dict[str, str]] = {}
    if not _has(log, topics.DIAGNOSTIC):
        return out
    for _, message in log.messages(topics.DIAGNOSTIC.name):
        for status in message.status:
            if status.name.endswith(": loop"):
                out[status.name.removesuffix(": loop")] = {v.key: v.value for v in status.values}
    return out


def wall_time(path: Path | str) -> float:
    """Seconds on the computer's clock between a session's first and last sample; NaN without both events."""
    log = read_log(path, [topics.EVENTS.name])
    stamps: dict[str, float] = {}
    for _, message in log.messages(topics.EVENTS.name) if _has(log, topics.EVENTS) else ():
        stamp = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
        stamps.update({v.value: stamp for status in message.status for v in status.values if v.key == "code"})
    return stamps.get("session_complete", float("nan")) - stamps.get("session_started", float("nan"))


def _has(log: Log, topic: topics.Topic) -> bool:
    return topic.name in log.topics and log.topics[topic.name].count > 0
