# SPDX-License-Identifier: Apache-2.0
"""Air of one end: flows through real valves and leaks, energy balance with wall heat.

The contract's closure (Eq. 4.22 with the polytropic temperature) is the limit without heat; with heat the gas has a
mass and a temperature of its own.

Kernel arguments
----------------
opening : of the valve, m2
pressure, supply : absolute, Pa, in the spring and before the inlet valve
temperature : of the gas that flows, K
height, height_rate : of the spring, m and m/s, extension positive
mass : of the spring's air, kg
inflow, outflow : kg/s
front, rear : absolute pressures of the two springs, Pa
target, value, rate : of a second order lag, any unit, and its rate per second
frequency, ratio : natural frequency, rad/s, and damping ratio, 1
time, duration : since the start, and of the whole run, s
"""

from __future__ import annotations

import math

from numba import njit

from pneumo_ros.casemaker.parameters import End, Frame
from pneumo_ros.plant.orifice import mass_flow
from pneumo_ros.units import GAS_CONSTANT


@njit(cache=True)
def volume(height: float, end: End) -> float:
    """Air volume, m3."""
    return end.volume_offset + end.mean_area * height + end.dead_volume


@njit(cache=True)
def polytropic_temperature(pressure: float, end: End, frame: Frame) -> float:
    """Eq. 4.17, K."""
    k = (frame.exponent - 1.0) / frame.exponent
    return frame.supply_temperature * (pressure / end.reference_pressure) ** k


@njit(cache=True)
def inlet(opening: float, supply: float, pressure: float, temperature: float, end: End, frame: Frame) -> float:
    """Mass flow supply -> spring, kg/s; with ``inlet_ratio_slope`` the coefficient falls as the flow unchokes."""
    coefficient = end.inlet_scale * (1.0 - end.inlet_ratio_slope * pressure / supply)
    return mass_flow(max(0.0, coefficient * opening), supply, pressure, temperature, frame.exponent)


@njit(cache=True)
def outlet(opening: float, pressure: float, temperature: float, age: float, end: End, frame: Frame) -> float:
    """Mass flow spring -> atmosphere through the outlet valve, kg/s; ``age`` in [0, 1] is the share of the run gone."""
    area = end.outlet_scale * opening * (1.0 - end.icing * age * age * (3.0 - 2.0 * age))
    return mass_flow(area, pressure, frame.ambient_pressure, temperature, frame.exponent)


@njit(cache=True)
def leakage(pressure: float, temperature: float, end: End, frame: Frame) -> float:
    """Leak to the atmosphere, kg/s: a laminar crack (flow proportional to P2 - Pa2) and a hole."""
    ambient = frame.ambient_pressure
    crack = end.leak * (pressure * pressure - ambient * ambient) / temperature
    if end.leak_orifice <= 0.0:
        return crack
    return crack + mass_flow(end.leak_orifice, pressure, ambient, temperature, frame.exponent)


@njit(cache=True)
def pressure_rate(
    pressure: float,
    mass: float,
    height: float,
    height_rate: float,
    inflow: float,
    outflow: float,
    end: End,
    frame: Frame,
) -> float:
    """dP/dt, Pa/s, from flows in kg/s.

    ``open_energy`` moves the flow terms from the contract's closure n R T2 (Win - Wout) to the first law of an open
    system, gamma R (T1 Win - T Wout); ``heat`` takes (gamma - 1) h A (T - Twall) out, with T from mass and pressure.
    """
    n = frame.exponent
    room = volume(height, end)
    closure = polytropic_temperature(pressure, end, frame)
    flow = closure * (inflow - outflow)
    heat = 0.0
    if end.open_energy > 0.0 or end.heat > 0.0:
        actual = pressure * room / (mass * GAS_CONSTANT)
        first_law = frame.supply_temperature * inflow - actual * outflow
        flow += end.open_energy * (first_law - flow)
        heat = (n - 1.0) * end.heat * (actual - frame.supply_temperature)
    return (n * (GAS_CONSTANT * flow - pressure * end.mean_area * height_rate) - heat) / room


@njit(cache=True)
def sonic_mass(pressure: float, height: float, end: End, frame: Frame) -> float:
    """Mass of the air at supply temperature, kg: the state at rest."""
    return pressure * volume(height, end) / (GAS_CONSTANT * frame.supply_temperature)


@njit(cache=True)
def exchange(front: float, rear: float, temperature: float, frame: Frame) -> float:
    """Flow front -> rear through a leaking shared manifold, kg/s, signed."""
    if frame.cross_leak <= 0.0:
        return 0.0
    if front >= rear:
        return mass_flow(frame.cross_leak, front, rear, temperature, frame.exponent)
    return -mass_flow(frame.cross_leak, rear, front, temperature, frame.exponent)


@njit(cache=True)
def ringing(target: float, value: float, rate: float, frequency: float, ratio: float) -> float:
    """Second derivative of a second order lag towards ``target``: valve, exciter, line, gauge."""
    return frequency * frequency * (target - value) - 2.0 * ratio * frequency * rate


@njit(cache=True)
def smooth_share(time: float, duration: float) -> float:
    """Share of the run gone, in [0, 1]."""
    return min(max(time / duration, 0.0), 1.0) if duration > 0.0 and math.isfinite(time) else 0.0
