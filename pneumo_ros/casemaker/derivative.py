"""Right-hand side of the richer rig.

State: 0-9 as :mod:`pneumo_ros.plant.half_car`; then one block of 13 for each end (bristle, bellows memory, bellows
mode and rate, spool and rate, air mass, exciter and rate, line flow and rate, gauge and rate), then tank pressure,
loose payload and rate, exciter base and rate. A state whose effect is off stays where it starts.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.casemaker import air
from pneumo_ros.casemaker.contact import bouc_wen_rate, hunt_crossley, lugre, lugre_level, tyre_force, viscous
from pneumo_ros.casemaker.parameters import End, Frame
from pneumo_ros.casemaker.valve import opening_of
from pneumo_ros.plant.air_spring import AreaSurface, effective_area
from pneumo_ros.units import GAS_CONSTANT, GRAVITY

BLOCK = 13
BRISTLE, BELLOWS, MODE, SPOOL, MASS, EXCITER, COLUMN, GAUGE = 0, 1, 2, 4, 6, 7, 9, 11
FRONT, REAR = 10, 10 + BLOCK
TANK = 10 + 2 * BLOCK
LOOSE, BASE = TANK + 1, TANK + 3
SIZE = TANK + 5


@njit(cache=True, error_model="numpy")
def suspension_force(
    x: NDArray[np.float64],
    dx: NDArray[np.float64],
    at: int,
    height: float,
    speed: float,
    pressure: float,
    end: End,
    frame: Frame,
    surface: AreaSurface,
) -> float:
    """Force between axle and body, N upwards on the body; fills the rates of the states that make it."""
    gauge = pressure - frame.ambient_pressure
    factor = (
        1.0
        + end.area_error
        + end.area_tilt * (height - end.design_height)
        + end.area_pressure * (pressure - end.reference_pressure)
    )
    force = gauge * end.area_scale * factor * effective_area(height, gauge, surface)
    force += frame.stop_stiffness * max(0.0, frame.stop_height - height)
    force -= viscous(speed, end)
    force += hunt_crossley(height, speed, end)
    if end.coulomb > 0.0:
        friction, dx[at + BRISTLE] = lugre(x[at + BRISTLE], speed, end)
        force -= lugre_level(height, end) * friction
    if end.bouc_stiffness > 0.0:
        dx[at + BELLOWS] = bouc_wen_rate(x[at + BELLOWS], speed, end)
        force -= end.bouc_stiffness * x[at + BELLOWS]
    if end.mode_stiffness > 0.0:
        q, q_rate = x[at + MODE], x[at + MODE + 1]
        dx[at + MODE] = q_rate
        dx[at + MODE + 1] = air.ringing(height, q, q_rate, end.mode_frequency, end.mode_damping)
        force -= end.mode_stiffness * (height - q)
    return force


@njit(cache=True, error_model="numpy")
def air_rates(
    x: NDArray[np.float64],
    dx: NDArray[np.float64],
    at: int,
    index: int,
    height: float,
    speed: float,
    spool: float,
    outlet: float,
    supply: float,
    temperature: float,
    across: float,
    age: float,
    end: End,
    frame: Frame,
) -> float:
    """Fills the rates of pressure, mass, spool, line and gauge; returns the flow taken from the supply, kg/s.

    ``across`` is the flow that leaves this spring into the other one.
    """
    pressure = x[index]
    if end.valve_frequency > 0.0:
        dx[at + SPOOL] = x[at + SPOOL + 1]
        dx[at + SPOOL + 1] = air.ringing(
            spool, x[at + SPOOL], x[at + SPOOL + 1], end.valve_frequency, end.valve_damping
        )
        spool = x[at + SPOOL]
    taken = air.inlet(opening_of(spool, end), supply, pressure, temperature, end, frame)
    inflow = taken
    if end.column_frequency > 0.0:
        dx[at + COLUMN] = x[at + COLUMN + 1]
        dx[at + COLUMN + 1] = air.ringing(
            taken, x[at + COLUMN], x[at + COLUMN + 1], end.column_frequency, end.column_damping
        )
        inflow = x[at + COLUMN]
    gas = air.polytropic_temperature(pressure, end, frame)
    if end.open_energy > 0.0:
        gas = pressure * air.volume(height, end) / (x[at + MASS] * GAS_CONSTANT)
    outflow = air.outlet(outlet, pressure, gas, age, end, frame) + air.leakage(pressure, gas, end, frame) + across
    dx[index] = air.pressure_rate(pressure, x[at + MASS], height, speed, inflow, outflow, end, frame)
    dx[at + MASS] = inflow - outflow
    if end.pressure_frequency > 0.0:
        dx[at + GAUGE] = x[at + GAUGE + 1]
        dx[at + GAUGE + 1] = air.ringing(
            pressure, x[at + GAUGE], x[at + GAUGE + 1], end.pressure_frequency, end.pressure_damping
        )
    return taken


@njit(cache=True)
def road_at(
    x: NDArray[np.float64], dx: NDArray[np.float64], at: int, road: float, road_rate: float, end: End, frame: Frame
) -> tuple[float, float]:
    """Height and rate of the ground under a tyre: the command, through the exciter's lag, on a base that may move."""
    if end.exciter_frequency > 0.0:
        dx[at + EXCITER] = x[at + EXCITER + 1]
        dx[at + EXCITER + 1] = air.ringing(
            road, x[at + EXCITER], x[at + EXCITER + 1], end.exciter_frequency, end.exciter_damping
        )
        road, road_rate = x[at + EXCITER], x[at + EXCITER + 1]
    if frame.base_mass > 0.0:
        return road + x[BASE], road_rate + x[BASE + 1]
    return road, road_rate


@njit(cache=True, error_model="numpy")
def derivative(
    x: NDArray[np.float64],
    dx: NDArray[np.float64],
    time: float,
    duration: float,
    spools: tuple[float, float],
    outlets: tuple[float, float],
    roads: tuple[float, float],
    road_rates: tuple[float, float],
    static: tuple[float, float],
    frame: Frame,
    front: End,
    rear: End,
    surface: AreaSurface,
) -> None:
    """Write dx(x).

    Parameters
    ----------
    x, dx : (SIZE,)
    spools : driven inlet positions, m2 (after delay, stick and slew)
    outlets : outlet openings, m2
    roads, road_rates : commanded ground, m and m/s
    static : tyre deflection at rest, m
    """
    hf = x[0] + front.arm * x[1] - x[2]
    hr = x[0] + rear.arm * x[1] - x[3]
    hf_rate = x[4] + front.arm * x[5] - x[6]
    hr_rate = x[4] + rear.arm * x[5] - x[7]
    ff = suspension_force(x, dx, FRONT, hf, hf_rate, x[8], front, frame, surface)
    fr = suspension_force(x, dx, REAR, hr, hr_rate, x[9], rear, frame, surface)
    road_front, rate_front = road_at(x, dx, FRONT, roads[0], road_rates[0], front, frame)
    road_rear, rate_rear = road_at(x, dx, REAR, roads[1], road_rates[1], rear, frame)
    tf = tyre_force(road_front - x[2], rate_front - x[6], static[0], front)
    tr = tyre_force(road_rear - x[3], rate_rear - x[7], static[1], rear)
    heave, pitch = ff + fr, front.arm * ff + rear.arm * fr
    if frame.cable_stiffness > 0.0:
        pull = frame.cable_stiffness * (frame.cable_length - x[0] - front.arm * x[1])
        heave, pitch = heave + pull, pitch + front.arm * pull
    if frame.loose_mass > 0.0:
        point = x[0] + frame.loose_arm * x[1]
        point_rate = x[4] + frame.loose_arm * x[5]
        bend, bend_rate = x[LOOSE] - point, x[LOOSE + 1] - point_rate
        lift = -(frame.loose_frequency**2) * bend - 2.0 * frame.loose_damping * frame.loose_frequency * bend_rate
        dx[LOOSE], dx[LOOSE + 1] = x[LOOSE + 1], lift - GRAVITY
        heave, pitch = heave - frame.loose_mass * lift, pitch - frame.loose_mass * lift * frame.loose_arm
    if frame.base_mass > 0.0:
        dx[BASE] = x[BASE + 1]
        load = front.tyre_stiffness * static[0] + rear.tyre_stiffness * static[1]
        dx[BASE + 1] = (
            air.ringing(0.0, x[BASE], x[BASE + 1], frame.base_frequency, frame.base_damping)
            - (tf + tr - load) / frame.base_mass
        )
    shake_front = front.imbalance * math.sin(front.imbalance_frequency * time + front.imbalance_phase)
    shake_rear = rear.imbalance * math.sin(rear.imbalance_frequency * time + rear.imbalance_phase)
    for i in range(4):
        dx[i] = x[4 + i]
    dx[4] = heave / frame.sprung_mass - GRAVITY
    dx[5] = pitch / frame.pitch_inertia
    dx[6] = (tf - ff + shake_front) / front.unsprung_mass - GRAVITY
    dx[7] = (tr - fr + shake_rear) / rear.unsprung_mass - GRAVITY
    _supply_and_air(x, dx, time, duration, spools, outlets, (hf, hr), (hf_rate, hr_rate), frame, front, rear)


@njit(cache=True, error_model="numpy")
def _supply_and_air(
    x: NDArray[np.float64],
    dx: NDArray[np.float64],
    time: float,
    duration: float,
    spools: tuple[float, float],
    outlets: tuple[float, float],
    heights: tuple[float, float],
    speeds: tuple[float, float],
    frame: Frame,
    front: End,
    rear: End,
) -> None:
    age = air.smooth_share(time, duration)
    temperature = frame.supply_temperature + frame.temperature_drift * age
    supply = x[TANK] if frame.tank_volume > 0.0 else frame.supply_pressure
    across = air.exchange(x[8], x[9], temperature, frame)
    used = air_rates(x, dx, FRONT, 8, heights[0], speeds[0], spools[0], outlets[0], supply, temperature, across, age,
                     front, frame)  # fmt: skip
    used += air_rates(x, dx, REAR, 9, heights[1], speeds[1], spools[1], outlets[1], supply, temperature, -across, age,
                      rear, frame)  # fmt: skip
    if frame.tank_volume > 0.0:
        refill = frame.regulator * max(0.0, frame.supply_pressure - supply)
        dx[TANK] = frame.exponent * GAS_CONSTANT * temperature / frame.tank_volume * (refill - used)
