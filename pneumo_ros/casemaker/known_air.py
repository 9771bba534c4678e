# SPDX-License-Identifier: Apache-2.0
"""Effects of the contract that act on the air: valves, leak, supply, heat, volumes, areas."""

from __future__ import annotations

import numpy as np

from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.registry import QUICKEST, Applied, at_ends, effect, ends_of, in_frame, places_of, sign

Rng = np.random.Generator
NOMINAL_OPENING = 7e-7  # m2, about what an inlet has at rest


@effect("valve_lag", law="second_order", comparable=True)
def valve_lag(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Second order spool, up to 60 ms late in all."""
    late, ratio = max(0.06 * size, QUICKEST), rng.uniform(0.7, 1.0)
    changed = at_ends(rig, side, valve_frequency=2.0 * ratio / late, valve_damping=ratio)
    return Applied(changed, {"lag": (late, "s")}, places_of(side, "air"))


@effect("valve_deadband", law="overlap", comparable=True)
def valve_deadband(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Overlap: the first part of the command, up to 60 % of the opening at rest, opens nothing."""
    overlap = 0.6 * NOMINAL_OPENING * size
    return Applied(at_ends(rig, side, valve_overlap=overlap), {"overlap": (overlap, "m2")}, places_of(side, "air"))


@effect("transport_delay", law="delay", comparable=True)
def transport_delay(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Commands arrive up to 60 ms late."""
    return Applied(at_ends(rig, side, valve_delay=0.06 * size), {"delay": (0.06 * size, "s")}, places_of(side, "air"))


@effect("leak", law="laminar")
def leak(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A crack with laminar flow (proportional to P2 - Pa2): up to half of what the outlet passes at rest."""
    changed = rig
    for end in ends_of(side):
        it = getattr(rig, end)
        pressure, ambient = it.reference_pressure, rig.frame.ambient_pressure
        outlet = 1.93548e-6 * pressure * 0.6847 / np.sqrt(287.05 * rig.frame.supply_temperature)
        crack = 0.5 * size * outlet * rig.frame.supply_temperature / (pressure**2 - ambient**2)
        changed = at_ends(changed, end, leak=crack)
    return Applied(changed, {"share_of_outlet": (0.5 * size, "1")}, places_of(side, "air"))


@effect("supply_droop", law="regulator_and_tank", sides=(None,))
def supply_droop(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A regulator that needs a pressure drop to pass air, up to 150 kPa for what the rig takes at rest, and a tank."""
    drop, tank = 150e3 * size, rng.uniform(0.3e-3, 1.5e-3)
    changed = in_frame(rig, tank_volume=tank, regulator=3.1e-3 / drop)
    return Applied(changed, {"drop_at_rest": (drop, "Pa"), "tank": (tank, "m3")}, ("supply",))


@effect("heat_transfer", law="wall")
def heat_transfer(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Heat from the gas to the wall, up to 3 W/K, with the gas's own mass and temperature."""
    return Applied(at_ends(rig, side, heat=3.0 * size), {"conductance": (3.0 * size, "W/K")}, places_of(side, "air"))


@effect("effective_area_error", law="level_and_slope")
def effective_area_error(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The bellows' area is off by up to 12 %, and its slope over height with it."""
    error, tilt = 0.12 * size * sign(rng), 4.0 * size * rng.uniform(-1.0, 1.0)
    changed = at_ends(rig, side, area_error=error, area_tilt=tilt)
    return Applied(changed, {"error": (error, "1"), "tilt": (tilt, "1/m")}, places_of(side, "force"))


@effect("dead_volume", law="constant", comparable=True)
def dead_volume(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Fittings and hose add up to 50 ml to the spring's 72 ml."""
    return Applied(at_ends(rig, side, dead_volume=50e-6 * size), {"volume": (50e-6 * size, "m3")},
                   places_of(side, "air"))  # fmt: skip


@effect("orifice_coefficient", law="level_and_ratio")
def orifice_coefficient(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The inlet passes up to 40 % less or more than its opening says, and less so as the flow unchokes (Perry)."""
    error, slope = 0.4 * size * sign(rng), 0.15 * size
    changed = rig
    for end in ends_of(side):
        it = getattr(rig, end)
        changed = at_ends(changed, end, inlet_scale=it.inlet_scale * (1.0 + error), inlet_ratio_slope=slope)
    return Applied(changed, {"error": (error, "1"), "ratio_slope": (slope, "1")}, places_of(side, "air"))
