# SPDX-License-Identifier: Apache-2.0
"""Second laws of the contract's effects on the air: valves, leak, supply, heat, volumes, areas."""

from __future__ import annotations

import numpy as np

from pneumo_ros.casemaker.known_air import NOMINAL_OPENING
from pneumo_ros.casemaker.laws import slots
from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.registry import Applied, at_ends, ends_of, in_frame, places_of, second_law, sign, with_law
from pneumo_ros.plant.orifice import critical_ratio, mass_flow
from pneumo_ros.units import GAS_CONSTANT

Rng = np.random.Generator
OUTLET = 1.93548e-6  # m2, the commanded outlet opening
USED = 1.5e-3  # kg/s, about what one spring takes at rest


def _air(rig: RicherRig, side: str | None, name: str, value: float, unit: str) -> Applied:
    return Applied(rig, {name: (value, unit)}, places_of(side, "air"))


@second_law("valve_lag", "asymmetric")
def asymmetric_valve(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Opens against its spring up to 70 ms late, closes in 10 to 30 % of that: first order either way."""
    late = max(0.07 * size, 8e-4)
    changed = with_law(rig, side, slots.LAG, 1, late, max(rng.uniform(0.1, 0.3) * late, 5e-4))
    return _air(changed, side, "opening_lag", late, "s")


@second_law("valve_lag", "rate_limited")
def rate_limited_valve(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A motor valve: no faster than the opening at rest in up to 0.6 s, else 2 ms late."""
    time = 0.6 * size
    return _air(with_law(rig, side, slots.LAG, 2, 2e-3, NOMINAL_OPENING / time), side, "time", time, "s")


@second_law("valve_deadband", "soft")
def soft_overlap(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A lapped edge that leaks before it opens: w ln(1 + exp((s - a)/w)), a up to 60 % of the opening at rest."""
    overlap = 0.6 * NOMINAL_OPENING * size
    changed = with_law(rig, side, slots.DEADBAND, 1, overlap, overlap * rng.uniform(0.3, 0.6))
    return _air(changed, side, "overlap", overlap, "m2")


@second_law("valve_deadband", "notched")
def notched(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Notches in the spool's edge: 10 to 30 % of the gain over the first part, up to 90 % of the opening at rest."""
    notch = 0.9 * NOMINAL_OPENING * size
    return _air(with_law(rig, side, slots.DEADBAND, 2, notch, rng.uniform(0.1, 0.3)), side, "notch", notch, "m2")


@second_law("valve_deadband", "stick_and_jump")
def stick_and_jump(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The spool holds until the command has moved by up to 60 % of the opening at rest, then jumps to it
    (Choudhury et al. 2005)."""
    band = 0.6 * NOMINAL_OPENING * size
    return _air(at_ends(rig, side, valve_stick=band), side, "band", band, "m2")


@second_law("transport_delay", "held")
def held(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The driver takes a command only every 4 to 120 ms and keeps it meanwhile."""
    every = max(0.12 * size, 4e-3)
    return _air(with_law(rig, side, slots.DELAY, 1, every), side, "every", every, "s")


@second_law("transport_delay", "scattered")
def scattered(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A shared bus: packets of 40 to 80 ms arrive up to 60 ms late, each by another 40 to 160 %."""
    late = 0.06 * size
    changed = with_law(rig, side, slots.DELAY, 2, late, rng.uniform(0.04, 0.08), 0.6, rng.uniform(0.0, 6.0))
    return _air(changed, side, "delay", late, "s")


def _outflow(rig: RicherRig, end: str) -> float:
    pressure = getattr(rig, end).reference_pressure
    return float(OUTLET * pressure * 0.6847 / np.sqrt(GAS_CONSTANT * rig.frame.supply_temperature))


@second_law("leak", "fitting")
def fitting(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A capillary and an orifice in series, (P^2 - Pa^2)/T = W/a + W^2/b (Forchheimer 1901): up to half an outlet."""
    changed, part = rig, rng.uniform(0.3, 0.7)
    for end in ends_of(side):
        flow, pressure = 0.5 * size * _outflow(rig, end), getattr(rig, end).reference_pressure
        drive = (pressure**2 - rig.frame.ambient_pressure**2) / rig.frame.supply_temperature
        changed = with_law(changed, end, slots.LEAK, 1, flow / (part * drive), flow**2 / ((1.0 - part) * drive))
    return _air(changed, side, "share_of_outlet", 0.5 * size, "1")


@second_law("leak", "relief")
def relief(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A lip that opens above a pressure near the one at rest, up to half an outlet's flow per 30 kPa beyond it."""
    changed, margin = rig, rng.uniform(-15e3, 5e3)
    for end in ends_of(side):
        gain = size * _outflow(rig, end) / 30e3
        changed = with_law(changed, end, slots.LEAK, 2, gain, getattr(rig, end).reference_pressure + margin)
    return _air(changed, side, "gain_of_outlet", size, "1")


@second_law("leak", "slit")
def slit(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A cut that the gauge pressure opens, area A (Pg/P0)^m with m 1.5 to 3: up to half an outlet's opening."""
    changed, power = rig, rng.uniform(1.5, 3.0)
    for end in ends_of(side):
        gauge = getattr(rig, end).reference_pressure - rig.frame.ambient_pressure
        changed = with_law(changed, end, slots.LEAK, 3, 0.5 * size * OUTLET, gauge, power)
    return _air(changed, side, "share_of_outlet", 0.5 * size, "1")


def _supply(rig: RicherRig, tank: float, number: int, *values: float) -> RicherRig:
    return with_law(in_frame(rig, tank_volume=tank, regulator=1.0), None, slots.SUPPLY, number, *values)


@second_law("supply_droop", "tank_and_orifice")
def tank_and_orifice(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A tank filled through an opening from a source 10 to 30 % above the stated pressure (St. Venant): stiff while
    sonic, soft once it is not; up to the drop at which it starves."""
    factor, tank = rng.uniform(1.02, 1.3), rng.uniform(0.3e-3, 2e-3)
    source = factor * rig.frame.supply_pressure
    used = 1.05 * (_outflow(rig, "front") + _outflow(rig, "rear"))
    drop = min(150e3 * size, rig.frame.supply_pressure - 0.68 * source)  # less would starve the rig by the next draw
    tank_pressure, n = rig.frame.supply_pressure - drop, rig.frame.exponent
    per_area = float(mass_flow(1e-6, source, tank_pressure, rig.frame.supply_temperature, n)) / 1e-6
    changed = _supply(rig, tank, 1, used / per_area, factor)
    return Applied(changed, {"drop_at_rest": (drop, "Pa"), "tank": (tank, "m3")}, ("supply",))


@second_law("supply_droop", "hose")
def hose(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A long hose: turbulent loss with the square of the flow, and the inertia of its air (Anderson 1967): rings."""
    drop, tank = 150e3 * size, rng.uniform(0.3e-3, 1.5e-3)
    changed = _supply(rig, tank, 2, drop / (2.0 * USED) ** 2, rng.uniform(3e-6, 1.5e-5))
    return Applied(changed, {"drop_at_rest": (drop, "Pa"), "tank": (tank, "m3")}, ("supply",))


@second_law("supply_droop", "sticking_regulator")
def sticking_regulator(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A regulator whose spindle answers only beyond a band of 20 to 50 % of its drop at rest, then within 10 ms."""
    drop, tank = 120e3 * size, rng.uniform(0.5e-3, 2e-3)
    changed = _supply(rig, tank, 3, 2.0 * USED / drop, drop * rng.uniform(0.2, 0.5), 0.01)
    return Applied(changed, {"drop_at_rest": (drop, "Pa"), "tank": (tank, "m3")}, ("supply",))


@second_law("heat_transfer", "energy_balance")
def energy_balance(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """First law with the enthalpy of what flows in and out, for the share of the flow that the line has not tempered
    to the closure's temperature, and wall heat up to 1 W/K."""
    conductance = size * rng.uniform(0.2, 1.0)
    return _air(at_ends(rig, side, open_energy=size, heat=conductance), side, "share", size, "1")


@second_law("heat_transfer", "two_nodes")
def two_nodes(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A wall with a heat capacity of its own, 0.5 to 3 J/K, between gas (up to 4 W/K) and room (0.05 to 0.3 W/K)."""
    conductance = 4.0 * size
    changed = with_law(rig, side, slots.HEAT, 1, conductance, rng.uniform(0.5, 3.0), rng.uniform(0.05, 0.3))
    return _air(changed, side, "conductance", conductance, "W/K")


@second_law("heat_transfer", "forced")
def forced(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Conductance that grows with the jet of the inlet, h (W/W0)^0.8 (Dittus, Boelter 1930), up to 3 W/K."""
    return _air(with_law(rig, side, slots.HEAT, 2, 3.0 * size), side, "conductance", 3.0 * size, "W/K")


@second_law("heat_transfer", "rate_exponent")
def rate_exponent(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The exponent is lower for slow strokes, n - D/(1 + (v/v0)^2), D up to 0.4 (Quaglia, Sorli 2001)."""
    fall = 0.4 * size
    changed = with_law(rig, side, slots.HEAT, 3, fall / (rig.frame.exponent - 1.0), rng.uniform(0.05, 0.15))
    return _air(changed, side, "fall", fall, "1")


@second_law("dead_volume", "compliant")
def compliant(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """Bellows and hose that widen with the pressure, up to 60 ml per 100 kPa."""
    give = 6e-10 * size
    return _air(with_law(rig, side, slots.VOLUME, 1, give), side, "compliance", give, "m3/Pa")


@second_law("dead_volume", "second_chamber")
def second_chamber(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A vessel of up to 100 ml behind an orifice, W = K sqrt|dP|."""
    vessel = 100e-6 * size
    changed = with_law(rig, side, slots.VOLUME, 2, vessel, 1e-5 * rng.uniform(0.5, 2.0) * max(size, 0.02))
    return _air(changed, side, "volume", vessel, "m3")


def _area(rig: RicherRig, side: str | None, error: float, number: int, *values: float) -> Applied:
    changed = with_law(rig, side, slots.AREA, number, *values)
    return Applied(changed, {"error": (error, "1")}, places_of(side, "force"))


@second_law("effective_area_error", "swelling")
def swelling(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The bellows widen with pressure: up to 25 % per 100 kPa over the pressure at rest, and its square."""
    error = 0.25 * size
    return _area(rig, side, error, 1, error / 1e5, 2.0 * error / 1e10 * rng.uniform(0.5, 1.5))


@second_law("effective_area_error", "curved")
def curved_area(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """e (1 + b s^2 + c s^3) over the stroke in cm: the bellows roll off their bead; e up to 8 %."""
    error = 0.08 * size * sign(rng)
    return _area(rig, side, error, 2, error, rng.uniform(2.0, 5.0) * sign(rng), rng.uniform(-3.0, 3.0))


@second_law("effective_area_error", "wavy")
def wavy_area(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """e sin(2 pi stroke/l + phase), l 6 to 12 mm: the lobes of a convolution; e up to 12 %."""
    error = 0.12 * size
    return _area(rig, side, error, 3, error, rng.uniform(6e-3, 12e-3), rng.uniform(0.0, 2.0 * np.pi))


@second_law("orifice_coefficient", "sonic")
def sonic(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """ISO 6358: conductance up to 40 % off and a critical ratio of 0.1 to 0.35 instead of the nozzle's."""
    error = 0.4 * size * sign(rng)
    nozzle = float(critical_ratio(rig.frame.exponent))
    ratio = nozzle + (rng.uniform(0.1, 0.35) - nozzle) * min(1.0, 2.0 * size)
    changed = with_law(rig, side, slots.ORIFICE, 1, 1.0 + error, ratio, nozzle)
    return _air(changed, side, "error", error, "1")


@second_law("orifice_coefficient", "curved")
def curved_plug(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """A shaped plug: opening A (A/A0)^e, e up to 1 or down to -0.5, A0 at rest."""
    power = size * float(rng.choice([1.0, -0.5]))
    return _air(with_law(rig, side, slots.ORIFICE, 2, power, NOMINAL_OPENING), side, "power", power, "1")


@second_law("orifice_coefficient", "series")
def series(rig: RicherRig, size: float, side: str | None, rng: Rng) -> Applied:
    """The line's own opening behind the valve, 1/A^2 = 1/a^2 + 1/L^2, L down to the valve's opening at rest, in a valve
    that is larger by what this takes at rest."""
    line = NOMINAL_OPENING / max(size, 1e-3)
    whole = float(np.sqrt(1.0 + (NOMINAL_OPENING / line) ** 2))
    return _air(with_law(rig, side, slots.ORIFICE, 3, line, whole), side, "line", line, "m2")
