# SPDX-License-Identifier: Apache-2.0
"""Tables and pictures of the quarter car."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pneumo_ros.control.laws.family import LAWS
from pneumo_ros.thesis.linearised import area_stiffness_share, body_mode
from pneumo_ros.thesis.quarter import Experiment, Outcome, measure, plant, run
from pneumo_ros.thesis.quarter_experiments import AREAS_IN2, EXPERIMENTS, PAIRS, POLES
from pneumo_ros.thesis.report import Picture, Table, canvas
from pneumo_ros.thesis.robustness import SLIDING
from pneumo_ros.thesis.settings import ThesisSettings
from pneumo_ros.units import INCH, SQUARE_INCH
from pneumo_ros.workers import run_in_order

Outcomes = Mapping[str, Outcome]
MPR_NOTE = (
    "believed area as parameter; MPR (Figures 6.5, 6.7, 6.17) is 0 above 0.136 g, so rms alone tells curves apart"
)


def cylinder_table(settings: ThesisSettings) -> Table:
    """Every law on the cylinder of Section 6.3, its area and volume known: what is left is not dA/dt."""
    runs = {"passive": Experiment("passive", True)}
    runs |= {law: Experiment(law, True, {"area_in2": 5.0}) for law in LAWS}
    outcomes = run_in_order(measure, [(settings, e) for e in runs.values()])
    return outcome_table("Quarter car on a cylinder of 5 in2, area known", dict(zip(runs, outcomes, strict=True)))


def outcome_table(title: str, o: Outcomes) -> Table:
    """Every figure of a set of experiments."""
    header = [
        "experiment",
        "rms, g full scale",
        "MPR",
        "rise, s",
        "overshoot, in",
        "offset, in",
        "area error, in2",
        "valve at a limit, %",
        "tyre load variation",
    ]
    rows = [
        [
            name,
            f"{x.rms_g:.3f}",
            f"{x.rating:.2f}",
            f"{x.rise:.2f}",
            f"{x.overshoot_in:.2f}",
            f"{x.offset_in:.3f}",
            f"{x.area_error_in2:.3f}",
            f"{100 * x.saturated:.1f}",
            f"{x.tyre_variation:.3f}",
        ]
        for name, x in o.items()
    ]
    return Table(title, header, rows, "rms over all roads after the settling time")


def modes_table(settings: ThesisSettings) -> Table:
    """What the loops do about rest, before any road."""
    total, share = area_stiffness_share(settings)
    rows = []
    for name, experiment in EXPERIMENTS.items():
        if experiment.law != "passive":
            mode = body_mode(settings, experiment)
            rows.append([name, f"{mode.frequency_hz:.2f}", f"{mode.damping_ratio:+.3f}"])
    note = (
        f"about rest, continuous time, no valve limits, an estimated area counting as known; stiffness at rest "
        f"{total:.0f} "
        f"lb/in, {100 * share:.0f} % of it the area's; a negative ratio grows until the valve limits it"
    )
    return Table("Linearised loops: least damped body mode", ["experiment", "Hz", "damping ratio"], rows, note)


def curves_picture(curves: dict[str, np.ndarray]) -> Picture:
    """The sensitivity curves."""
    figure, axes = canvas(2, 3, width=12.0)
    for axis, (name, grid) in zip(axes, curves.items(), strict=False):
        for i, row in enumerate(grid):
            axis.semilogy(POLES, row, "o-", ms=3, label=f"{AREAS_IN2[i]:g} in2" if len(grid) > 1 else "estimated")
        axis.set(title=name, xlabel="triple pole, 1/s", ylabel="rms, g full scale")
    axes[0].legend(fontsize=7)
    axes[-1].set_visible(False)
    return Picture("Sensitivity curves (Figures 6.4, 6.6, 6.13, 6.16, 6.23)", figure, MPR_NOTE)


def response_picture(settings: ThesisSettings) -> Picture:
    """Figure 6.15: the sliding family in time."""
    figure, axes = canvas(1, 2, width=12.0)
    for name in ("passive", *SLIDING):
        r = run(settings, EXPERIMENTS[name], 1)
        axes[0].plot(r.times, (r.states[:, 0] - r.states[-1, 0]) / INCH, lw=0.8, label=name)
        axes[1].plot(r.times[:-1], r.inlets / SQUARE_INCH, lw=0.8)
    axes[0].set(xlabel="s", ylabel="heave about its end, in")
    axes[1].set(xlabel="s", ylabel="inlet, in2")
    axes[0].legend(fontsize=7)
    return Picture("Figure 6.15: the sliding family", figure, "start below design height, seed 1")


def pairs_picture(settings: ThesisSettings) -> Picture:
    """The thesis's comparisons two by two: heave about the target, and tyre force."""
    figure, axes = canvas(2, len(PAIRS), width=3.2 * len(PAIRS), height=2.4)
    for i, (title, names) in enumerate(PAIRS.items()):
        car, trim = plant(settings, False)
        for name in names:
            r = run(settings, EXPERIMENTS[name], 1)
            axes[i].plot(r.times, (r.states[:, 0] - trim.state[0]) / INCH, lw=0.7, label=name)
            force = car.corner.tyre_stiffness * (r.road - r.states[:, 1])
            axes[len(PAIRS) + i].plot(r.times, force, lw=0.5)
        axes[i].set_title(title, fontsize=8)
        axes[i].legend(fontsize=6)
        axes[len(PAIRS) + i].set_xlabel("s")
    axes[0].set_ylabel("heave, in")
    axes[len(PAIRS)].set_ylabel("tyre force, N")
    return Picture("Figures 6.9 to 6.24: comparisons", figure, "seed 1; heave about the target")


def area_picture(settings: ThesisSettings) -> Picture:
    """Figure 6.21: true and estimated area in time."""
    figure, axes = canvas(1, 1, width=10.0)
    r = run(settings, EXPERIMENTS["bounded"], 1)
    axes[0].plot(r.times[:-1], r.areas / SQUARE_INCH, label="true")
    axes[0].plot(r.times[:-1], r.estimated_areas / SQUARE_INCH, "--", label="estimated")
    axes[0].set(xlabel="s", ylabel="effective area, in2", xlim=(0.0, 4.0), ylim=(0.0, 4.0))
    axes[0].legend()
    return Picture("Figure 6.21: estimated area", figure, "bounded forgetting, exact accelerations")
