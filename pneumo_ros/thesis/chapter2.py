# SPDX-License-Identifier: Apache-2.0
"""Chapter 2: comfort criteria and baselines; passive, skyhook and active rides judged side by side."""

from __future__ import annotations

import numpy as np

from pneumo_ros.road import LENGTH_SCALE
from pneumo_ros.thesis.chapter6_half import HEIGHT_ERROR_IN, VOLUME, table
from pneumo_ros.thesis.comfort_limits import HEALEY, ISO_1972_HOURS, iso_1972_limit, third_octaves
from pneumo_ros.thesis.half import CONVENTIONAL, HalfExperiment, heave_of, measure
from pneumo_ros.thesis.report import Chapter, Picture, Step, Table, canvas, verdict
from pneumo_ros.thesis.settings import ThesisSettings
from pneumo_ros.workers import run_in_order

STEPS = 2
RUNS: dict[str, HalfExperiment] = {
    **{name: HalfExperiment(name) for name in CONVENTIONAL},
    "passive": HalfExperiment("passive"),
    "default": HalfExperiment("default", {}, VOLUME, False, HEIGHT_ERROR_IN),
    "two_valve": HalfExperiment("two_valve", {}, VOLUME, False, HEIGHT_ERROR_IN),
}


def build(settings: ThesisSettings, step: Step) -> Chapter:
    """The chapter's table, picture and claims."""
    step("passive, skyhook and active rides")
    o = dict(zip(RUNS, run_in_order(measure, [(settings, e) for e in RUNS.values()]), strict=True))
    step("one-third-octave spectra")
    passive, sky = o["conventional passive"], o["conventional skyhook"]
    jerk = iso_1972_limit(2.0) * 2.0 / (iso_1972_limit(1.0) * 1.0)
    speed = iso_1972_limit(32.0) / 32.0 / (iso_1972_limit(16.0) / 16.0)
    claims = [
        verdict(
            "skyhook",
            f"heave rms {passive.heave_rms:.3f} -> {sky.heave_rms:.3f} m/s2",
            sky.heave_rms < passive.heave_rms,
            "springs of Table 3.3 scaled; dampers of ratio 0.25, controllable from 0.05 to 1, sky damper 0.7",
        ),
        verdict(
            "iso-velocity", f"a/f changes by {100 * (speed - 1):.0f} % from 16 to 32 Hz", bool(abs(speed - 1.0) < 0.01)
        ),
        verdict(
            "iso-jerk",
            f"a f grows by a factor {jerk:.2f} from 1 to 2 Hz",
            bool(abs(jerk - 1.0) < 0.01),
            "the limit falls with sqrt(f), not with f: neither jerk nor acceleration is constant",
        ),
    ]
    lead = (
        "The half car over the same roads on its own springs and dampers, with skyhook dampers, on passive air "
        "springs, and "
        "under active control with the rig's sensors, 4 in3 of believed volume and 0.2 in of height error."
    )
    return Chapter(
        2,
        "Ride comfort and baselines",
        lead,
        claims,
        [table("Rides by every criterion", o), _healey_table()],
        [_spectra(settings)],
    )


def _healey_table() -> Table:
    low = 0.0
    rows = []
    for bound, road, rating in HEALEY:
        rows.append([road, f"{low:g} to {bound:g}" if np.isfinite(bound) else f"above {low:g}", rating])
        low = bound
    return Table(
        "Table 2.1: Healey's ratings", ["road", "vertical, rms g", "rating range"], rows, "as the code uses it"
    )


def _spectra(settings: ThesisSettings) -> Picture:
    figure, axes = canvas(1, 1, width=10.0)
    for name, experiment in RUNS.items():
        bands = third_octaves(heave_of(settings, experiment) * LENGTH_SCALE, 1.0 / settings.period)
        axes[0].loglog(bands.centres, bands.rms, "o-", ms=3, label=name)
    f = np.geomspace(1.0, 80.0, 100)
    for hours in (1 / 60, 1.0, 8.0):
        axes[0].loglog(f, iso_1972_limit(f, hours), "k--", lw=0.7)
        axes[0].annotate(f"{hours:.2g} h", (60.0, float(iso_1972_limit(60.0, hours))), fontsize=7)
    axes[0].set(xlabel="Hz", ylabel="m/s2 rms per third octave, full scale", ylim=(1e-2, 50.0))
    axes[0].legend(fontsize=7)
    shown = ", ".join(f"{hours:.3g}" for hours in ISO_1972_HOURS)
    return Picture(
        "Figure 2.3: one-third-octave rms against the 1972 limits", figure, f"tabulated exposures: {shown} h"
    )
