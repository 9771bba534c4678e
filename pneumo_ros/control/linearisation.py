# SPDX-License-Identifier: Apache-2.0
"""The feedback linearisation core: from a wanted rate of spring force to valve openings (Eqs. 6.7-6.17, 6.63-6.73).

The thesis inverts the 2 x 2 matrix B of Eq. 6.73. B factors into the body's geometry and one gain a spring, so the same
inverse is two steps: outputs' third derivatives -> force rates (geometry alone), force rate -> opening (one spring
alone). The second is the quarter car's Eq. 6.14 and serves both cars. det B = 0 exactly where a spring's gain is zero:
no flow because spring and supply have one pressure, or no area left (Eq. 6.89; errata 8).

Kernel arguments
----------------
height, gauge : of the spring, m, and its pressure over ambient, Pa
force_rate, pressure_rate : wanted, N/s and Pa/s
ambient : absolute, Pa
heave_jerk, pitch_jerk : wanted third derivatives, m/s3 and rad/s3
mass, inertia : of the body, kg and kg m2
front_arm, rear_arm : from the centre of gravity to the axles, m
"""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from pneumo_ros.plant.air_spring import AreaSurface, Gas, effective_area, inlet_flow, outlet_flow, pressure_power
from pneumo_ros.units import GAS_CONSTANT

SMALLEST_AREA = 1e-5  # m2 (0.016 in2): below it force does not answer to pressure and dividing by it asks for anything
SMALLEST_HEIGHT = 5e-3  # m
HEIGHT_STEP, GAUGE_STEP = 1e-5, 100.0  # m and Pa, for the slopes of the area surface


class Spring(NamedTuple):
    """What a controller believes of a spring at one instant.

    Attributes
    ----------
    pressure : absolute, Pa
    height, height_rate, height_acceleration : m, m/s, m/s2
    area : effective area, m2
    volume : m3
    mean_area : dV/dh, m2 (Eq. 4.26)
    """

    pressure: float
    height: float
    height_rate: float
    height_acceleration: float
    area: float
    volume: float
    mean_area: float


class Compensation(NamedTuple):
    """What a controller feeds forward beyond Eq. 6.63, each 0 (the thesis) or 1.

    Attributes
    ----------
    area_rate : dA/dt by the known surface; the thesis takes it as zero and names it a main uncertainty
    bushing : damping (N s/m) times height acceleration, as a number in N s/m; 0 leaves it out
    two_valve : 1 commands the outlets as well
    """

    area_rate: float
    bushing: float
    two_valve: float


@njit(cache=True)
def believed_volume(height: float, estimate: float, gas: Gas) -> tuple[float, float]:
    """Volume, m3, and dV/dh, m2: the spring's, or a constant ``estimate`` > 0 with V/h (Eqs. 4.25-4.27)."""
    if estimate > 0.0:
        return estimate, estimate / max(height, SMALLEST_HEIGHT)
    return gas.volume_offset + gas.mean_area * height, gas.mean_area


@njit(cache=True)
def area_slopes(height: float, gauge: float, surface: AreaSurface) -> tuple[float, float]:
    """dA/dh (m) and dA/dp (m2/Pa) of the effective area surface, central differences."""
    by_height = effective_area(height + HEIGHT_STEP, gauge, surface) - effective_area(
        height - HEIGHT_STEP, gauge, surface
    )
    by_gauge = effective_area(height, gauge + GAUGE_STEP, surface) - effective_area(height, gauge - GAUGE_STEP, surface)
    return by_height / (2.0 * HEIGHT_STEP), by_gauge / (2.0 * GAUGE_STEP)


@njit(cache=True)
def wanted_pressure_rate(
    force_rate: float, spring: Spring, compensation: Compensation, ambient: float, surface: AreaSurface
) -> float:
    """Pressure rate, Pa/s, that gives a force rate, N/s.

    F' = A P' in the thesis; with the surface known F' = (A + p dA/dp) P' + p dA/dh h' - c h''.
    """
    gauge = spring.pressure - ambient
    gain, rest = max(spring.area, SMALLEST_AREA), -compensation.bushing * spring.height_acceleration
    if compensation.area_rate > 0.0:
        by_height, by_gauge = area_slopes(spring.height, gauge, surface)
        gain = max(gain + compensation.area_rate * gauge * by_gauge, SMALLEST_AREA)
        rest += compensation.area_rate * gauge * by_height * spring.height_rate
    return (force_rate - rest) / gain


@njit(cache=True)
def wanted_net_flow(pressure_rate: float, spring: Spring, power: float, gas: Gas) -> float:
    """Mass flow into the spring, kg/s, that gives a pressure rate, Pa/s: Eq. 4.22 solved for it.

    ``power`` is T2/T1 (Eq. 4.17).
    """
    stored = spring.volume * pressure_rate / gas.exponent + spring.pressure * spring.mean_area * spring.height_rate
    return stored / (GAS_CONSTANT * gas.supply_temperature * power)


@njit(cache=True, error_model="numpy")
def openings(
    force_rate: float,
    spring: Spring,
    trim_outlet: float,
    compensation: Compensation,
    gas: Gas,
    surface: AreaSurface,
) -> tuple[float, float]:
    """Unclipped inlet and outlet openings, m2, for a wanted force rate, N/s (Eq. 6.14).

    With one valve the outlet stays at ``trim_outlet`` and the inlet may come out negative (the valve clips it). With
    two the inlet fills or the outlet empties, never both: air that enters only to leave does nothing for the force.
    """
    power = pressure_power(spring.pressure, gas)
    rate = wanted_pressure_rate(force_rate, spring, compensation, gas.ambient_pressure, surface)
    net = wanted_net_flow(rate, spring, power, gas)
    fill = max(inlet_flow(1.0, spring.pressure, power, gas), 1e-3)
    if compensation.two_valve > 0.0:
        empty = max(outlet_flow(1.0, spring.pressure, power, gas), 1e-3)
        return max(net, 0.0) / fill, max(-net, 0.0) / empty
    return (net + outlet_flow(trim_outlet, spring.pressure, power, gas)) / fill, trim_outlet


@njit(cache=True)
def force_rates(
    heave_jerk: float, pitch_jerk: float, mass: float, inertia: float, front_arm: float, rear_arm: float
) -> tuple[float, float]:
    """Front and rear force rates, N/s, that give third derivatives of heave (m/s3) and pitch (rad/s3)."""
    wheelbase = front_arm + rear_arm
    return (
        (rear_arm * mass * heave_jerk + inertia * pitch_jerk) / wheelbase,
        (front_arm * mass * heave_jerk - inertia * pitch_jerk) / wheelbase,
    )
