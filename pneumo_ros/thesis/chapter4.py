# SPDX-License-Identifier: Apache-2.0
"""Chapter 4: the pneumatic cars and their similitude; what the laws ask of gravity and the atmosphere."""

from __future__ import annotations

import math

from pneumo_ros.plant.air_spring import effective_area, load_surface, spring_volume
from pneumo_ros.thesis.chapter5 import read_table
from pneumo_ros.thesis.models.similitude import HONDA_CIVIC, Scales
from pneumo_ros.thesis.report import Chapter, Claim, Step, Table, verdict
from pneumo_ros.thesis.settings import ThesisSettings
from pneumo_ros.thesis.similitude_proof import SYSTEMS, difference, laws_of
from pneumo_ros.units import (
    ATMOSPHERE,
    CUBIC_INCH,
    INCH,
    POUND_FORCE,
    POUND_MASS,
    PSI,
    SQUARE_INCH,
    psig_to_pa_absolute,
)

STEPS = 3
PNEUMATIC = SYSTEMS[1:]
OTHER = Scales(length=3.0, mass=7.0, time=0.5, temperature=1.2)  # nothing equal to one, to try the general laws


def build(settings: ThesisSettings, step: Step) -> Chapter:
    """The chapter's tables and claims."""
    step("similitude with all laws kept")
    kept = {name: (max(difference(name, HONDA_CIVIC)), max(difference(name, OTHER))) for name in PNEUMATIC}
    step("similitude with one law broken")
    broken = {name: {law: difference(name, HONDA_CIVIC, law)[0] for law in laws_of(name)} for name in PNEUMATIC}
    step("scaling laws")
    tables = [_volume_table(), _stiffness_table(), _kept_table(kept), _broken_table(broken)]
    claims = [
        _laws_claim(),
        *[_similar_claim(name, kept[name]) for name in PNEUMATIC],
        _nature_claim(broken["half car"]),
    ]
    lead = (
        "Full-scale and scaled cars and the equations in Pi-numbers are simulated over one bumpy road while the "
        "inlets open "
        "to three times trim; differences are in standard deviations of each state."
    )
    return Chapter(4, "Nonlinear model of pneumatic suspensions", lead, claims, tables)


def _volume_table() -> Table:
    heights, _, values = read_table("table_4_1_firestone_2m2a.csv")
    rows = []
    for height, volume in zip(heights, values[:, 0], strict=True):
        ours = float(spring_volume(height * INCH)) / CUBIC_INCH
        rows.append([f"{height:g}", f"{ours:.3f} | {volume:g}"])
    return Table(
        "Table 4.1: volume, in3", ["height, in", "V(h) used here | printed"], rows, "least squares line, errata 6"
    )


def stiffness_lb_in(gauge_psig: float) -> float:
    """Adiabatic stiffness of the plant's air spring at 1.8 in, lb/in, sealed: gas, area and their product."""
    surface, height, step = load_surface(), 1.8 * INCH, 1e-5

    def force(h: float) -> float:
        pressure = psig_to_pa_absolute(gauge_psig) * (spring_volume(height) / spring_volume(h)) ** 1.4
        gauge = pressure - ATMOSPHERE
        return gauge * float(effective_area(h, gauge, surface))

    return (force(height - step) - force(height + step)) / (2.0 * step) * INCH / POUND_FORCE


def _stiffness_table() -> Table:
    pressures, _, values = read_table("table_4_2_firestone_dynamic.csv")
    rows = []
    for gauge, row in zip(pressures, values, strict=True):
        load = gauge * float(effective_area(1.8 * INCH, gauge * PSI, load_surface())) / SQUARE_INCH
        ours = stiffness_lb_in(float(gauge))
        hertz = math.sqrt(ours * POUND_FORCE / INCH / (load * POUND_MASS)) / (2.0 * math.pi)
        rows.append(
            [f"{gauge:g}", f"{load:.0f} | {row[0]:g}", f"{ours:.0f} | {row[1]:g}", f"{hertz:.2f} | {row[-1]:g}"]
        )
    note = (
        "the plant's surface is the thesis's measured one (bellows free to balloon, Table 5.2, continued); the "
        "catalogue's is "
        "for bellows that roll over the plate: it carries more and is softer for its load"
    )
    header = ["pressure, psig", "load, lb", "spring rate, lb/in", "natural frequency, Hz"]
    return Table("Table 4.2: at 1.8 in, here | printed", header, rows, note)


def _kept_table(kept: dict[str, tuple[float, float]]) -> Table:
    rows = [[name, f"{civic:.0e}", f"{other:.0e}"] for name, (civic, other) in kept.items()]
    header = ["system", "C_L 5, C_m 12", "C_L 3, C_m 7, C_T 0.5, C_Te 1.2"]
    return Table(
        "Largest difference with every law kept, std", header, rows, "full scale brought down, and Pi-numbers alone"
    )


def _broken_table(broken: dict[str, dict[str, float]]) -> Table:
    laws = list(broken["half car"])
    rows = [[name, *[f"{broken[name][law]:.2f}" for law in laws]] for name in broken]
    return Table(
        "Largest difference with one law broken, std", ["system", *laws], rows, "by 10 % unless it says otherwise"
    )


def _laws_claim() -> Claim:
    s = HONDA_CIVIC
    printed = {"pressure": s.mass / s.length, "stiffness": s.mass, "damping": s.mass}
    same = all(math.isclose(s.factor(name), value) for name, value in printed.items())
    diameter = math.sqrt(s.orifice_area)
    return verdict(
        "pneumatic-laws",
        f"{s.factor('pressure'):g}, {s.factor('stiffness'):g}, {diameter:.2f}, {s.factor('damping'):g}",
        same and math.isclose(diameter, s.length**1.5),
        printed=f"{s.mass / s.length:g}, {s.mass:g}, {s.length**1.5:.2f}, {s.mass:g}",
    )


def _similar_claim(name: str, kept: tuple[float, float]) -> Claim:
    equations = {"air spring": "Eq. 4.42", "quarter car": "Eq. 4.61", "half car": "Eq. 4.76"}[name]
    return Claim(
        f"{name.replace(' ', '-')}-similar",
        equations,
        f"{name}: equal Pi-numbers make full scale and scaled model one",
        "similar",
        f"differ by {max(kept):.0e} std",
        max(kept) < 1e-6,
        "with gravity and the atmosphere scaled as well: see the next claim",
    )


def _nature_claim(broken: dict[str, float]) -> Claim:
    gravity, air = broken["gravity not scaled"], broken["atmosphere not scaled"]
    return verdict(
        "laws-sufficient",
        f"differ by {gravity:.0f} std with gravity as it is, {air:.1f} std with the atmosphere as it is",
        False,
        (
            "Eq. 4.37 hides g in the acceleration and P2*A hides the atmosphere: g would have to scale with C_L/C_T2 = "
            "5 and "
            "the atmosphere with C_P = 2.4 (errata 18)"
        ),
    )
