# SPDX-License-Identifier: Apache-2.0
"""More kinds that lie outside every family: what a diagnosis should locate but not name."""

from __future__ import annotations

import numpy as np

from pneumo_ros.casemaker.laws import slots
from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.registry import Applied, outside, sign, with_law

Rng = np.random.Generator
ENDS = ("front", "rear")
BODY = ("body_heave", "body_pitch")
AT_REST = {"front": 0.029, "rear": 0.0207}  # m, height of the body above each axle's datum


@outside("pushes", sides=ENDS)
def pushes(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Somebody leans on the body above an axle: half sines of up to 150 N, 0.1 to 0.4 s long, every 0.9 to 1.6 s."""
    force = 150.0 * size
    changed = with_law(rig, side, slots.EXTERNAL, 1, force, rng.uniform(0.1, 0.4), rng.uniform(0.9, 1.6),
                       rng.uniform(0.0, 6.0))  # fmt: skip
    return Applied(changed, {"force": (force, "N")}, BODY)


@outside("rotor", sides=ENDS)
def rotor(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A machine on the body runs up out of balance: up to 60 N at 2 to 6 Hz, faster by 5 to 10 % a second."""
    force, frequency = 60.0 * size, rng.uniform(2.0, 6.0)
    changed = with_law(rig, side, slots.EXTERNAL, 2, force, 2.0 * np.pi * frequency, rng.uniform(0.05, 0.1))
    return Applied(changed, {"force": (force, "N"), "frequency": (frequency, "Hz")}, BODY)


@outside("wind", sides=ENDS)
def wind(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A fan blows against the body: three tones without a common period from 0.4 to 1.2 Hz up, up to 80 N."""
    force, frequency = 80.0 * size, rng.uniform(0.4, 1.2)
    changed = with_law(rig, side, slots.EXTERNAL, 3, force, 2.0 * np.pi * frequency, 0.0, rng.uniform(0.0, 6.0))
    return Applied(changed, {"force": (force, "N")}, BODY)


@outside("strut_bar", sides=(None,))
def strut_bar(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A bar ties the two struts: a force on their difference of height, up to 6 N/mm."""
    stiffness = 6000.0 * size
    height = rig.front.design_height
    changed = with_law(rig, None, slots.BODY, 2, stiffness, height, height)
    return Applied(changed, {"stiffness": (stiffness, "N/m")}, ("body_pitch", "front_force", "rear_force"))


@outside("ballast_runs_out", sides=(None,))
def ballast_runs_out(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Sand trickles from the body: up to 6 kg over the run."""
    return Applied(with_law(rig, None, slots.BODY, 3, 6.0 * size), {"mass": (6.0 * size, "kg")}, BODY)


@outside("channel_crosstalk", sides=ENDS)
def channel_crosstalk(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A body LVDT picks up as much as 35 % of its neighbour's signal."""
    share, other = 0.35 * size * sign(rng), "rear" if side == "front" else "front"
    changed = with_law(rig, side, slots.CROSS, 1, share, AT_REST[other])
    return Applied(changed, {"share": (share, "1")}, (f"sensor:sprung_{side}",))


@outside("clipped_gauge", sides=ENDS)
def clipped_gauge(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """An amplifier that saturates: nothing above a pressure, down to 20 kPa below the one at rest."""
    limit = getattr(rig, str(side)).reference_pressure + 50e3 - 70e3 * size
    return Applied(with_law(rig, side, slots.GAUGE, 5, 0.0, 0.0, limit), {"limit": (limit, "Pa")},
                   (f"sensor:{side}_pressure",))  # fmt: skip
