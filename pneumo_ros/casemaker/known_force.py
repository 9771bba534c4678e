# SPDX-License-Identifier: Apache-2.0
"""Effects of the contract that act on forces: friction, damping, bellows, tyre, stop, mass, exciter."""

from __future__ import annotations

import numpy as np

from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.registry import QUICKEST, Applied, at_ends, effect, in_frame, places_of, sign

Rng = np.random.Generator


@effect("coulomb_friction", law="lugre")
def coulomb_friction(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """LuGre: up to 20 N of slip friction, 1.1 to 1.35 of it at rest, giving way at 0.15 to 0.4 mm."""
    level, stick = 20.0 * size, rng.uniform(1.1, 1.35)
    give, stribeck = rng.uniform(1.5e-4, 4e-4), rng.uniform(0.006, 0.015)
    stiffness = level * stick / give
    changed = at_ends(rig, side, coulomb=level, static=level * stick, stribeck=stribeck, bristle_stiffness=stiffness,
                      bristle_damping=0.15 * np.sqrt(stiffness))  # fmt: skip
    return Applied(changed, {"coulomb_force": (level, "N"), "static_force": (level * stick, "N")},
                   places_of(side, "force"))  # fmt: skip


@effect("viscous_damping", law="linear_and_quadratic")
def viscous_damping(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Damping beyond its tolerance, up to 150 N s/m, part of it growing with speed."""
    extra, share = 150.0 * size, rng.uniform(0.0, 0.3)
    changed = at_ends(rig, side, extra_damping=extra * (1.0 - share), quadratic_damping=extra * share / 0.1)
    return Applied(changed, {"damping": (extra, "N s/m")}, places_of(side, "force"))


@effect("bellows_hysteresis", law="bouc_wen")
def bellows_hysteresis(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Bouc-Wen: up to 12 N/mm that slips at 0.8 to 2 mm."""
    stiffness, give, power = 12e3 * size, rng.uniform(0.8e-3, 2e-3), rng.uniform(1.0, 2.0)
    changed = at_ends(rig, side, bouc_stiffness=stiffness, bouc_yield=give, bouc_power=power)
    return Applied(changed, {"stiffness": (stiffness, "N/m"), "slip_force": (stiffness * give, "N")},
                   places_of(side, "force"))  # fmt: skip


@effect("bellows_mode", law="linear")
def bellows_mode(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A mass of the bellows' wall that swings at 8 to 16 Hz inside the spring, up to 0.6 kg."""
    frequency, mass, ratio = 2.0 * np.pi * rng.uniform(8.0, 16.0), 0.6 * size, rng.uniform(0.04, 0.12)
    changed = at_ends(rig, side, mode_stiffness=mass * frequency**2, mode_frequency=frequency, mode_damping=ratio)
    return Applied(changed, {"mass": (mass, "kg"), "frequency": (frequency / 2.0 / np.pi, "Hz")},
                   places_of(side, "force"))  # fmt: skip


@effect("tyre_damping", law="viscous", comparable=True)
def tyre_damping(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Viscous, up to 80 N s/m, on the difference between road and axle speed."""
    return Applied(at_ends(rig, side, tyre_damping=80.0 * size), {"tyre_damping": (80.0 * size, "N s/m")},
                   places_of(side, "tyre"))  # fmt: skip


@effect("tyre_liftoff", law="no_pull")
def tyre_liftoff(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The tyre cannot pull; seen once the road is rough enough: heights up to 3 times the usual ones."""
    gain = 1.0 + 2.0 * size
    return Applied(at_ends(rig, side, unilateral=1.0), {"road_gain": (gain, "1")}, places_of(side, "tyre"), gain)


@effect("bump_stop", law="hunt_crossley", foreign=True)
def bump_stop(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A rubber stop (Hunt-Crossley) that is met up to 13 mm above where the nominal one is."""
    above, stiffness = 13e-3 * size, rng.uniform(3e5, 1.2e6)
    changed = at_ends(rig, side, contact_height=rig.frame.stop_height + above, contact_stiffness=stiffness,
                      contact_damping=rng.uniform(0.1, 0.6))  # fmt: skip
    return Applied(changed, {"contact_height": (rig.frame.stop_height + above, "m")}, places_of(side, "force"))


@effect("payload", law="point_mass", sides=(None,), comparable=True)
def payload(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Up to 8 kg on the centre of mass that the rig file does not know of."""
    mass = 8.0 * size
    return Applied(in_frame(rig, sprung_mass=rig.frame.sprung_mass + mass), {"mass": (mass, "kg")},
                   ("body_heave",))  # fmt: skip


@effect("cg_shift", law="shift", sides=(None,), comparable=True)
def cg_shift(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Centre of mass up to 40 mm forward or backward of where the rig file has it."""
    shift = 0.04 * size * sign(rng)
    changed = rig._replace(front=rig.front._replace(arm=rig.front.arm - shift),
                           rear=rig.rear._replace(arm=rig.rear.arm - shift))  # fmt: skip
    return Applied(changed, {"shift_forward": (shift, "m")}, ("body_pitch", "body_heave"))


@effect("exciter_lag", law="second_order", comparable=True)
def exciter_lag(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The hydraulic exciter follows its command as a second order system, up to 25 ms late."""
    late, ratio = max(0.025 * size, QUICKEST), rng.uniform(0.7, 1.0)
    changed = at_ends(rig, side, exciter_frequency=2.0 * ratio / late, exciter_damping=ratio)
    return Applied(changed, {"lag": (late, "s")}, ("road_input",))
