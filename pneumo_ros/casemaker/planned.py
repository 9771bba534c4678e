# SPDX-License-Identifier: Apache-2.0
"""One case before it is made, and what every plan of cases keeps to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumo_ros.casemaker.catalogue import get

GRADES = (1.2, 2.0, 5.0, 20.0)
IMPERFECT_SHARE = 0.35  # of the cases have jitter, lost samples or slower channels
# Effects that are not paired with each other: both move the same number of the same sensor or balance.
SENSOR = ("lvdt_scale", "lvdt_offset", "pressure_scale", "pressure_offset", "pressure_lag")
BALANCE = ("leak", "orifice_coefficient", "valve_deadband", "supply_droop")
LAG = ("valve_lag", "transport_delay")
MASS = ("payload", "cg_shift", "effective_area_error", "pressure_scale", "pressure_offset")
RIVALS = (SENSOR, BALANCE, LAG, MASS, ("coulomb_friction", "bellows_hysteresis", "viscous_damping"))


@dataclass(frozen=True)
class Planned:
    """One case before it is made.

    Attributes
    ----------
    name : folder name
    kind : none, single, pair, several (three to five), unknown (a kind no library has), mixed (known ones and one of
        those) or withheld (a known effect taken from the library)
    effects : (id, side) of each effect in it
    grade : wanted gap over null floor; 0 for none
    withhold : effect ids that the diagnosis must do without
    seed : of everything drawn for it
    imperfect : whether the logger jitters and loses samples
    size : fixed size of the effects; None: searched so that the grade is met
    laws : law of each effect; empty: the first ones, as in the sets up to 0.3
    grades : wanted gap over null floor of each effect alone; empty: ``grade`` for all
    form : whether the rig has an error of its model's form, which its config owns
    budgeted : whether the label carries the true budget and curves
    """

    name: str
    kind: str
    effects: tuple[tuple[str, str | None], ...]
    grade: float
    withhold: tuple[str, ...]
    seed: int
    imperfect: bool
    size: float | None = None
    laws: tuple[str, ...] = ()
    grades: tuple[float, ...] = ()
    form: bool = False
    budgeted: bool = False


def case_prefix(name: str) -> str:
    """What the names of a set's cases begin with: those of a full set are ``full-001`` and on, in its own folder."""
    of_releases = {f"full-0.{release}" for release in range(3, 8)}  # those before kept the number in their names
    return "full" if name in of_releases else name


def drawn_side(name: str, rng: np.random.Generator) -> str | None:
    sides = get(name).sides
    return sides[int(rng.integers(len(sides)))]
