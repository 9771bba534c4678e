# SPDX-License-Identifier: Apache-2.0
"""What the dashboard shows: panels, lines, units, and the few signals that must be derived."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.log import topics
from pneumo_ros.log.topics import Topic
from pneumo_ros.rig import Rig
from pneumo_ros.units import DEGREE

MOTION, TYRES = "derived/motion", "derived/tyres"


@dataclass(frozen=True)
class Samples:
    """Values of one topic: stamps (N,) ns in ascending order, K names, values (N, K) SI."""

    time_ns: NDArray[np.int64]
    names: tuple[str, ...]
    values: NDArray[np.float64]

    def column(self, name: str) -> NDArray[np.float64] | None:
        """The values of one channel (N,), or None if there is no such channel."""
        return self.values[:, self.names.index(name)] if name in self.names else None

    def between(self, begin_ns: int, end_ns: int) -> Samples:
        """Those with begin <= stamp <= end."""
        rows = slice(*np.searchsorted(self.time_ns, [begin_ns, end_ns + 1]).tolist())
        return Samples(self.time_ns[rows], self.names, self.values[rows])


@dataclass(frozen=True)
class Line:
    """One curve: label, source topic and channel, factor from SI to the panel's unit, colour, dash."""

    label: str
    source: str
    channel: str
    factor: float
    colour: str
    dash: str = "solid"


@dataclass(frozen=True)
class Panel:
    """One plot: title with unit."""

    title: str
    lines: tuple[Line, ...]


FRONT, REAR, DARK, GREY = "#1f77b4", "#d62728", "#222222", "#999999"
_ESTIMATE, _SLIDING, _TRUTH = topics.ESTIMATE.name, topics.SLIDING.name, topics.TRUTH.name
_MM, _DEG, _MM2, _CM2, _KPA = 1e3, 1.0 / DEGREE, 1e6, 1e4, 1e-3

PANELS: tuple[Panel, ...] = (
    Panel("heave (mm)", (
        Line("from LVDTs", MOTION, "heave", _MM, GREY),
        Line("estimated", _ESTIMATE, "heave", _MM, DARK),
        Line("reference", _SLIDING, "reference_heave", _MM, REAR, "dashed"),
    )),
    Panel("pitch, nose up (deg)", (
        Line("from LVDTs", MOTION, "pitch_nose_up", _DEG, GREY),
        Line("estimated", _ESTIMATE, "pitch_nose_up", _DEG, DARK),
        Line("reference", _SLIDING, "reference_pitch_nose_up", _DEG, REAR, "dashed"),
    )),
    Panel("tyre force (N)", (
        Line("front", TYRES, "front", 1.0, FRONT),
        Line("rear", TYRES, "rear", 1.0, REAR),
    )),
    Panel("pressure (kPa, absolute)", (
        Line("front", topics.FRONT_PRESSURE.name, "fluid_pressure", _KPA, FRONT),
        Line("rear", topics.REAR_PRESSURE.name, "fluid_pressure", _KPA, REAR),
    )),
    Panel("commanded orifice area (mm2)", (
        Line("front inlet", topics.COMMAND.name, "front_inlet", _MM2, FRONT),
        Line("rear inlet", topics.COMMAND.name, "rear_inlet", _MM2, REAR),
        Line("front outlet", topics.COMMAND.name, "front_outlet", _MM2, FRONT, "dotted"),
        Line("rear outlet", topics.COMMAND.name, "rear_outlet", _MM2, REAR, "dotted"),
    )),
    Panel("effective area (cm2)", (
        Line("front, estimated", _ESTIMATE, "front_area", _CM2, FRONT),
        Line("rear, estimated", _ESTIMATE, "rear_area", _CM2, REAR),
        Line("front, true", _TRUTH, "front_area", _CM2, FRONT, "dashed"),
        Line("rear, true", _TRUTH, "rear_area", _CM2, REAR, "dashed"),
    )),
    Panel("sliding variable of heave (m/s)", (Line("heave", _SLIDING, "sliding_heave", 1.0, DARK),)),
    Panel("sliding variable of pitch (rad/s)", (Line("pitch", _SLIDING, "sliding_pitch", 1.0, DARK),)),
)  # fmt: skip

SHOWN: tuple[Topic, ...] = (
    topics.ROAD, topics.DISPLACEMENT, topics.FRONT_PRESSURE, topics.REAR_PRESSURE, topics.COMMAND, topics.ESTIMATE,
    topics.SLIDING, topics.TRUTH,
)  # fmt: skip
"""Topics that the panels need."""


def derive(found: Mapping[str, Samples], rig: Rig) -> dict[str, Samples]:
    """``found`` with heave and pitch by the LVDTs (Eqs. 4.63-4.64) and tyre forces k_t (z_r - z_u) added.

    Whatever lacks its inputs is left out.
    """
    out = dict(found)
    displacement, road = found.get(topics.DISPLACEMENT.name), found.get(topics.ROAD.name)
    if displacement is None or not len(displacement.time_ns):
        return out
    columns = [displacement.column(name) for name in topics.DISPLACEMENT.names]
    front, rear, unsprung_front, unsprung_rear = columns
    a, b = rig.front_arm.value, rig.rear_arm.value
    if front is not None and rear is not None:
        motion = np.column_stack([(b * front + a * rear) / (a + b), (front - rear) / (a + b)])
        out[MOTION] = Samples(displacement.time_ns, ("heave", "pitch_nose_up"), motion)
    if road is None or not len(road.time_ns) or unsprung_front is None or unsprung_rear is None:
        return out
    forces = [
        stiffness.value * (np.interp(displacement.time_ns, road.time_ns, heights) - axle)
        for stiffness, heights, axle in (
            (rig.tyre_stiffness_front, road.column("front"), unsprung_front),
            (rig.tyre_stiffness_rear, road.column("rear"), unsprung_rear),
        )
        if heights is not None
    ]
    if len(forces) == 2:
        out[TYRES] = Samples(displacement.time_ns, ("front", "rear"), np.column_stack(forces))
    return out


def thin(time: NDArray[Any], value: NDArray[Any], points: int) -> tuple[NDArray[Any], ...]:
    """At most ``points`` of a curve, keeping every peak: the least and the greatest of each stretch, in order."""
    if len(time) <= points:
        return time, value
    width = -(-len(time) // (points // 2))
    whole = len(time) // width * width
    blocks = value[:whole].reshape(-1, width)
    base = np.arange(0, whole, width)
    picks = np.unique(np.concatenate([base + blocks.argmin(1), base + blocks.argmax(1), [len(time) - 1]]))
    return time[picks], value[picks]
