# SPDX-License-Identifier: Apache-2.0
"""Kinds that no list of effects contains: what a diagnosis should call unknown rather than by a wrong name."""

from __future__ import annotations

import numpy as np

from pneumo_ros.casemaker.known_air import NOMINAL_OPENING
from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.registry import Applied, at_ends, effect, in_frame, places_of, sign

Rng = np.random.Generator
ENDS = ("front", "rear")


@effect("rod_end_backlash", known=False, sides=ENDS)
def rod_end_backlash(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Play of up to 2 mm in the rod end between body and LVDT: the sensor stays where it was on every reversal."""
    return Applied(at_ends(rig, side, sprung_play=1e-3 * size), {"play": (2e-3 * size, "m")},
                   (f"sensor:sprung_{side}",))  # fmt: skip


@effect("valve_crosstalk", known=False, sides=ENDS)
def valve_crosstalk(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Up to 60 % of the other valve's movement appears on this one (shared manifold, coupled solenoids)."""
    share = 0.6 * size * sign(rng)
    return Applied(at_ends(rig, side, crosstalk=share), {"share": (share, "1")}, places_of(side, "air"))


@effect("valve_stiction", known=False)
def valve_stiction(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The spool holds until the command has moved by up to 60 % of the opening at rest, then jumps to it."""
    band = 0.6 * NOMINAL_OPENING * size
    return Applied(at_ends(rig, side, valve_stick=band), {"band": (band, "m2")}, places_of(side, "air"))


@effect("valve_slew", known=False)
def valve_slew(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The spool moves no faster than the whole opening at rest in up to 0.6 s."""
    time = 0.6 * size
    return Applied(at_ends(rig, side, valve_slew=NOMINAL_OPENING / time), {"time": (time, "s")},
                   places_of(side, "air"))  # fmt: skip


@effect("wheel_imbalance", known=False, sides=ENDS)
def wheel_imbalance(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A rotating force of up to 60 N on the axle at 4 to 12 Hz."""
    force, frequency = 60.0 * size, rng.uniform(4.0, 12.0)
    changed = at_ends(rig, side, imbalance=force, imbalance_frequency=2.0 * np.pi * frequency,
                      imbalance_phase=rng.uniform(0.0, 2.0 * np.pi))  # fmt: skip
    return Applied(changed, {"force": (force, "N"), "frequency": (frequency, "Hz")}, places_of(side, "tyre"))


@effect("base_resonance", known=False, sides=(None,))
def base_resonance(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The exciter stands on a frame that rings at 4 to 14 Hz under the tyres' load; up to 3 um/N."""
    frequency = 2.0 * np.pi * rng.uniform(4.0, 14.0)
    compliance = 3e-6 * size
    changed = in_frame(rig, base_mass=1.0 / (compliance * frequency**2), base_frequency=frequency,
                       base_damping=rng.uniform(0.03, 0.1))  # fmt: skip
    return Applied(changed, {"compliance": (compliance, "m/N"), "frequency": (frequency / 2.0 / np.pi, "Hz")},
                   ("road_input", "front_tyre", "rear_tyre"))  # fmt: skip


@effect("outlet_icing", known=False)
def outlet_icing(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Frost closes up to 40 % of the outlet over the run."""
    return Applied(at_ends(rig, side, icing=0.4 * size), {"loss": (0.4 * size, "1")}, places_of(side, "air"))


@effect("lvdt_cosine", known=False, sides=ENDS)
def lvdt_cosine(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A crooked LVDT: its error grows with the square of the stroke, up to 1.5 mm at 10 mm."""
    curve = 15.0 * size * sign(rng)
    centre = 0.029 if side == "front" else 0.0207  # m, where the body stands at rest
    changed = at_ends(rig, side, sprung_curve=curve, sprung_centre=centre)
    return Applied(changed, {"curve": (curve, "1/m")}, (f"sensor:sprung_{side}",))


@effect("air_column", known=False)
def air_column(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The line between valve and spring rings: lightly damped, the lower the longer it is."""
    frequency, ratio = 2.0 * np.pi * 2.5 / max(size, 1e-3), rng.uniform(0.03, 0.1)
    changed = at_ends(rig, side, column_frequency=min(frequency, 4000.0), column_damping=ratio)
    return Applied(changed, {"frequency": (frequency / 2.0 / np.pi, "Hz")}, places_of(side, "air"))


@effect("binding_guide", known=False)
def binding_guide(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A bent guide: friction up to 60 N, but only above the design height, growing over 4 mm."""
    level = 60.0 * size
    changed = at_ends(rig, side, coulomb=level, static=1.1 * level, bristle_stiffness=1.1 * level / 3e-4,
                      bind_height=rig.front.design_height, bind_length=4e-3)  # fmt: skip
    return Applied(changed, {"force": (level, "N")}, places_of(side, "force"))


@effect("tyre_hardening", known=False)
def tyre_hardening(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The tyre's stiffness grows with the square of its deflection about the rest."""
    cubic = 3e4 * size
    return Applied(at_ends(rig, side, tyre_hardening=cubic), {"cubic": (cubic, "1/m2")}, places_of(side, "tyre"))


@effect("cable_pull", known=False, sides=(None,))
def cable_pull(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A cable bundle ties the body's front to the ground: up to 4 N/mm."""
    return Applied(in_frame(rig, cable_stiffness=4000.0 * size), {"stiffness": (4000.0 * size, "N/m")},
                   ("body_heave", "body_pitch"))  # fmt: skip


@effect("loose_payload", known=False, sides=(None,))
def loose_payload(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Up to 6 kg of the body's mass stand on a soft mount (3 to 8 Hz) at the centre of mass."""
    mass, frequency = 6.0 * size, 2.0 * np.pi * rng.uniform(3.0, 8.0)
    changed = in_frame(rig, sprung_mass=rig.frame.sprung_mass - mass, loose_mass=mass, loose_frequency=frequency,
                       loose_damping=rng.uniform(0.03, 0.12))  # fmt: skip
    return Applied(changed, {"mass": (mass, "kg"), "frequency": (frequency / 2.0 / np.pi, "Hz")},
                   ("body_heave", "body_pitch"))  # fmt: skip


@effect("cross_leak", known=False, sides=(None,))
def cross_leak(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The two springs' lines leak into each other, up to half an outlet's opening."""
    return Applied(in_frame(rig, cross_leak=1e-6 * size), {"opening": (1e-6 * size, "m2")},
                   ("front_air", "rear_air", "supply"))  # fmt: skip
