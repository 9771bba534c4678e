# SPDX-License-Identifier: Apache-2.0
"""One picture of a session: road and heave, pitch, tyre forces, pressures, orifice areas, effective areas true and
estimated.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pneumo_ros.files import new_file
from pneumo_ros.printable import printable
from pneumo_ros.rig.channels import ESTIMATED_AREAS, HEAVE, PITCH, TRUE_AREAS, TRUE_TYRE_FORCES
from pneumo_ros.session.summary import Recorded, measured_tyre_forces, static_tyre_loads
from pneumo_ros.units import DEGREE

FRONT, REAR, GREY = "#1f77b4", "#d62728", "#9a9a9a"


def draw_session(session: Recorded, path: Path, passive: Recorded | None = None, title: str = "") -> None:
    """Write a PNG; ``passive`` is drawn in grey behind the active run."""
    figure, axes = plt.subplots(7, 1, figsize=(11, 16), sharex=True, constrained_layout=True)
    _motion(axes[0], axes[1], session, passive)
    _tyres(axes[2], session)
    _pressures(axes[3], session)
    _orifices(axes[4], session)
    for side, (axis, name, colour) in enumerate(((axes[5], "front", FRONT), (axes[6], "rear", REAR))):
        _area(axis, session, side, name, colour)
    axes[-1].set_xlabel("time (s)")
    for axis in axes:
        axis.grid(alpha=0.3)
        if axis.get_legend_handles_labels()[0]:
            axis.legend(loc="upper right", fontsize=8, ncols=3)
        axis.margins(x=0)
    figure.suptitle(printable(title), parse_math=False)
    save_figure(figure, path)


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as PNG and let it go."""
    with new_file(path) as part:
        figure.savefig(part, dpi=110, format="png")
    plt.close(figure)


def _motion(heave: Axes, pitch: Axes, session: Recorded, passive: Recorded | None) -> None:
    for axis, column, scale in ((heave, HEAVE, 1e3), (pitch, PITCH, 1.0 / DEGREE)):
        if passive is not None:
            shown = (passive.truth[:, column] - passive.truth[0, column]) * scale
            axis.plot(passive.truth_time, shown, color=GREY, lw=0.9, label="valves at trim (simulated)")
        if len(session.truth):
            shown = (session.truth[:, column] - session.truth[0, column]) * scale
            axis.plot(session.truth_time, shown, color="k", lw=1.1, label="active")
        elif len(session.estimate):
            shown = (session.estimate[:, column] - session.estimate[0, column]) * scale
            axis.plot(session.estimate_time, shown, color="k", lw=1.1, label="estimated")
    heave.plot(session.road_time, session.road[:, 0] * 1e3, color=FRONT, lw=0.5, alpha=0.5, label="road, front")
    heave.set_ylabel("heave from rest\n(mm)")
    pitch.set_ylabel("pitch, nose up,\nfrom rest (deg)")


def _tyres(axis: Axes, session: Recorded) -> None:
    forces = measured_tyre_forces(session)
    for side, (name, colour) in enumerate((("front", FRONT), ("rear", REAR))):
        if len(session.truth):
            axis.plot(session.truth_time, session.truth[:, TRUE_TYRE_FORCES[side]], color=colour, lw=0.8, label=name)
        elif len(session.measured):
            label = f"{name}, from the LVDT"
            axis.plot(session.measured_time, forces[:, side], color=colour, lw=0.8, label=label)
        axis.axhline(static_tyre_loads(session.rig)[side], color=colour, lw=0.7, ls=":", label=f"{name}, at rest")
    axis.axhline(0.0, color="k", lw=0.7)
    axis.set_ylabel("tyre force (N)\n0: contact lost")


def _pressures(axis: Axes, session: Recorded) -> None:
    for column, (name, colour) in enumerate((("front", FRONT), ("rear", REAR)), start=4):
        axis.plot(session.measured_time, session.measured[:, column] * 1e-3, color=colour, lw=0.8, label=name)
    axis.axhline(session.rig.supply_pressure.value * 1e-3, color="k", lw=0.7, ls="--", label="supply, by the rig file")
    axis.set_ylabel("pressure\n(kPa, absolute)")


def _orifices(axis: Axes, session: Recorded) -> None:
    for column, (name, colour, style) in enumerate(
        (
            ("front inlet", FRONT, "-"),
            ("rear inlet", REAR, "-"),
            ("front outlet", FRONT, ":"),
            ("rear outlet", REAR, ":"),
        )
    ):
        axis.plot(session.time, session.command[:, column] * 1e6, color=colour, ls=style, lw=0.8, label=name)
    axis.axhline(session.rig.inlet_area_max.value * 1e6, color="k", lw=0.7, ls="--", label="fully open")
    axis.set_ylabel("orifice area (mm2)")


def _area(axis: Axes, session: Recorded, side: int, name: str, colour: str) -> None:
    if len(session.estimate):
        shown = session.estimate[:, ESTIMATED_AREAS[side]] * 1e4
        axis.plot(session.estimate_time, shown, color=colour, lw=0.8, label="estimated")
    if len(session.truth):
        true = session.truth[:, TRUE_AREAS[side]] * 1e4
        axis.plot(session.truth_time, true, color="k", lw=1.0, ls="--", label="true")
        low, high = true.min(), true.max()
        axis.set_ylim(low - 0.5 * (high - low), high + 0.5 * (high - low))
    axis.set_ylabel(f"effective area,\n{name} (cm2)")
