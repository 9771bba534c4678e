# SPDX-License-Identifier: Apache-2.0
"""Right-hand side of the richer rig.

State: 0-9 as :mod:`pneumo_ros.plant.equations`; then one block of 21 for each end (bristle, bellows memory, bellows
mode and rate, spool and rate, air mass, exciter and rate, line flow and rate, gauge and rate, five sliders, wall
temperature, second chamber's pressure, tyre's memory), then tank pressure, loose payload and rate, exciter base and
rate, flow that refills the tank. A state whose effect is off stays where it starts.

Kernel arguments
----------------
x, dx : (SIZE,) state, and its rate, which is written
at, index : first of the end's own states, and the state that holds its pressure (8 front, 9 rear)
height, speed : of the strut, m and m/s, extension positive; heights, speeds of both ends
pressure, supply : absolute, Pa
temperature, gas : of the air at the inlet and in the spring, K
spool, outlet : position of the inlet's spool and opening of the outlet, m2; spools, outlets of both ends
spring : force of the spring alone, N
across : flow from this spring to the other one, kg/s
age, time, duration : share of the run gone, 0..1, and time and length of the run, s
road, road_rate : commanded ground, m and m/s
rows, laws : second laws of this end (ROWS, COLUMNS), and of both (2, ROWS, COLUMNS)
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.casemaker import air
from pneumo_ros.casemaker.contact import bouc_wen_rate, hunt_crossley, lossy_tyre, lugre, lugre_level, viscous
from pneumo_ros.casemaker.laws import gas as gas_laws
from pneumo_ros.casemaker.laws import strut as strut_laws
from pneumo_ros.casemaker.laws.ground import external, follow, port
from pneumo_ros.casemaker.laws.slots import (
    AREA,
    BODY,
    DAMPING,
    DEADBAND,
    EXTERNAL,
    FORM,
    FRICTION,
    GAUGE_LAG,
    HEAT,
    HYSTERESIS,
    LAG,
    LEAK,
    ORIFICE,
    STOP,
    SUPPLY,
    VOLUME,
)
from pneumo_ros.casemaker.laws.slots import (
    EXCITER as EXCITER_LAW,
)
from pneumo_ros.casemaker.laws.slots import (
    MODE as MODE_LAW,
)
from pneumo_ros.casemaker.parameters import End, Frame
from pneumo_ros.casemaker.valve import opening_of
from pneumo_ros.plant.air_spring import AreaSurface, effective_area
from pneumo_ros.units import GAS_CONSTANT, GRAVITY

BLOCK = 21
BRISTLE, BELLOWS, MODE, SPOOL, MASS, EXCITER, COLUMN, GAUGE = 0, 1, 2, 4, 6, 7, 9, 11
SLIDER, WALL, CHAMBER, TREAD = 13, 18, 19, 20
FRONT, REAR = 10, 10 + BLOCK
TANK = 10 + 2 * BLOCK
LOOSE, BASE = TANK + 1, TANK + 3
HOSE = TANK + 5
SIZE = TANK + 6


@njit(cache=True, error_model="numpy")
def area_factor(height: float, pressure: float, rows: NDArray[np.float64], end: End) -> float:
    """Effective area over the table's."""
    stroke, excess = height - end.design_height, pressure - end.reference_pressure
    factor = 1.0 + end.area_error + end.area_tilt * stroke + end.area_pressure * excess
    if rows[AREA, 0] > 0.0:
        factor += strut_laws.area(rows[AREA], stroke, excess)
    if rows[FORM, 0] > 0.0:
        u, w = min(max(stroke / 8e-3, -2.0), 2.0), min(max(excess / 3e4, -3.0), 3.0)
        factor += rows[FORM, 1] * u * u + rows[FORM, 2] * u * w + rows[FORM, 3] * w * w
    return factor


@njit(cache=True, error_model="numpy")
def second_forces(
    x: NDArray[np.float64],
    dx: NDArray[np.float64],
    at: int,
    height: float,
    speed: float,
    spring: float,
    rows: NDArray[np.float64],
    end: End,
) -> float:
    """Force of the second laws inside the strut, N upwards on the body."""
    force = 0.0
    if rows[FRICTION, 0] > 0.0:
        force, dx[at + BRISTLE] = strut_laws.friction(rows[FRICTION], x[at + BRISTLE], speed, spring)
    if rows[HYSTERESIS, 0] > 0.0:
        depth = end.design_height - height
        force += strut_laws.hysteresis(rows[HYSTERESIS], x, dx, at + BELLOWS, at + SLIDER, speed, depth)
    if rows[DAMPING, 0] > 0.0:
        force += strut_laws.damping(rows[DAMPING], speed)
    if rows[STOP, 0] > 0.0:
        force += strut_laws.stop(rows[STOP], height, speed)
    return force


@njit(cache=True, error_model="numpy")
def suspension_force(
    x: NDArray[np.float64],
    dx: NDArray[np.float64],
    at: int,
    height: float,
    speed: float,
    pressure: float,
    rows: NDArray[np.float64],
    end: End,
    frame: Frame,
    surface: AreaSurface,
) -> float:
    """Force between axle and body, N upwards on the body; fills the rates of the states that make it."""
    gauge = pressure - frame.ambient_pressure
    spring = gauge * end.area_scale * area_factor(height, pressure, rows, end) * effective_area(height, gauge, surface)
    force = spring + second_forces(x, dx, at, height, speed, spring, rows, end)
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
def inlet_flow(
    spool: float, supply: float, pressure: float, temperature: float, rows: NDArray[np.float64], end: End, frame: Frame
) -> float:
    """Flow into a spring at a spool's position, kg/s."""
    opening = port(rows[DEADBAND], spool) if rows[DEADBAND, 0] > 0.0 else opening_of(spool, end)
    flow = air.inlet(opening, supply, pressure, temperature, end, frame)
    if rows[ORIFICE, 0] > 0.0:
        flow *= gas_laws.inlet_factor(rows[ORIFICE], opening, pressure / supply)
    if rows[FORM, 0] > 0.0:
        flow *= 1.0 + rows[FORM, 4] * min(max((pressure - end.reference_pressure) / 3e4, -3.0), 3.0)
    return flow


@njit(cache=True, error_model="numpy")
def lost_flow(
    outlet: float, pressure: float, gas: float, age: float, rows: NDArray[np.float64], end: End, frame: Frame
) -> float:
    """Flow out of a spring through its outlet and its leaks, kg/s."""
    out = air.outlet(outlet, pressure, gas, age, end, frame)
    if rows[FORM, 0] > 0.0:
        u = min(max((pressure - end.reference_pressure) / 3e4, -3.0), 3.0)
        out *= 1.0 + rows[FORM, 5] * u * abs(u)
    out += air.leakage(pressure, gas, end, frame)
    if rows[LEAK, 0] > 0.0:
        out += gas_laws.leak(rows[LEAK], pressure, frame.ambient_pressure, gas, frame.exponent)
    return out


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
    rows: NDArray[np.float64],
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
    if rows[LAG, 0] > 0.0:
        dx[at + SPOOL] = follow(rows[LAG], spool, x[at + SPOOL])
        spool = x[at + SPOOL]
    taken = inlet_flow(spool, supply, pressure, temperature, rows, end, frame)
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
    outflow = lost_flow(outlet, pressure, gas, age, rows, end, frame) + across
    if rows[VOLUME, 0] == 2.0:
        away = gas_laws.chamber_flow(rows[VOLUME], pressure, x[at + CHAMBER])
        outflow += away
        dx[at + CHAMBER] = gas_laws.flow_to_pressure_rate(away, gas, rows[VOLUME, 1], frame.exponent)
    rate = air.pressure_rate(pressure, x[at + MASS], height, speed, inflow, outflow, end, frame)
    room = air.volume(height, end)
    if rows[HEAT, 0] > 0.0:
        actual = pressure * room / (x[at + MASS] * GAS_CONSTANT)
        squeeze = pressure * end.mean_area * speed
        given = gas_laws.heat(rows[HEAT], x, dx, at + WALL, actual, frame.supply_temperature, inflow, squeeze, speed)
        rate += (frame.exponent - 1.0) * given / room
    if rows[VOLUME, 0] == 1.0:
        soft = rows[VOLUME, 1] * (pressure - end.reference_pressure + frame.exponent * pressure)
        rate *= room / (room + soft)
    dx[index] = rate
    dx[at + MASS] = inflow - outflow
    if end.pressure_frequency > 0.0:
        dx[at + GAUGE] = x[at + GAUGE + 1]
        dx[at + GAUGE + 1] = air.ringing(
            pressure, x[at + GAUGE], x[at + GAUGE + 1], end.pressure_frequency, end.pressure_damping
        )
    if rows[GAUGE_LAG, 0] > 0.0:
        dx[at + GAUGE] = follow(rows[GAUGE_LAG], pressure, x[at + GAUGE])
    return taken


@njit(cache=True)
def road_at(
    x: NDArray[np.float64],
    dx: NDArray[np.float64],
    at: int,
    road: float,
    road_rate: float,
    rows: NDArray[np.float64],
    end: End,
    frame: Frame,
) -> tuple[float, float]:
    """Height and rate of the ground under a tyre: the command, through the exciter's lag, on a base that may move."""
    if end.exciter_frequency > 0.0:
        dx[at + EXCITER] = x[at + EXCITER + 1]
        dx[at + EXCITER + 1] = air.ringing(
            road, x[at + EXCITER], x[at + EXCITER + 1], end.exciter_frequency, end.exciter_damping
        )
        road, road_rate = x[at + EXCITER], x[at + EXCITER + 1]
    if rows[EXCITER_LAW, 0] > 0.0:
        dx[at + EXCITER] = follow(rows[EXCITER_LAW], road, x[at + EXCITER])
        road, road_rate = x[at + EXCITER], dx[at + EXCITER]
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
    laws: NDArray[np.float64],
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
    laws : second laws, (2, ROWS, COLUMNS)
    """
    hf = x[0] + front.arm * x[1] - x[2]
    hr = x[0] + rear.arm * x[1] - x[3]
    hf_rate = x[4] + front.arm * x[5] - x[6]
    hr_rate = x[4] + rear.arm * x[5] - x[7]
    ff = suspension_force(x, dx, FRONT, hf, hf_rate, x[8], laws[0], front, frame, surface)
    fr = suspension_force(x, dx, REAR, hr, hr_rate, x[9], laws[1], rear, frame, surface)
    road_front, rate_front = road_at(x, dx, FRONT, roads[0], road_rates[0], laws[0], front, frame)
    road_rear, rate_rear = road_at(x, dx, REAR, roads[1], road_rates[1], laws[1], rear, frame)
    tf = lossy_tyre(x, dx, FRONT + TREAD, road_front - x[2], rate_front - x[6], static[0], laws[0], front)
    tr = lossy_tyre(x, dx, REAR + TREAD, road_rear - x[3], rate_rear - x[7], static[1], laws[1], rear)
    mass = frame.sprung_mass
    if laws[0, BODY, 0] == 2.0:  # a bar between the struts
        bar = laws[0, BODY, 1] * ((hf - laws[0, BODY, 2]) - (hr - laws[0, BODY, 3]))
        ff, fr = ff - bar, fr + bar
    heave, pitch = ff + fr, front.arm * ff + rear.arm * fr
    if laws[0, BODY, 0] == 1.0:  # a liquid's free surface runs to the lower end
        pitch += laws[0, BODY, 1] * (x[1] - laws[0, BODY, 2])
    if laws[0, BODY, 0] == 3.0:  # ballast runs out
        mass -= laws[0, BODY, 1] * air.smooth_share(time, duration)
    push_front, push_rear = 0.0, 0.0
    for e in range(2):
        arm = front.arm if e == 0 else rear.arm
        if laws[e, EXTERNAL, 0] > 0.0:
            push = external(laws[e, EXTERNAL], time)
            heave, pitch = heave + push, pitch + arm * push
        if laws[e, MODE_LAW, 0] > 0.0:
            at, h, rate, axle = (FRONT, hf, hf_rate, x[2]) if e == 0 else (REAR, hr, hr_rate, x[3])
            up, down = strut_laws.mode(laws[e, MODE_LAW], x, dx, at + MODE, h, rate, h + axle, axle)
            heave, pitch = heave + up, pitch + arm * up
            if e == 0:
                push_front = down
            else:
                push_rear = down
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
    dx[4] = heave / mass - GRAVITY
    dx[5] = pitch / frame.pitch_inertia
    dx[6] = (tf - ff + push_front + shake_front) / front.unsprung_mass - GRAVITY
    dx[7] = (tr - fr + push_rear + shake_rear) / rear.unsprung_mass - GRAVITY
    _supply_and_air(x, dx, time, duration, spools, outlets, (hf, hr), (hf_rate, hr_rate), laws, frame, front, rear)


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
    laws: NDArray[np.float64],
    frame: Frame,
    front: End,
    rear: End,
) -> None:
    age = air.smooth_share(time, duration)
    temperature = frame.supply_temperature + frame.temperature_drift * age
    supply = x[TANK] if frame.tank_volume > 0.0 else frame.supply_pressure
    across = air.exchange(x[8], x[9], temperature, frame)
    used = air_rates(x, dx, FRONT, 8, heights[0], speeds[0], spools[0], outlets[0], supply, temperature, across, age,
                     laws[0], front, frame)  # fmt: skip
    used += air_rates(x, dx, REAR, 9, heights[1], speeds[1], spools[1], outlets[1], supply, temperature, -across, age,
                      laws[1], rear, frame)  # fmt: skip
    if frame.tank_volume > 0.0:
        refill = frame.regulator * max(0.0, frame.supply_pressure - supply)
        if laws[0, SUPPLY, 0] > 0.0:
            refill = gas_laws.refill(laws[0, SUPPLY], x, dx, HOSE, frame.supply_pressure, supply, temperature,
                                     frame.exponent)  # fmt: skip
        dx[TANK] = frame.exponent * GAS_CONSTANT * temperature / frame.tank_volume * (refill - used)
