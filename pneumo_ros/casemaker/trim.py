# SPDX-License-Identifier: Apache-2.0
"""The richer rig at rest on flat ground, levelled by what its own sensors say."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from pneumo_ros.casemaker import air
from pneumo_ros.casemaker.derivative import (
    COLUMN,
    FRONT,
    HOSE,
    REAR,
    SIZE,
    TANK,
    area_factor,
    derivative,
    inlet_flow,
    lost_flow,
)
from pneumo_ros.casemaker.laws.gas import refill
from pneumo_ros.casemaker.laws.ground import sensor_error
from pneumo_ros.casemaker.laws.slots import BODY, SPRUNG, STOP, SUPPLY, UNSPRUNG
from pneumo_ros.casemaker.laws.strut import stop as second_stop
from pneumo_ros.casemaker.parameters import End, RicherRig
from pneumo_ros.casemaker.simulate import Rest, initial_state
from pneumo_ros.plant.air_spring import AreaSurface, effective_area
from pneumo_ros.units import GRAVITY, PSI


class NoRestError(ValueError):
    """The rig cannot stand still: its supply starves, or a spring cannot carry its load."""


def rest_of(rig: RicherRig, outlets: tuple[float, float], surface: AreaSurface) -> Rest:
    """State, inlet and outlet openings at rest.

    Raises
    ------
    NoRestError
        if there is none.
    """
    try:
        return _rest_of(rig, outlets, surface)
    except ValueError as error:  # brentq found no change of sign
        raise NoRestError(str(error)) from error


def _rest_of(rig: RicherRig, outlets: tuple[float, float], surface: AreaSurface) -> Rest:
    """State, inlet and outlet openings at rest.

    Parameters
    ----------
    outlets : commanded outlet openings front and rear, m2

    The heights are those at which the levelling sensors read the design height, so a sensor fault moves the rig.
    """
    loads = loads_at_rest(rig)
    core = np.zeros(10)
    for index, (end, load) in enumerate(zip((rig.front, rig.rear), loads, strict=True)):
        core[2 + index] = -(load + end.unsprung_mass * GRAVITY) / end.tyre_stiffness
    rows = rig.rows
    tops = [_true_top(float(core[2 + i]), rows[i], end) for i, end in enumerate((rig.front, rig.rear))]
    core[1] = (tops[0] - tops[1]) / (rig.front.arm - rig.rear.arm)
    core[0] = tops[0] - rig.front.arm * core[1]
    if rig.frame.cable_stiffness > 0.0:  # the cable is adjusted at rest: it pulls only when the body moves
        rig = rig._replace(frame=rig.frame._replace(cable_length=tops[0]))
    for index, (end, load) in enumerate(zip((rig.front, rig.rear), loads, strict=True)):
        core[8 + index] = _pressure(load, tops[index] - core[2 + index], rows[index], end, rig, surface)
    inlets = _inlets(core, outlets, rig)
    state = initial_state(core, inlets, rig)
    _fill_flows(state, inlets, outlets, rig)
    return Rest(state, inlets, outlets)


def prepared(rig: RicherRig, rest: Rest) -> RicherRig:
    """The rig with what is adjusted at rest: the cable's length, the level of what sloshes."""
    level = tuple(
        law._replace(values=(law.values[0], float(rest.state[1]))) if law.row == BODY and law.number == 1 else law
        for law in rig.laws
    )
    rig = rig._replace(laws=level)
    if rig.frame.cable_stiffness <= 0.0:
        return rig
    top = float(rest.state[0] + rig.front.arm * rest.state[1])
    return rig._replace(frame=rig.frame._replace(cable_length=top))


def residual(rig: RicherRig, rest: Rest, surface: AreaSurface) -> NDArray[np.float64]:
    """Rates at rest, (SIZE,): zero when the trim is right."""
    rates = np.zeros(SIZE)
    still = (0.0, 0.0)
    static = (-float(rest.state[2]), -float(rest.state[3]))
    ready = prepared(rig, rest)
    derivative(rest.state, rates, 0.0, 1.0, rest.inlets, rest.outlets, still, still, static, *ready[:3], ready.rows,
               surface)  # fmt: skip
    return rates


def loads_at_rest(rig: RicherRig) -> tuple[float, float]:
    """What each spring carries, N."""
    a, b = rig.front.arm, -rig.rear.arm
    body, loose = rig.frame.sprung_mass * GRAVITY, rig.frame.loose_mass * GRAVITY
    arm = rig.frame.loose_arm
    return (body * b + loose * (b + arm)) / (a + b), (body * a + loose * (a - arm)) / (a + b)


def _true_top(axle: float, rows: NDArray[np.float64], end: End) -> float:
    seen_axle = end.unsprung_scale * axle + end.unsprung_offset + _error(rows[UNSPRUNG], axle)
    wanted = end.design_height + seen_axle

    def missing(top: float) -> float:
        stroke = top - end.sprung_centre
        return (
            end.sprung_scale * top
            + end.sprung_offset
            + end.sprung_curve * stroke * stroke
            + _error(rows[SPRUNG], top)
            - wanted
        )

    return float(brentq(missing, wanted - 0.05, wanted + 0.05, xtol=1e-14))


def _error(law: NDArray[np.float64], value: float) -> float:
    return float(sensor_error(law, value, 0.0)) if law[0] > 0.0 else 0.0


def _pressure(
    load: float, height: float, rows: NDArray[np.float64], end: End, rig: RicherRig, surface: AreaSurface
) -> float:
    frame = rig.frame

    def missing(pressure: float) -> float:
        gauge = pressure - frame.ambient_pressure
        factor = float(area_factor(height, pressure, rows, end))
        stop = frame.stop_stiffness * max(0.0, frame.stop_height - height)
        stop += max(0.0, end.contact_stiffness * max(0.0, end.contact_height - height) ** 1.5)
        stop += float(second_stop(rows[STOP], height, 0.0)) if rows[STOP, 0] > 0.0 else 0.0
        return gauge * end.area_scale * factor * float(effective_area(height, gauge, surface)) + stop - load

    ambient = frame.ambient_pressure
    return float(brentq(missing, ambient + 0.1 * PSI, frame.supply_pressure - PSI, xtol=1e-9, rtol=1e-14))


def _outflows(core: NDArray[np.float64], outlets: tuple[float, float], rig: RicherRig) -> tuple[float, float]:
    frame, temperature = rig.frame, rig.frame.supply_temperature
    across = air.exchange(core[8], core[9], temperature, frame)
    flows, rows = [], rig.rows
    for index, (end, sign) in enumerate(((rig.front, 1.0), (rig.rear, -1.0))):
        pressure = float(core[8 + index])
        gas = air.polytropic_temperature(pressure, end, frame) if end.open_energy <= 0.0 else temperature
        out = lost_flow(outlets[index], pressure, gas, 0.0, rows[index], end, frame)
        flows.append(float(out + sign * across))
    return flows[0], flows[1]


def supply_at_rest(flows: tuple[float, float], rig: RicherRig) -> float:
    """Pressure at the valves at rest, Pa."""
    frame, law, used = rig.frame, rig.rows[0, SUPPLY], sum(flows)
    if frame.tank_volume <= 0.0:
        return frame.supply_pressure
    if law[0] == 1.0:

        def short(tank: float) -> float:
            return float(refill(law, still, still, 0, frame.supply_pressure, tank, frame.supply_temperature,
                                frame.exponent)) - used  # fmt: skip

        still = np.zeros(1)
        return float(brentq(short, frame.ambient_pressure, law[2] * frame.supply_pressure, xtol=1e-7, rtol=1e-14))
    if law[0] == 2.0:
        return float(frame.supply_pressure - law[1] * used * used)
    return float(frame.supply_pressure - used / (law[1] if law[0] == 3.0 else frame.regulator))


def _inlets(core: NDArray[np.float64], outlets: tuple[float, float], rig: RicherRig) -> tuple[float, float]:
    flows = _outflows(core, outlets, rig)
    supply, temperature = supply_at_rest(flows, rig), rig.frame.supply_temperature
    found, rows = [], rig.rows
    for index, end in enumerate((rig.front, rig.rear)):
        found.append(_inlet(max(0.0, flows[index]), supply, float(core[8 + index]), temperature, rows[index], end, rig))
    return found[0], found[1]


def _inlet(
    flow: float, supply: float, pressure: float, temperature: float, rows: NDArray[np.float64], end: End, rig: RicherRig
) -> float:
    """Command that passes a flow, m2."""
    if not rows.any():
        per_area = float(air.inlet(1e-6, supply, pressure, temperature, end, rig.frame)) / 1e-6
        return flow / per_area + end.valve_overlap

    def missing(spool: float) -> float:
        return float(inlet_flow(spool, supply, pressure, temperature, rows, end, rig.frame)) - flow

    return float(brentq(missing, 0.0, 1e-4, xtol=1e-18, rtol=1e-14))


def _fill_flows(
    state: NDArray[np.float64], inlets: tuple[float, float], outlets: tuple[float, float], rig: RicherRig
) -> None:
    flows = _outflows(state, outlets, rig)
    state[TANK] = supply_at_rest(flows, rig)
    state[HOSE] = sum(flows)
    state[FRONT + COLUMN], state[REAR + COLUMN] = flows
