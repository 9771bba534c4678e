# SPDX-License-Identifier: Apache-2.0
"""Hand-written pieces of the composed kernel: what a plant term sees, and the air balance with a sagging supply.

The nominal equations are those of :mod:`pneumo_ros.plant.equations`; here their intermediate quantities have names so
that a term of an effect can use them.

Kernel arguments
----------------
top, axle, top_rate, axle_rate : heights above the ground datum, m, and their rates, m/s
road, slope : height of the ground, m, and its rate, m/s
gauge : pressure over ambient, Pa
scale, damping, stiffness : factor on the area, 1; of the bushing, N s/m; of the tyre, N/m
load : what the tyre carries at rest, N
pressure, supply, supply_power : absolute, Pa, and (P_ref / supply)^((n - 1) / n), 1
height, rate : of the spring, m and m/s, extension positive
inlet, outlet : openings, m2
mean_area : dV/dh, m2
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit

from pneumo_ros.plant.air_spring import AreaSurface, Gas, effective_area, outlet_flow, pressure_power
from pneumo_ros.plant.equations import Body
from pneumo_ros.plant.orifice import clamped_flow_function
from pneumo_ros.units import GAS_CONSTANT, GRAVITY


class Strut(NamedTuple):
    """One air spring as a mechanical link.

    height m, rate m/s (extension positive), gauge Pa, area m2 (effective, tolerance factor included),
    force N (nominal, positive upwards on the body), middle m and its rate m/s (half-way between body and axle, up).
    """

    height: float
    rate: float
    gauge: float
    area: float
    force: float
    middle: float
    middle_rate: float


class Air(NamedTuple):
    """The gas of one spring: pressure Pa absolute, height m, height rate m/s, volume m3, temperature K (Eq. 4.17),
    inflow and outflow kg/s, exponent n, supply (stagnation) temperature K, the flow that an ideal opening to the
    atmosphere would let out, kg/s per m2, and the supply's pressure Pa absolute."""

    pressure: float
    height: float
    rate: float
    volume: float
    temperature: float
    inflow: float
    outflow: float
    exponent: float
    supply_temperature: float
    escape: float
    supply: float


class Tyre(NamedTuple):
    """One tyre: compression m (road above axle datum), its rate m/s, nominal force N (positive upwards on the axle),
    middle m and its rate m/s as of the strut, compression m and load N at rest, height of the road under it m and
    its rate m/s, height of the strut above it m and its rate m/s."""

    compression: float
    rate: float
    force: float
    middle: float
    middle_rate: float
    rest: float
    load: float
    road: float
    slope: float
    height: float = 0.0
    height_rate: float = 0.0


@njit(cache=True, error_model="numpy")
def strut_of(
    top: float,
    axle: float,
    top_rate: float,
    axle_rate: float,
    gauge: float,
    scale: float,
    damping: float,
    body: Body,
    surface: AreaSurface,
) -> Strut:
    """The nominal spring with bushing and bump stop, between a point of the body and an axle."""
    height, rate = top - axle, top_rate - axle_rate
    area = scale * effective_area(height, gauge, surface)
    stop = body.stop_stiffness * max(0.0, body.stop_height - height)
    force = gauge * area - damping * rate + stop
    return Strut(height, rate, gauge, area, force, 0.5 * (top + axle), 0.5 * (top_rate + axle_rate))


@njit(cache=True, error_model="numpy")
def tyre_loads(body: Body) -> tuple[float, float]:
    """What the tyres carry at rest, N, front and rear."""
    front, rear, weight = body.front_arm, body.rear_arm, body.sprung_mass / (body.front_arm + body.rear_arm)
    return (
        GRAVITY * (weight * rear + body.unsprung_mass_front),
        GRAVITY * (weight * front + body.unsprung_mass_rear),
    )


@njit(cache=True, error_model="numpy")
def tyre_of(
    top: float,
    axle: float,
    top_rate: float,
    axle_rate: float,
    road: float,
    slope: float,
    stiffness: float,
    load: float,
) -> Tyre:
    """The nominal tyre below a strut."""
    middle, rate = 0.5 * (top + axle), 0.5 * (top_rate + axle_rate)
    return Tyre(
        road - axle, slope - axle_rate, stiffness * (road - axle), middle, rate, load / stiffness, load, road, slope,
        top - axle, top_rate - axle_rate,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def air_of(
    pressure: float,
    height: float,
    rate: float,
    inlet: float,
    outlet: float,
    supply: float,
    supply_power: float,
    gas: Gas,
) -> Air:
    """Flows and temperature of one spring fed from ``supply`` (Pa absolute, with its (P_ref/supply)^k)."""
    power = pressure_power(pressure, gas)
    psi = clamped_flow_function(pressure / supply, power * supply_power, gas.k, gas.critical, gas.choked)
    inflow = gas.inlet_scale * inlet * supply * psi / math.sqrt(GAS_CONSTANT * gas.supply_temperature)
    escape = outlet_flow(1.0, pressure, power, gas) / gas.outlet_scale
    return Air(
        pressure,
        height,
        rate,
        gas.volume_offset + gas.mean_area * height,
        gas.supply_temperature * power,
        inflow,
        gas.outlet_scale * outlet * escape,
        gas.exponent,
        gas.supply_temperature,
        escape,
        supply,
    )


@njit(cache=True, error_model="numpy")
def air_rate(air: Air, mean_area: float) -> float:
    """dP/dt of Eq. 4.22, Pa/s."""
    heat = GAS_CONSTANT * air.temperature * (air.inflow - air.outflow)
    return air.exponent * (heat - air.pressure * mean_area * air.rate) / air.volume
