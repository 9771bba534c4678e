# SPDX-License-Identifier: Apache-2.0
"""Chapter 3: Pi-numbers by linear algebra, the scaling laws, and the Honda Civic brought to the rig's size."""

from __future__ import annotations

import csv
from fractions import Fraction

from pneumo_ros.paths import share_file
from pneumo_ros.plant.air_spring import MEAN_AREA, VOLUME_OFFSET
from pneumo_ros.thesis.chapter5 import read_table
from pneumo_ros.thesis.models.similitude import (
    BASE,
    DIMENSIONS,
    HONDA_CIVIC,
    Powers,
    pi_number,
    representative_pi_numbers,
)
from pneumo_ros.thesis.report import Chapter, Claim, Step, Table, verdict
from pneumo_ros.thesis.settings import ThesisSettings
from pneumo_ros.thesis.similitude_proof import difference, laws_of
from pneumo_ros.units import ATMOSPHERE, INCH, POUND_FORCE, PSI, SQUARE_INCH

STEPS = 1
LB_PER_IN = POUND_FORCE / INCH  # N/m

# Printed forms of Eqs. 3.31-3.34: powers of length, mass, frequency.
PRINTED: dict[str, tuple[int, int, int]] = {
    "stiffness": (0, -1, -2),
    "damping": (0, -1, -1),
    "force": (-1, -1, -2),
    "inertia": (-2, -1, 0),
}


def build(settings: ThesisSettings, step: Step) -> Chapter:
    """The chapter's tables and claims."""
    step("similitude of the conventional half car")
    tables = [_dimension_table(), _pi_table(), _variable_table(), _civic_table()]
    claims = [_pi_claim(), _law_claim(), _similar_claim(), _civic_claim(), _index_claim(), _stiffness_claim()]
    lead = (
        "Pi-numbers come from the dimensional table by linear algebra; scale factors are length 5, mass 12, time 1 "
        "(Eqs. 3.51-3.54). Gravity drops out of the conventional half car, because its motion is counted from rest."
    )
    return Chapter(3, "Similitude model of the Honda Civic", lead, claims, tables)


def in_words(powers: Powers) -> str:
    """A Pi-number as text, for example stiffness / (mass frequency^2)."""

    def term(name: str, power: Fraction) -> str:
        return name if abs(power) == 1 else f"{name}^{abs(power)}"

    over = " ".join(term(n, p) for n, p in powers.items() if p > 0)
    under = " ".join(term(n, p) for n, p in powers.items() if p < 0)
    return f"{over} / ({under})" if under else over


def read_car(name: str) -> dict[str, tuple[float, str]]:
    """A car's table as {name: (value in SI, quantity)}."""
    with share_file("config", "tables", name).open(newline="", encoding="utf-8") as handle:
        return {row["name"]: (float(row["value"]), row["quantity"]) for row in csv.DictReader(handle)}


def _dimension_table() -> Table:
    shown = ("length", "mass", "frequency", "stiffness", "damping", "inertia", "force", "pressure", "gas_constant")
    rows = [[name, *[str(power) for power in DIMENSIONS[name]]] for name in shown]
    return Table(
        "Table 3.1: dimensional table",
        ["quantity", *BASE],
        rows,
        "one row a kind of quantity; powers of the base units",
    )


def _variable_table() -> Table:
    units = {
        "displacement": "length",
        "velocity": "velocity",
        "acceleration": "acceleration",
        "angular velocity": "frequency",
    }
    rows = []
    for name, kind in units.items():
        divisor = pi_number(kind)
        divisor.pop(kind, None)
        rows.append([name, f"{name} / ({in_words({n: -p for n, p in divisor.items()}) or kind})"])
    return Table(
        "Table 3.2: dimensionless variables", ["variable", "made dimensionless"], rows, "same primary quantities"
    )


def _pi_table() -> Table:
    rows = [[name, in_words(powers)] for name, powers in representative_pi_numbers().items()]
    return Table(
        "Eqs. 3.31 to 3.34: representative Pi-numbers", ["of", "Pi-number"], rows, "primary: length, mass, frequency"
    )


def _pi_claim() -> Claim:
    found = representative_pi_numbers()
    same = sum(
        tuple(int(found[name].get(q, Fraction(0))) for q in ("length", "mass", "frequency")) == powers
        for name, powers in PRINTED.items()
    )
    return verdict("pi-numbers", f"{same} of 4 the same", same == 4, "derived by linear algebra")


def _law_claim() -> Claim:
    f = HONDA_CIVIC.factor
    values = {q: f(q) for q in ("mass", "stiffness", "damping", "force")}
    return verdict(
        "scale-factors",
        ", ".join(f"{v:g}" for v in values.values()),
        values["mass"] == values["stiffness"] == values["damping"] and values["force"] == 60.0,
    )


def _similar_claim() -> Claim:
    kept = max(difference("conventional half car", HONDA_CIVIC))
    broken = {law: difference("conventional half car", HONDA_CIVIC, law)[0] for law in laws_of("conventional half car")}
    return verdict(
        "conventional-similar",
        f"differ by {kept:.0e} std; by {min(broken.values()):.2f} std once a law is broken by 10 %",
        kept < 1e-6 < min(broken.values()),
        "Eqs. 3.33-3.42 as printed mix signs of pitch and swap damping with stiffness numbers; corrected",
    )


def _civic_table() -> Table:
    civic, rig = read_car("table_3_3_honda_civic.csv"), read_car("table_3_4_half_car.csv")
    half = civic["curb_weight"][0] / 2.0
    rows = [
        _row("body of the half car, kg", HONDA_CIVIC.down(half, "mass"), rig["sprung_mass"][0], "half the curb "
        "weight / 12"),
        _row("wheelbase, m", HONDA_CIVIC.down(civic["wheelbase"][0], "length"), rig["wheelbase"][0], "/ 5"),
        _row("width, m", HONDA_CIVIC.down(civic["width"][0], "length"), rig["width"][0], "/ 5"),
        _row("front spring, lb/in", HONDA_CIVIC.down(civic["front_spring_stiffness"][0], "stiffness") / LB_PER_IN,
            70.0, "/ 12"),
        _row("rear spring, lb/in", HONDA_CIVIC.down(civic["rear_spring_stiffness"][0], "stiffness") / LB_PER_IN,
            70.0, "/ 12"),
    ]  # fmt: skip
    return Table("Tables 3.3 and 3.4: the Civic brought down", ["quantity", "scaled", "printed", "how"], rows)


def _row(name: str, ours: float, printed: float, how: str) -> list[str]:
    return [name, f"{ours:.4g}", f"{printed:.4g}", how]


def _civic_claim() -> Claim:
    civic, rig = read_car("table_3_3_honda_civic.csv"), read_car("table_3_4_half_car.csv")
    mass = HONDA_CIVIC.down(civic["curb_weight"][0] / 2.0, "mass")
    length = HONDA_CIVIC.down(civic["wheelbase"][0], "length")
    share = rig["rear_arm"][0] / (rig["front_arm"][0] + rig["rear_arm"][0])
    return verdict(
        "civic",
        f"{mass:.2f} kg, {length:.3f} m, {100 * share:.0f} % on the front axle",
        (
            abs(mass / rig["sprung_mass"][0] - 1.0) < 0.01
            and abs(length / rig["wheelbase"][0] - 1.0) < 0.05
            and share > 0.5
        ),
        "mass and wheelbase agree; a > b puts the weight on the rear, against Table 3.3 (errata 14)",
    )


def dynamic_index(inertia: float, mass: float, front_arm: float, rear_arm: float) -> float:
    """r^2/(a b) of Eq. 2.2: 1 uncouples front and rear."""
    return inertia / (mass * front_arm * rear_arm)


def _index_claim() -> Claim:
    rig = read_car("table_3_4_half_car.csv")
    mass, a, b = rig["sprung_mass"][0], rig["front_arm"][0], rig["rear_arm"][0]
    ours, printed = dynamic_index(rig["pitch_inertia"][0], mass, a, b), dynamic_index(7513e-6, mass, a, b)
    return verdict(
        "dynamic-index",
        f"{ours:.3f}",
        0.9 <= ours <= 1.0,
        f"with Table 3.4's inertia as 25.65 lbf in s2; as printed (lb in2) it would be {printed:.4f} (errata 1)",
    )


def _stiffness_claim() -> Claim:
    """Stiffness at 10 psig and 1.7 in from Tables 4.1 and 5.2: gas and area share (n = 1.4)."""
    heights, names, areas = read_table("table_5_2_effective_area_in2.csv")
    column, gauge, height = areas[:, names.index("10_psig")], 10.0 * PSI, 1.7 * INCH
    low, high = list(heights).index(1.6), list(heights).index(1.8)
    area = 0.5 * (column[low] + column[high]) * SQUARE_INCH
    slope = (column[high] - column[low]) / 0.2 * SQUARE_INCH / INCH
    volume = VOLUME_OFFSET + MEAN_AREA * height
    gas = 1.4 * (gauge + ATMOSPHERE) * MEAN_AREA / volume * area / LB_PER_IN
    shape = -gauge * slope / LB_PER_IN
    return verdict(
        "spring-stiffness",
        f"{gas + shape:.0f} lb/in ({gas:.0f} of the gas, {shape:.0f} of the area)",
        abs((gas + shape) / 80.0 - 1.0) < 0.15,
        "the gas alone is softer, the area of Table 5.2 adds as much again; how 80 was calculated is not said",
    )
