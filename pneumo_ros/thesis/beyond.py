# SPDX-License-Identifier: Apache-2.0
"""Beyond the thesis: dA/dt fed forward and both valves commanded, against the thesis's controller; and the limit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pneumo_ros.rig import LIMITS
from pneumo_ros.road import iso_psd
from pneumo_ros.thesis.chapter6_half import HEIGHT_ERROR_IN, VOLUME, table
from pneumo_ros.thesis.half import HalfExperiment, HalfOutcome, measure, nominal
from pneumo_ros.thesis.report import Chapter, Claim, Step, Table, verdict
from pneumo_ros.thesis.settings import ThesisSettings
from pneumo_ros.units import KMH
from pneumo_ros.workers import run_in_order

STEPS = 3
SIGMAS = 3.0  # how far the true rig is off, in the tolerances of rig.yaml
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of dA/dt fed forward
RUNS: dict[str, HalfExperiment] = {
    name: HalfExperiment(name, {}, VOLUME, False, HEIGHT_ERROR_IN)
    for name in ("thesis", "default", "area_rate_feedforward", "two_valve")
}
LATE = ", one period late"
RUNS |= {
    f"{name}{LATE}": HalfExperiment(name, {}, VOLUME, False, HEIGHT_ERROR_IN, delay=1)
    for name in ("thesis", "default", "two_valve")
}
WANTED = 0.30  # share by which heave rms is to fall against the thesis's controller


def build(settings: ThesisSettings, step: Step) -> Chapter:
    """The comparison and what bounds it."""
    step("area rate feedforward and two valves")
    o = dict(zip(RUNS, run_in_order(measure, [(settings, e) for e in RUNS.values()]), strict=True))
    lead = (
        "The thesis takes dA/dt as zero and commands the inlets alone. With the 2M2A's surface known, the estimator "
        "finds "
        "the error of the read height instead of the area, accelerations follow from pressures and areas without a "
        "differentiator's lag, and dA/dt can be fed forward. All runs: the rig's sensors, volume believed 4 in3, "
        "heights "
        "read 0.2 in too large, the same valve limits."
    )
    step("how much of dA/dt to feed forward")
    shares = _share_table(settings)
    step("a rig that is off by three tolerances")
    off = _off_table(settings)
    claims = [*_claims(o), _limit_claim(settings, o["two_valve"])]
    return Chapter(7, "Beyond the thesis", lead, claims, [table("Half car, beyond the thesis", o), shares, off])


def reductions(better: HalfOutcome, base: HalfOutcome) -> list[float]:
    """Share by which heave rms falls, road by road."""
    return [1.0 - a.heave_rms / b.heave_rms for a, b in zip(better.rides, base.rides, strict=True)]


def _share_table(settings: ThesisSettings) -> Table:
    """Heave rms, and how often a valve is at a limit, over the share of dA/dt fed forward: the measured optimum."""
    names = ("area_rate_feedforward", "two_valve")
    runs = [
        HalfExperiment(name, {}, {**VOLUME, "area_rate_share": share}, False, HEIGHT_ERROR_IN)
        for name in names
        for share in SHARES
    ]
    o = run_in_order(measure, [(settings, e) for e in runs])
    rows = []
    for i, name in enumerate(names):
        part = o[i * len(SHARES) : (i + 1) * len(SHARES)]
        rows.append([f"{name}: heave rms, m/s2", *[f"{x.heave_rms:.3f}" for x in part]])
        rows.append([f"{name}: tyre load variation", *[f"{x.tyre_variation:.3f}" for x in part]])
        rows.append([f"{name}: inlet shut, % of the time", *[f"{100 * x.shut:.0f}" for x in part]])
    note = (
        "one valve spends its time shut, waiting for the constant outlet to empty the spring; two valves fill and "
        "empty by "
        "turns, until near full extension no area is left to act on and the axle, freed of the spring, resonates"
    )
    return Table("Share of dA/dt fed forward", ["", *[f"{share:g}" for share in SHARES]], rows, note)


def perturbations() -> dict[str, dict[str, float]]:
    """The rig with one parameter off by three of its tolerances, either way."""
    rig, out = nominal()[0], {}
    for name in LIMITS:
        quantity = getattr(rig, name)
        if quantity.std > 0.0 and not name.startswith("outlet"):  # outlets are commanded
            for sign in (-1.0, 1.0):
                out[f"{name} {sign * SIGMAS:+g} std"] = {name: quantity.value + sign * SIGMAS * quantity.std}
    return out


def _off_table(settings: ThesisSettings) -> Table:
    names, cases = ("passive", "thesis", "default", "two_valve"), {"nominal": {}, **perturbations()}
    runs = [HalfExperiment(n, {}, VOLUME, False, HEIGHT_ERROR_IN, off=case) for case in cases.values() for n in names]
    o = run_in_order(measure, [(settings, e) for e in runs])
    rows = [
        [case, *[f"{x.heave_rms:.3f}" for x in o[i * len(names) : (i + 1) * len(names)]]]
        for i, case in enumerate(cases)
    ]
    note = "heave rms, m/s2; the controllers and estimators keep the nominal rig's numbers"
    return Table("When the rig is not the nominal one", ["the true rig", *names], rows, note)


def _claims(o: Mapping[str, HalfOutcome]) -> list[Claim]:
    out = []
    for name in ("two_valve", "two_valve, one period late", "area_rate_feedforward"):
        late = LATE if name.endswith(LATE) else ""
        for base in (f"thesis{late}", f"default{late}"):
            falls = reductions(o[name], o[base])
            tyre = o[name].tyre_variation / o[base].tyre_variation
            out.append(
                Claim(
                    f"{name} over {base}",
                    "7.2",
                    f"{name}: at least 30 % lower heave rms than {base}, every road, tyre load no worse",
                    "-",
                    f"{100 * min(falls):.0f} to {100 * max(falls):.0f} % lower, tyre load variation "
                    f"{100 * (tyre - 1):+.0f} %",
                    min(falls) >= WANTED and tyre <= 1.0,
                    _why(name, base) if min(falls) < WANTED else "",
                )
            )
    return out


def _why(name: str, base: str) -> str:
    if name == "area_rate_feedforward":
        return "one valve and a constant outlet empty the spring at 2e6 Pa/s at most; more of dA/dt drives it there"
    return (
        "what is left lies around the axle's frequency, where no suspension can act: see the limit"
        if base.startswith("default")
        else ""
    )


def invariant_density(settings: ThesisSettings) -> tuple[float, float]:
    """Axle frequency, Hz, and the body's acceleration density there, (m/s2)^2/Hz of the rig, whatever the suspension.

    At w^2 = k_t/m_u the axle's inertia and its tyre's restoring force cancel, so m_s z_s'' = k_t z_r summed over axles:
    no force between body and axle appears.
    """
    rig, car = nominal()
    frequency = float(np.sqrt(rig.tyre_stiffness_front.value / rig.unsprung_mass_front.value)) / (2.0 * np.pi)
    road = float(iso_psd(frequency, settings.iso_class, settings.speed_kmh * KMH)) / 25.0
    delay = settings.road(1).rear_delay
    both = abs(1.0 + np.exp(-2j * np.pi * frequency * delay)) ** 2
    return frequency, float(both) * (car.body.tyre_stiffness_front / car.body.sprung_mass) ** 2 * road


def _limit_claim(settings: ThesisSettings, best: HalfOutcome) -> Claim:
    frequency, density = invariant_density(settings)
    share = np.sqrt(4.0 * density)
    return verdict(
        "invariant-point",
        (
            f"{density:.3f} (m/s2)2/Hz at {frequency:.2f} Hz; 4 Hz of that level make {share:.2f} m/s2 (two_valve: "
            f"{best.heave_rms:.2f})"
        ),
        True,
        "m_s z_s'' = k_t z_r there: only tyre, axle mass or axle damping to the ground could change it",
    )
