# SPDX-License-Identifier: Apache-2.0
"""Section 6.7: the half car under first order SMFLC with estimator, exact as in the thesis and with real sensors."""

from __future__ import annotations

from collections.abc import Mapping

from pneumo_ros.parameters import Value
from pneumo_ros.rig.channels import PITCH
from pneumo_ros.thesis.half import HalfExperiment, HalfOutcome, measure, run
from pneumo_ros.thesis.report import Claim, Picture, Step, Table, canvas, verdict
from pneumo_ros.thesis.settings import ThesisSettings
from pneumo_ros.units import DEGREE, INCH, SQUARE_INCH
from pneumo_ros.workers import run_in_order

STEPS = 2
VOLUME: dict[str, Value] = {"volume_estimate_in3": 4.0}  # Section 6.7.5
HEIGHT_ERROR_IN = 0.2
TWICE: dict[str, Value] = {"mass_scale": 2.0}


def experiments(settings: ThesisSettings) -> dict[str, HalfExperiment]:
    """The runs of Section 6.7.5."""
    exact: dict[str, Value] = {"forgetting": settings.estimator_bandwidth}
    return {
        "passive": HalfExperiment("passive"),
        "thesis, exact": HalfExperiment("thesis", exact, VOLUME, True, HEIGHT_ERROR_IN),
        "thesis, payload": HalfExperiment("thesis", {**exact, **TWICE}, {**VOLUME, **TWICE}, True, HEIGHT_ERROR_IN),
        "thesis, sensors": HalfExperiment("thesis", {}, VOLUME, False, HEIGHT_ERROR_IN),
        "default, sensors": HalfExperiment("default", {}, VOLUME, False, HEIGHT_ERROR_IN),
    }


def build_half(settings: ThesisSettings, step: Step) -> tuple[list[Claim], list[Table], list[Picture]]:
    """Claims, tables and pictures of Section 6.7."""
    step("half car: controllers and estimator")
    runs = experiments(settings)
    outcomes = dict(zip(runs, run_in_order(measure, [(settings, e) for e in runs.values()]), strict=True))
    step("half car: time histories")
    return claims(outcomes), [table("Half car, class D road", outcomes)], [_picture(settings, runs["thesis, exact"])]


def claims(o: Mapping[str, HalfOutcome]) -> list[Claim]:
    """The claims of Section 6.7.5 from the outcomes of :func:`experiments`."""
    thesis, payload, passive = o["thesis, exact"], o["thesis, payload"], o["passive"]
    front, rear = thesis.inlet_rms_in2
    heavy = payload.inlet_rms_in2
    change = payload.heave_rms / thesis.heave_rms - 1.0
    tyres = payload.tyre_variation / thesis.tyre_variation - 1.0
    lowest = 100 * (1 - max(a.heave_rms / b.heave_rms for a, b in zip(thesis.rides, passive.rides, strict=True)))
    tuned = o["default, sensors"]
    least = 100 * (1 - max(a.heave_rms / b.heave_rms for a, b in zip(tuned.rides, passive.rides, strict=True)))
    return [
        verdict(
            "half-comfort",
            (
                f"{thesis.rides[0].full_scale_heave_rms / 9.81:.2f} g full scale, MPR {thesis.rating:.1f}; "
                f"{lowest:.0f} % below passive on the worst road"
            ),
            thesis.rating > 4.0,
            (
                "a class D road at 80 km/h gives 0.9 g passive at full scale: a 2M2A at 1.8 in is a stiff spring (3.5 "
                "Hz), and "
                "MPR ends at 0.14 g; relative to passive the ride is good"
            ),
        ),
        verdict(
            "half-default",
            f"at least {least:.0f} % lower heave rms, road by road",
            least >= 45.0,
            "K_s 5000 in/s3 and a floor of 1 in2 on the area, see pneumo_ros.control.half_car",
        ),
        verdict(
            "half-rear-tyre",
            f"{thesis.tyre_mean[0]:.0f} N and {thesis.tyre_mean[1]:.0f} N",
            thesis.tyre_mean[1] > thesis.tyre_mean[0],
        ),
        verdict(
            "half-rear-valve",
            f"rms {front:.4f} and {rear:.4f} in2",
            rear > front,
            (
                "at trim and with the default gains the rear opens more; with the printed K_s the front one hits its "
                "limit"
                if rear <= front
                else ""
            ),
        ),
        verdict(
            "half-valve",
            f"fully open {100 * thesis.saturated:.1f} % of the time (default gains: {100 * tuned.saturated:.2f} %)",
            thesis.saturated < 0.001,
            "the wanted pressure rate is F'/A, and the area vanishes at 2.2 in; the default gains put a floor under it",
        ),
        verdict(
            "half-estimator",
            f"{thesis.area_error_in2:.3f} in2 exact, {tuned.area_error_in2:.3f} in2 with the rig's sensors",
            thesis.area_error_in2 < 0.05,
        ),
        verdict("half-payload", f"{100 * change:+.1f} %", abs(change) < 0.05),
        verdict("half-payload-tyre", f"{100 * tyres:+.1f} %", abs(tyres) < 0.05),
        verdict(
            "half-payload-inlet",
            f"front {100 * (heavy[0] / front - 1):+.0f} %, rear {100 * (heavy[1] / rear - 1):+.0f} %",
            heavy[0] > front and heavy[1] > rear,
            "believed mass and area grow together and cancel (Eq. 6.57); a car that is really heavier needs more",
        ),
    ]


def table(title: str, o: Mapping[str, HalfOutcome]) -> Table:
    """Ride, tyres, travel and valves of half-car runs."""
    header = [
        "run",
        "heave rms, m/s2",
        "per road",
        "pitch rms, rad/s2",
        "full scale, g",
        "MPR",
        "Wk, m/s2",
        "1972 limit, h",
        "Janeway, x limit",
        "Healey",
        "tyre load variation",
        "travel, in",
        "area error, in2",
        "inlet rms front | rear, in2",
    ]
    rows = [
        [
            name,
            f"{x.heave_rms:.3f}",
            f"{min(r.heave_rms for r in x.rides):.2f} to {max(r.heave_rms for r in x.rides):.2f}",
            f"{x.pitch_rms:.2f}",
            f"{x.heave_rms * 5 / 9.81:.3f}",
            f"{x.rating:.1f}",
            f"{x.weighted:.2f}",
            f"{x.hours:.2f}",
            f"{x.janeway:.1f}",
            x.healey,
            f"{x.tyre_variation:.3f}",
            f"{x.workspace_in:.2f}",
            f"{x.area_error_in2:.3f}",
            f"{x.inlet_rms_in2[0]:.4f} | {x.inlet_rms_in2[1]:.4f}",
        ]
        for name, x in o.items()
    ]
    note = (
        "accelerations of the rig; full scale = rig x 5; 1972 limit: longest exposure within fatigue-decreased "
        "proficiency; "
        "Janeway: worst third octave over its limit"
    )
    return Table(title, header, rows, note)


def _picture(settings: ThesisSettings, experiment: HalfExperiment) -> Picture:
    figure, axes = canvas(2, 2, width=12.0)
    active, passive = run(settings, experiment, 1), run(settings, HalfExperiment("passive"), 1)
    for name, r in (("passive", passive), ("SMFLC with estimator", active)):
        axes[0].plot(r.times, (r.states[:, 0] - r.states[0, 0]) / INCH, lw=0.8, label=name)
        axes[1].plot(r.times, (r.states[:, PITCH] - r.states[0, PITCH]) / DEGREE, lw=0.8)
    axes[2].plot(active.times[:-1], active.commands[:, :2] / SQUARE_INCH, lw=0.8, label=["front", "rear"])
    axes[3].plot(active.times[:-1], active.estimates[:, 14:] / SQUARE_INCH, lw=0.8, label=["front", "rear"])
    for axis, label in zip(
        axes, ("heave, in", "pitch (nose up), deg", "inlet, in2", "estimated area, in2"), strict=True
    ):
        axis.set(xlabel="s", ylabel=label)
    for axis in (axes[0], axes[2], axes[3]):
        axis.legend(fontsize=7)
    return Picture("Figures 6.26 to 6.29: the half car", figure, "printed gains, exact accelerations, seed 1")
