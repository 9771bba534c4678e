# SPDX-License-Identifier: Apache-2.0
"""Second laws of the air: leak, heat, volume, orifice, supply. Flows in kg/s, pressures absolute in Pa.

Kernel arguments
----------------
p : (COLUMNS,) the law's row: its number, then its parameters in the order that the law states
x, dx : state and its rate, which is written; wall, memory : which of them is the law's own
pressure, chamber, ambient, source, tank : absolute, Pa
temperature, gas, outside : K
inflow, flow : kg/s
opening, volume : m2, m3
squeeze, speed : work rate P dV/dt, W, and speed of the strut, m/s
exponent : polytropic exponent, 1
ratio, critical : downstream over upstream pressure, and the one at which the flow chokes, 1
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.plant.orifice import mass_flow
from pneumo_ros.units import GAS_CONSTANT

Row = NDArray[np.float64]  # (COLUMNS,)
State = NDArray[np.float64]
FLOW_AT_REST = 1.5e-3  # kg/s, about what one inlet passes at rest: the scale of forced convection


@njit(cache=True, error_model="numpy")
def leak(p: Row, pressure: float, ambient: float, temperature: float, exponent: float) -> float:
    """Flow to the atmosphere.

    1 fitting: a capillary and an orifice in series, (P^2 - Pa^2)/T = W/a + W^2/b (Forchheimer 1901); a kg K/(s Pa2), b.
    2 relief: a lip that opens above a pressure: K (P - Pc) beyond it; kg/(s Pa), Pa.
    3 slit: a crack that the gauge pressure opens, area A (Pg/P0)^m; m2, Pa, m.
    """
    number = int(p[0])
    if number == 1:
        drive = max(0.0, pressure * pressure - ambient * ambient) / temperature
        return 2.0 * drive / (1.0 / p[1] + math.sqrt(1.0 / (p[1] * p[1]) + 4.0 * drive / p[2]))
    if number == 2:
        return p[1] * max(0.0, pressure - p[2])
    opening = p[1] * (max(0.0, pressure - ambient) / p[2]) ** p[3]
    return mass_flow(opening, pressure, ambient, temperature, exponent)


@njit(cache=True, error_model="numpy")
def heat(
    p: Row, x: State, dx: State, wall: int, gas: float, outside: float, inflow: float, squeeze: float, speed: float
) -> float:
    """Heat into the gas, W; ``gas`` and ``outside`` are temperatures, K, ``squeeze`` the work rate P dV/dt, W.

    1 two nodes: the wall has a heat capacity of its own; W/K inside, J/K, W/K outside.
    2 forced: the conductance grows with the jet of air that comes in, h (W/W0)^0.8 (Dittus, Boelter 1930); W/K.
    3 rate: the exponent falls from its nominal value for slow strokes, n - D/(1 + (v/v0)^2), as measured on air
      springs between isothermal and adiabatic (Quaglia, Sorli 2001); stated as heat: D P dV/dt/(n - 1); D/(n - 1), m/s.
    """
    number = int(p[0])
    if number == 1:
        given = p[1] * (x[wall] - gas)
        dx[wall] = (-given + p[3] * (outside - x[wall])) / p[2]
        return given
    if number == 2:
        return p[1] * (max(inflow, 0.0) / FLOW_AT_REST) ** 0.8 * (outside - gas)
    return p[1] * squeeze / (1.0 + (speed / p[2]) ** 2)


@njit(cache=True, error_model="numpy")
def chamber_flow(p: Row, pressure: float, chamber: float) -> float:
    """Flow from the spring into a second chamber behind an orifice, either way: K sqrt|dP|, smooth below 200 Pa."""
    drop = pressure - chamber
    return p[2] * drop / math.sqrt(math.sqrt(drop * drop + 4e4))


@njit(cache=True, error_model="numpy")
def inlet_factor(p: Row, opening: float, ratio: float) -> float:
    """Factor on the inlet's flow; ``ratio`` is downstream over upstream pressure.

    1 sonic: ISO 6358's ellipse with its own critical ratio; 1 + error, b, and the nominal b.
    2 curved: opening (opening/a0)^e, a shaped plug; e, a0 m2.
    3 series: the line's own restriction behind the valve, 1/A^2 = 1/a^2 + 1/L^2; L m2, and the factor that keeps the
      flow at a0 of its nominal size.
    """
    number = int(p[0])
    if number == 1:
        return p[1] * _ellipse(ratio, p[2]) / _ellipse(min(ratio, 0.98), p[3])
    if number == 2:
        return (max(opening, 1e-10) / p[2]) ** p[1]
    return p[2] / math.sqrt(1.0 + (opening / p[1]) ** 2)


@njit(cache=True, error_model="numpy")
def _ellipse(ratio: float, critical: float) -> float:
    if ratio <= critical:
        return 1.0
    s = (ratio - critical) / (1.0 - critical)
    return math.sqrt(max(1.0 - s * s, 0.0))


@njit(cache=True, error_model="numpy")
def refill(p: Row, x: State, dx: State, memory: int, source: float, tank: float, temperature: float,
           exponent: float) -> float:  # fmt: skip
    """Flow that refills the tank at the valves.

    1 orifice: from a source at p[2] times the supply through an opening, sonic or not; m2, factor.
    2 hose: the air in a long hose has inertia and turbulent loss, dW/dt = (dP - R W |W|) A/L; R, A/L m.
    3 sticking regulator: its spindle follows the pressure error only beyond a band; kg/(s Pa), Pa, s.
    """
    number = int(p[0])
    if number == 1:
        return mass_flow(p[1], p[2] * source, tank, temperature, exponent)
    flow = x[memory]
    if number == 2:
        dx[memory] = (source - tank - p[1] * flow * abs(flow)) * p[2]
        return flow
    wanted = p[1] * (source - tank)
    beyond = wanted - flow - min(max(wanted - flow, -p[1] * p[2]), p[1] * p[2])
    dx[memory] = beyond / p[3]
    return flow


@njit(cache=True, error_model="numpy")
def flow_to_pressure_rate(flow: float, temperature: float, volume: float, exponent: float) -> float:
    """Pa/s that a flow of gas at a temperature makes in a volume."""
    return exponent * GAS_CONSTANT * temperature * flow / volume
