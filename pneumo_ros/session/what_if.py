# SPDX-License-Identifier: Apache-2.0
"""What other gains would have commanded on the recorded measurements: a table and an overlay plot."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from pneumo_ros.log import topics
from pneumo_ros.log.topics import Topic
from pneumo_ros.printable import printable
from pneumo_ros.rig import Rig
from pneumo_ros.session.picture import save_figure
from pneumo_ros.session.replay import Replayed, Track

CAVEAT = "The plant does not react: measurements are the recorded ones; how the rig would have moved is not shown."
NEAR_LIMIT = 1e-9  # of the valve's range: a command this close to an end is saturated
_INLETS = ("front_inlet", "rear_inlet")


@dataclass(frozen=True)
class Row:
    """One figure: recorded, replayed, in the unit stated."""

    name: str
    unit: str
    recorded: float
    replayed: float


def what_if(replayed: Replayed, rig: Rig) -> list[Row]:
    """Figures of the commands, the sliding variables and the area estimates at samples that both have."""
    rows: list[Row] = []
    for topic, found in _pairs(replayed):
        recorded = replayed.recorded[topic.name]
        ours, theirs = _common(found, recorded)
        for k, name in enumerate(topic.names):
            rows += _figures(topic, name, theirs[:, k], ours[:, k], rig)
    return rows


def _pairs(replayed: Replayed) -> list[tuple[Topic, Track]]:
    pairs = (
        (topics.COMMAND, replayed.command),
        (topics.SLIDING, replayed.sliding),
        (topics.ESTIMATE, replayed.estimate),
    )
    return [(topic, found) for topic, found in pairs if topic.name in replayed.recorded]


def _common(ours: Track, theirs: Track) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    _, a, b = np.intersect1d(ours.stamp_ns, theirs.stamp_ns, return_indices=True)
    return ours.values[a], theirs.values[b]


def _figures(
    topic: Topic, name: str, recorded: NDArray[np.float64], replayed: NDArray[np.float64], rig: Rig
) -> list[Row]:
    if not len(recorded):
        return []
    if topic is topics.COMMAND and name in _INLETS:
        top = rig.inlet_area_max.value
        mean = Row(f"{name}, mean", "mm2", *(float(v.mean()) * 1e6 for v in (recorded, replayed)))
        activity = Row(f"{name}, rms change per period", "mm2", *(_activity(v) * 1e6 for v in (recorded, replayed)))
        share = Row(f"{name}, saturated", "% of time", *(100.0 * _saturated(v, top) for v in (recorded, replayed)))
        return [mean, activity, share]
    if topic is topics.SLIDING and name.startswith("sliding"):
        unit = dict(topic.fields)[name]
        return [Row(f"{name}, rms", unit, *(float(np.sqrt(np.mean(v**2))) for v in (recorded, replayed)))]
    if topic is topics.ESTIMATE and name.endswith("_area"):
        return [Row(f"estimated {name}, mean", "cm2", *(float(v.mean()) * 1e4 for v in (recorded, replayed)))]
    return []


def _activity(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.diff(values) ** 2))) if len(values) > 1 else 0.0


def _saturated(values: NDArray[np.float64], top: float) -> float:
    return float(np.mean((values <= NEAR_LIMIT * top) | (values >= (1.0 - NEAR_LIMIT) * top)))


def draw_overlay(replayed: Replayed, path: Path, title: str) -> None:
    """Recorded and replayed commands, sliding variables and area estimates over each other, as a PNG."""
    panels = (
        ("front inlet (mm2)", topics.COMMAND, replayed.command, "front_inlet", 1e6),
        ("rear inlet (mm2)", topics.COMMAND, replayed.command, "rear_inlet", 1e6),
        ("sliding variable,\nheave (m/s)", topics.SLIDING, replayed.sliding, "sliding_heave", 1.0),
        ("sliding variable,\npitch (rad/s)", topics.SLIDING, replayed.sliding, "sliding_pitch", 1.0),
        ("estimated area,\nfront (cm2)", topics.ESTIMATE, replayed.estimate, "front_area", 1e4),
        ("estimated area,\nrear (cm2)", topics.ESTIMATE, replayed.estimate, "rear_area", 1e4),
    )
    figure, axes = plt.subplots(len(panels), 1, figsize=(11, 13), sharex=True, constrained_layout=True)
    start = int(replayed.estimate.stamp_ns[0])
    for axis, (label, topic, found, channel, factor) in zip(axes, panels, strict=True):
        k = topic.names.index(channel)
        recorded = replayed.recorded.get(topic.name)
        if recorded is not None:
            _draw(axis, recorded, k, factor, start, "recorded", "#999999", 1.8)
        _draw(axis, found, k, factor, start, "replayed", "#d62728", 0.8)
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
        axis.margins(x=0)
    axes[0].legend(loc="upper right", ncols=2)
    axes[-1].set_xlabel("time (s)")
    figure.suptitle(printable(f"{title}\n{CAVEAT}"), fontsize=10, parse_math=False)
    save_figure(figure, path)


def _draw(axis: Axes, found: Track, k: int, factor: float, start: int, label: str, colour: str, width: float) -> None:
    axis.plot((found.stamp_ns - start) * 1e-9, found.values[:, k] * factor, color=colour, lw=width, label=label)
