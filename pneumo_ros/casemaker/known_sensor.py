# SPDX-License-Identifier: Apache-2.0
"""Effects of the contract that act on what the sensors say. A closed loop carries them into the rig as well."""

from __future__ import annotations

import numpy as np

from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.registry import QUICKEST, Applied, at_ends, effect, ends_of, sign

Rng = np.random.Generator
ENDS = ("front", "rear")


def _pressure_places(side: str | None) -> tuple[str, ...]:
    return tuple(f"sensor:{end}_pressure" for end in ends_of(side))


@effect("lvdt_scale", law="scale", sides=ENDS, comparable=True)
def lvdt_scale(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """One LVDT (body or axle) shows up to 12 % too much or too little."""
    part, factor = str(rng.choice(["sprung", "unsprung"])), 1.0 + 0.12 * size * sign(rng)
    changed = at_ends(rig, side, **{f"{part}_scale": factor})
    return Applied(changed, {"scale": (factor, "1")}, (f"sensor:{part}_{side}",))


@effect("lvdt_offset", law="offset", sides=ENDS, comparable=True)
def lvdt_offset(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """One LVDT (body or axle) is shifted by up to 3 mm."""
    part, shift = str(rng.choice(["sprung", "unsprung"])), 3e-3 * size * sign(rng)
    return Applied(at_ends(rig, side, **{f"{part}_offset": shift}), {"offset": (shift, "m")},
                   (f"sensor:{part}_{side}",))  # fmt: skip


@effect("pressure_scale", law="scale", comparable=True)
def pressure_scale(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A pressure sensor shows up to 10 % too much or too little of the absolute pressure."""
    factor = 1.0 + 0.1 * size * sign(rng)
    return Applied(at_ends(rig, side, pressure_scale=factor), {"scale": (factor, "1")}, _pressure_places(side))


@effect("pressure_offset", law="offset", comparable=True)
def pressure_offset(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A pressure sensor is shifted by up to 40 kPa."""
    shift = 40e3 * size * sign(rng)
    return Applied(at_ends(rig, side, pressure_offset=shift), {"offset": (shift, "Pa")}, _pressure_places(side))


@effect("pressure_lag", law="second_order", comparable=True)
def pressure_lag(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A long gauge line: second order, up to 60 ms late."""
    late, ratio = max(0.06 * size, QUICKEST), rng.uniform(0.7, 1.2)
    changed = at_ends(rig, side, pressure_frequency=2.0 * ratio / late, pressure_damping=ratio)
    return Applied(changed, {"lag": (late, "s")}, _pressure_places(side))
