# SPDX-License-Identifier: Apache-2.0
"""Second laws of the contract's sensor effects: curved scales, moving zeros, throttled gauge lines."""

from __future__ import annotations

import numpy as np

from pneumo_ros.casemaker.known_sensor import _pressure_places
from pneumo_ros.casemaker.laws import slots
from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.registry import Applied, ends_of, second_law, sign, with_law

Rng = np.random.Generator
AT_REST = {"sprung_front": 0.029, "sprung_rear": 0.0207, "unsprung_front": -0.0167, "unsprung_rear": -0.025}  # m


def _lvdt(rig: RicherRig, side: str | None, rng: Rng, number: int, *values: float) -> tuple[RicherRig, str, float]:
    """Law on one LVDT; -1 among the values stands for its reading at rest."""
    part = str(rng.choice(["sprung", "unsprung"]))
    centre = AT_REST[f"{part}_{side}"]
    row = slots.SPRUNG if part == "sprung" else slots.UNSPRUNG
    changed = with_law(rig, side, row, number, *(centre if v == -1.0 else v for v in values))
    return changed, f"sensor:{part}_{side}", centre


@second_law("lvdt_scale", "cubic")
def cubic_lvdt(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """At the ends of its coil an LVDT loses sensitivity: e (s/l)^3 about the rest, up to 1 mm at 5 mm."""
    error = 1e-3 * size * sign(rng)
    changed, place, _ = _lvdt(rig, side, rng, 1, error, -1.0, 5e-3)
    return Applied(changed, {"error_at_5_mm": (error, "m")}, (place,))


@second_law("lvdt_scale", "two_slopes")
def two_slope_lvdt(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The two secondary windings differ: another scale on one side of the rest, up to 25 %."""
    error, upper = 0.25 * size * sign(rng), sign(rng)
    changed, place, _ = _lvdt(rig, side, rng, 2, error, -1.0, upper)
    return Applied(changed, {"scale_error": (error, "1")}, (place,))


@second_law("lvdt_offset", "drift")
def drifting_lvdt(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A zero that creeps by up to 4 mm over 15 s: a clamp gives way."""
    rate = 4e-3 / 15.0 * size * sign(rng)
    changed, place, _ = _lvdt(rig, side, rng, 3, rate)
    return Applied(changed, {"rate": (rate, "m/s")}, (place,))


@second_law("lvdt_offset", "warming")
def warming_lvdt(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A zero that moves by up to 4 mm as the amplifier warms, e (1 - exp(-t/T)), T 1 to 5 s."""
    error = 4e-3 * size * sign(rng)
    changed, place, _ = _lvdt(rig, side, rng, 4, error, 0.0, rng.uniform(1.0, 5.0))
    return Applied(changed, {"offset": (error, "m")}, (place,))


def _gauge(rig: RicherRig, side: str | None, name: str, value: float, unit: str) -> Applied:
    return Applied(rig, {name: (value, unit)}, _pressure_places(side))


@second_law("pressure_scale", "cubic")
def cubic_gauge(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A membrane that stiffens: e (p/20 kPa)^3 about the rest, up to 15 kPa, of either sign."""
    error, changed = 15e3 * size * sign(rng), rig
    for end in ends_of(side):
        changed = with_law(changed, end, slots.GAUGE, 1, error, getattr(rig, end).reference_pressure, 2e4)
    return _gauge(changed, side, "error_at_20_kPa", error, "Pa")


@second_law("pressure_scale", "two_slopes")
def two_slope_gauge(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Another scale above (or below) the pressure at rest, up to 30 %: a membrane that meets a stop."""
    error, upper, changed = 0.3 * size * sign(rng), sign(rng), rig
    for end in ends_of(side):
        changed = with_law(changed, end, slots.GAUGE, 2, error, getattr(rig, end).reference_pressure, upper)
    return _gauge(changed, side, "scale_error", error, "1")


@second_law("pressure_offset", "drift")
def drifting_gauge(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A zero that creeps by up to 50 kPa over 15 s."""
    rate = 50e3 / 15.0 * size * sign(rng)
    return _gauge(with_law(rig, side, slots.GAUGE, 3, rate), side, "rate", rate, "Pa/s")


@second_law("pressure_offset", "warming")
def warming_gauge(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A zero that moves by up to 50 kPa as the bridge warms, e (1 - exp(-t/T)), T 1 to 5 s."""
    error = 50e3 * size * sign(rng)
    changed = with_law(rig, side, slots.GAUGE, 4, error, 0.0, rng.uniform(1.0, 5.0))
    return _gauge(changed, side, "offset", error, "Pa")


@second_law("pressure_lag", "throttled")
def throttled(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A snubber's orifice before the gauge: its rate follows the root of the pressure drop, so small swings pass
    quickly and large ones late (Bernoulli)."""
    gain = min(1.2e3 / max(size, 1e-3), 1e5)
    return _gauge(with_law(rig, side, slots.GAUGE_LAG, 3, gain, 300.0), side, "gain", gain, "Pa^0.5/s")


@second_law("pressure_lag", "asymmetric")
def asymmetric_gauge(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A damper with a flap: up to 60 ms late as the pressure rises, 10 to 30 % of it as it falls."""
    late = max(0.06 * size, 3e-3)
    changed = with_law(rig, side, slots.GAUGE_LAG, 1, late, max(8e-4, rng.uniform(0.1, 0.3) * late))
    return _gauge(changed, side, "rising_lag", late, "s")
