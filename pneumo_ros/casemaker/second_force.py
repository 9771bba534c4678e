# SPDX-License-Identifier: Apache-2.0
"""Second laws of the contract's effects on forces: friction, damping, bellows, stop, tyre, masses, exciter."""

from __future__ import annotations

import numpy as np

from pneumo_ros.casemaker.laws import slots
from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.registry import Applied, ends_of, in_frame, places_of, second_law, sign, with_law
from pneumo_ros.units import GRAVITY

Rng = np.random.Generator


def static_loads(rig: RicherRig) -> dict[str, float]:
    """What each spring carries at rest, N."""
    a, b, weight = rig.front.arm, -rig.rear.arm, rig.frame.sprung_mass * GRAVITY
    return {"front": weight * b / (a + b), "rear": weight * a / (a + b)}


def _friction(rig: RicherRig, side: str | None, level: float, number: int, *values: float) -> Applied:
    changed = with_law(rig, side, slots.FRICTION, number, level, *values)
    return Applied(changed, {"slip_force": (level, "N")}, places_of(side, "force"))


@second_law("coulomb_friction", "load_dependent")
def load_dependent(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A guide pressed by what the spring's force exceeds its alignment (Amontons's law with a varying normal force):
    F (1 + k (S/S0 - 1)), up to 20 N at rest, k 2 to 5."""
    level, gain, give, changed = 20.0 * size, rng.uniform(2.0, 5.0), rng.uniform(1.5e-4, 4e-4), rig
    for end in ends_of(side):
        changed = _friction(changed, end, level, 1, gain, static_loads(rig)[end], give).rig
    return Applied(changed, {"slip_force": (level, "N"), "gain": (gain, "1")}, places_of(side, "force"))


@second_law("coulomb_friction", "asymmetric")
def asymmetric_friction(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A lip seal: up to 25 N while the strut extends, a third to a half of it while it shortens (Eschmann 1990)."""
    return _friction(rig, side, 25.0 * size, 2, rng.uniform(0.33, 0.5), rng.uniform(1.5e-4, 4e-4))


@second_law("coulomb_friction", "dahl")
def dahl(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """dF/dx = s |1 - F/Fc sgn v|^i, i 1.6 to 2.4 and no Stribeck peak (Dahl, TOR-158, 1968), up to 20 N."""
    return _friction(rig, side, 20.0 * size, 3, rng.uniform(1.6, 2.4), rng.uniform(2e-4, 5e-4))


@second_law("coulomb_friction", "elastoplastic")
def elastoplastic(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Prandtl's spring and slider: stiff, then slipping, with a corner between; up to 20 N within 0.1 to 0.4 mm."""
    return _friction(rig, side, 20.0 * size, 4, rng.uniform(1e-4, 4e-4))


@second_law("coulomb_friction", "sticky")
def sticky(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """F tanh(v/a) with a Stribeck peak and a viscous rise, no presliding (Makkar et al. 2005), up to 18 N."""
    level = 18.0 * size
    return _friction(rig, side, level, 5, rng.uniform(3e-3, 8e-3), rng.uniform(0.2, 0.5), rng.uniform(0.02, 0.05),
                     level * rng.uniform(0.5, 1.5))  # fmt: skip


def _hysteresis(rig: RicherRig, side: str | None, level: float, number: int, *values: float) -> Applied:
    changed = with_law(rig, side, slots.HYSTERESIS, number, level, *values)
    return Applied(changed, {"slip_force": (level, "N")}, places_of(side, "force"))


@second_law("bellows_hysteresis", "iwan")
def iwan(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Parallel sliders whose slip forces follow a power law (Segalman 2005): up to 25 N, the last slips at 3-8 mm."""
    return _hysteresis(rig, side, 25.0 * size, 1, rng.uniform(3e-3, 8e-3), rng.uniform(-0.8, -0.2))


@second_law("bellows_hysteresis", "asymmetric")
def asymmetric_hysteresis(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Bouc-Wen whose limit while shortening is 25 to 50 % of the other (Wang, Wen 2000), up to 25 N at 1 to 2.5 mm."""
    return _hysteresis(rig, side, 25.0 * size, 2, rng.uniform(1e-3, 2.5e-3), rng.uniform(0.25, 0.5),
                       rng.uniform(1.0, 2.0))  # fmt: skip


@second_law("bellows_hysteresis", "folds")
def folds(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Cord rubbing between folds that the stroke presses together: Bouc-Wen times 1 + depth/l, l 2 to 5 mm."""
    return _hysteresis(rig, side, 20.0 * size, 3, rng.uniform(1e-3, 2.5e-3), rng.uniform(2e-3, 5e-3))


def _damping(rig: RicherRig, side: str | None, level: float, number: int, *values: float) -> Applied:
    changed = with_law(rig, side, slots.DAMPING, number, level, *values)
    return Applied(changed, {"damping": (level, "N s/m")}, places_of(side, "force"))


@second_law("viscous_damping", "degressive")
def degressive(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """c v0 |v/v0|^e sgn v with e 0.45 to 0.65, c up to 200 N s/m at v0 0.1 m/s: a sharp-edged bleed (Dixon 2007)."""
    return _damping(rig, side, 200.0 * size, 1, rng.uniform(0.45, 0.65), 0.1)


@second_law("viscous_damping", "one_sided")
def one_sided(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Up to 300 N s/m in rebound, 0 to 25 % of it in bump: check valves of a damper (Dixon 2007)."""
    return _damping(rig, side, 300.0 * size, 2, rng.uniform(0.0, 0.25))


@second_law("viscous_damping", "blow_off")
def blow_off(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Up to 300 N s/m until the valve opens at 20 to 50 mm/s, a tenth of it beyond (Dixon 2007)."""
    return _damping(rig, side, 300.0 * size, 3, rng.uniform(0.02, 0.05), 0.1)


def _mode(rig: RicherRig, side: str | None, rng: Rng, size: float, number: int, extra: float) -> Applied:
    frequency, mass = 2.0 * np.pi * rng.uniform(8.0, 14.0), 0.6 * size
    changed = with_law(rig, side, slots.MODE, number, mass, frequency, rng.uniform(0.04, 0.12), extra)
    return Applied(changed, {"mass": (mass, "kg"), "frequency": (frequency / 2.0 / np.pi, "Hz")},
                   places_of(side, "force"))  # fmt: skip


@second_law("bellows_mode", "hardening")
def hardening_mode(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The wall's mass on a spring k e (1 + (e/l)^2), l 2 to 5 mm (Duffing 1918)."""
    return _mode(rig, side, rng, size, 1, rng.uniform(2e-3, 5e-3))


@second_law("bellows_mode", "grounded")
def grounded_mode(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A fold held by both plates that swings against the ground: its inertia pulls body and axle the same way."""
    done = _mode(rig, side, rng, size, 2, 0.0)
    return Applied(done.rig, done.parameters, done.places)


@second_law("bellows_mode", "loose")
def loose_mode(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The swinging part has 0.2 to 0.6 mm of play to either side before its spring acts."""
    return _mode(rig, side, rng, size, 3, rng.uniform(2e-4, 6e-4))


def _stop(rig: RicherRig, side: str | None, size: float, number: int, *values: float) -> Applied:
    height = rig.frame.stop_height + 13e-3 * size
    changed = with_law(rig, side, slots.STOP, number, height, *values)
    return Applied(changed, {"contact_height": (height, "m")}, places_of(side, "force"))


@second_law("bump_stop", "lossy", foreign=False)
def lossy_stop(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """k d (1 + h d) (1 - c v): rubber that stiffens and loses energy both ways."""
    return _stop(rig, side, size, 1, rng.uniform(2e4, 8e4), rng.uniform(0.0, 200.0), rng.uniform(0.1, 0.6))


@second_law("bump_stop", "one_sided")
def one_sided_stop(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """k d with damping only on the way in: a hydraulic stop whose check valve opens on the way out."""
    return _stop(rig, side, size, 2, rng.uniform(1.5e4, 5e4), rng.uniform(5.0, 15.0))


@second_law("bump_stop", "exponential")
def exponential_stop(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """F (exp(d/l) - 1), l 0.6 to 1.5 mm: microcellular foam that packs (Gibson, Ashby 1997)."""
    return _stop(rig, side, size, 3, rng.uniform(3.0, 10.0), rng.uniform(0.6e-3, 1.5e-3))


@second_law("bump_stop", "two_slopes")
def two_slope_stop(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """5 to 15 N/mm, and 60 to 200 N/mm more beyond 1 to 3 mm: a buffer in a cup."""
    return _stop(rig, side, size, 4, rng.uniform(5e3, 15e3), rng.uniform(6e4, 2e5), rng.uniform(1e-3, 3e-3))


def _tyre(rig: RicherRig, side: str | None, level: float, unit: str, number: int, *values: float) -> Applied:
    changed = with_law(rig, side, slots.TYRE_LOSS, number, level, *values)
    return Applied(changed, {"level": (level, unit)}, places_of(side, "tyre"))


@second_law("tyre_damping", "hysteretic")
def hysteretic_tyre(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The rubber loses energy by travel: elastic, then slipping within 0.3 to 1 mm (Dahl 1968), up to 20 N."""
    return _tyre(rig, side, 20.0 * size, "N", 1, rng.uniform(3e-4, 1e-3))


@second_law("tyre_damping", "load_dependent")
def load_tyre(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Damping that grows with the load to the power 1.5 to 2.5, up to 80 N s/m at rest: the contact patch's size."""
    return _tyre(rig, side, 80.0 * size, "N s/m", 2, rng.uniform(1.5, 2.5))


@second_law("tyre_damping", "degressive")
def degressive_tyre(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """c v0 |v/v0|^e sgn v, e 0.3 to 0.5, up to 120 N s/m at 0.1 m/s: filled rubber under small strain (Payne 1962)."""
    return _tyre(rig, side, 120.0 * size, "N s/m", 3, rng.uniform(0.3, 0.5), 0.1)


def _lift(rig: RicherRig, size: float, side: str | None, number: int, value: float) -> Applied:
    gain = 1.0 + 2.0 * size
    changed = with_law(rig, side, slots.LIFTOFF, number, value)
    return Applied(changed, {"road_gain": (gain, "1")}, places_of(side, "tyre"), gain)


@second_law("tyre_liftoff", "progressive")
def progressive_lift(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """No pull, and force over deflection to the power 1.05 to 1.15, as a toroid's contact (Hertz 1881 has 1.5)."""
    return _lift(rig, size, side, 1, rng.uniform(1.05, 1.15))


@second_law("tyre_liftoff", "soft")
def soft_lift(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """No pull, but the carcass bulges and lets go smoothly within 20 to 50 % of its deflection at rest."""
    return _lift(rig, size, side, 2, rng.uniform(0.2, 0.5))


@second_law("payload", "with_inertia")
def heavy_payload(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Up to 8 kg spread over the body, 150 to 250 mm from the centre of mass on either side: inertia m r^2 with it."""
    mass, radius = 8.0 * size, rng.uniform(0.15, 0.25)
    changed = in_frame(rig, sprung_mass=rig.frame.sprung_mass + mass,
                       pitch_inertia=rig.frame.pitch_inertia + mass * radius**2)  # fmt: skip
    return Applied(changed, {"mass": (mass, "kg"), "radius": (radius, "m")}, ("body_heave", "body_pitch"))


@second_law("payload", "off_centre")
def off_centre(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Up to 8 kg that lie 20 to 60 mm off the centre of mass: parallel axes move centre and inertia as well."""
    mass, place = 8.0 * size, rng.uniform(0.02, 0.06) * sign(rng)
    whole = rig.frame.sprung_mass + mass
    shift = mass * place / whole
    inertia = rig.frame.pitch_inertia + rig.frame.sprung_mass * mass / whole * place**2
    changed = _shifted(in_frame(rig, sprung_mass=whole, pitch_inertia=inertia), shift)
    return Applied(changed, {"mass": (mass, "kg"), "place": (place, "m")}, ("body_heave", "body_pitch"))


def _shifted(rig: RicherRig, shift: float) -> RicherRig:
    return rig._replace(front=rig.front._replace(arm=rig.front.arm - shift),
                        rear=rig.rear._replace(arm=rig.rear.arm - shift))  # fmt: skip


@second_law("cg_shift", "ballast")
def ballast(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A heavy part was moved far: the centre of mass is off by up to 40 mm and the inertia by up to 40 %."""
    shift = 0.04 * size * sign(rng)
    inertia = rig.frame.pitch_inertia * (1.0 + 0.4 * size)
    changed = _shifted(in_frame(rig, pitch_inertia=inertia), shift)
    return Applied(changed, {"shift_forward": (shift, "m")}, ("body_pitch", "body_heave"))


@second_law("cg_shift", "sloshing")
def sloshing(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A half-filled tray: the centre of mass is off by up to 40 mm and runs to the lower end (free surface effect)."""
    shift = 0.04 * size * sign(rng)
    changed = with_law(_shifted(rig, shift), None, slots.BODY, 1, 300.0 * size)
    return Applied(changed, {"shift_forward": (shift, "m")}, ("body_pitch", "body_heave"))


@second_law("exciter_lag", "rate_limited")
def rate_limited_exciter(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The servo valve's flow is limited (Merritt 1967): the road moves no faster than 12 mm/s at the largest size, the
    faster the smaller it is, and else 2 ms late."""
    limit = 0.012 / max(size, 1e-3)
    changed = with_law(rig, side, slots.EXCITER, 2, 2e-3, limit)
    return Applied(changed, {"speed": (limit, "m/s")}, ("road_input",))


@second_law("exciter_lag", "asymmetric")
def asymmetric_exciter(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A single-acting cylinder: up to 25 ms late on the way up against the load, a quarter of it on the way down."""
    late = max(0.025 * size, 8e-4)
    return Applied(with_law(rig, side, slots.EXCITER, 1, late, 0.25 * late), {"lag": (late, "s")}, ("road_input",))
