"""The richer rig at rest on flat ground, levelled by what its own sensors say."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from pneumo_ros.casemaker import air
from pneumo_ros.casemaker.derivative import COLUMN, FRONT, REAR, SIZE, TANK, derivative
from pneumo_ros.casemaker.parameters import End, RicherRig
from pneumo_ros.casemaker.simulate import Rest, initial_state
from pneumo_ros.plant.air_spring import AreaSurface, effective_area
from pneumo_ros.units import GRAVITY, PSI


def rest_of(rig: RicherRig, outlets: tuple[float, float], surface: AreaSurface) -> Rest:
    """State, inlet and outlet openings at rest.

    Parameters
    ----------
    outlets : commanded outlet openings front and rear, m2

    The heights are those at which the levelling sensors read the design height, so a sensor fault moves the rig.
    """
    loads = _loads(rig)
    core = np.zeros(10)
    for index, (end, load) in enumerate(zip((rig.front, rig.rear), loads, strict=True)):
        core[2 + index] = -(load + end.unsprung_mass * GRAVITY) / end.tyre_stiffness
    tops = [_true_top(float(core[2 + i]), end) for i, end in enumerate((rig.front, rig.rear))]
    core[1] = (tops[0] - tops[1]) / (rig.front.arm - rig.rear.arm)
    core[0] = tops[0] - rig.front.arm * core[1]
    if rig.frame.cable_stiffness > 0.0:  # the cable is adjusted at rest: it pulls only when the body moves
        rig = rig._replace(frame=rig.frame._replace(cable_length=tops[0]))
    for index, (end, load) in enumerate(zip((rig.front, rig.rear), loads, strict=True)):
        core[8 + index] = _pressure(load, tops[index] - core[2 + index], end, rig, surface)
    inlets = _inlets(core, outlets, rig)
    state = initial_state(core, inlets, rig)
    _fill_flows(state, inlets, outlets, rig)
    return Rest(state, inlets, outlets)


def prepared(rig: RicherRig, rest: Rest) -> RicherRig:
    """The rig with what is adjusted at rest: the cable's length."""
    if rig.frame.cable_stiffness <= 0.0:
        return rig
    top = float(rest.state[0] + rig.front.arm * rest.state[1])
    return rig._replace(frame=rig.frame._replace(cable_length=top))


def residual(rig: RicherRig, rest: Rest, surface: AreaSurface) -> NDArray[np.float64]:
    """Rates at rest, (SIZE,): zero when the trim is right."""
    rates = np.zeros(SIZE)
    still = (0.0, 0.0)
    static = (-float(rest.state[2]), -float(rest.state[3]))
    derivative(rest.state, rates, 0.0, 1.0, rest.inlets, rest.outlets, still, still, static, *prepared(rig, rest),
               surface)  # fmt: skip
    return rates


def _loads(rig: RicherRig) -> tuple[float, float]:
    a, b = rig.front.arm, -rig.rear.arm
    body, loose = rig.frame.sprung_mass * GRAVITY, rig.frame.loose_mass * GRAVITY
    arm = rig.frame.loose_arm
    return (body * b + loose * (b + arm)) / (a + b), (body * a + loose * (a - arm)) / (a + b)


def _true_top(axle: float, end: End) -> float:
    seen_axle = end.unsprung_scale * axle + end.unsprung_offset
    wanted = end.design_height + seen_axle

    def missing(top: float) -> float:
        stroke = top - end.sprung_centre
        return end.sprung_scale * top + end.sprung_offset + end.sprung_curve * stroke * stroke - wanted

    return float(brentq(missing, wanted - 0.05, wanted + 0.05, xtol=1e-14))


def _pressure(load: float, height: float, end: End, rig: RicherRig, surface: AreaSurface) -> float:
    frame = rig.frame

    def missing(pressure: float) -> float:
        gauge = pressure - frame.ambient_pressure
        factor = (
            1.0
            + end.area_error
            + end.area_tilt * (height - end.design_height)
            + end.area_pressure * (pressure - end.reference_pressure)
        )
        stop = frame.stop_stiffness * max(0.0, frame.stop_height - height)
        stop += max(0.0, end.contact_stiffness * max(0.0, end.contact_height - height) ** 1.5)
        return gauge * end.area_scale * factor * float(effective_area(height, gauge, surface)) + stop - load

    ambient = frame.ambient_pressure
    return float(brentq(missing, ambient + 0.1 * PSI, frame.supply_pressure - PSI, xtol=1e-9, rtol=1e-14))


def _outflows(core: NDArray[np.float64], outlets: tuple[float, float], rig: RicherRig) -> tuple[float, float]:
    frame, temperature = rig.frame, rig.frame.supply_temperature
    across = air.exchange(core[8], core[9], temperature, frame)
    flows = []
    for index, (end, sign) in enumerate(((rig.front, 1.0), (rig.rear, -1.0))):
        pressure = float(core[8 + index])
        gas = air.polytropic_temperature(pressure, end, frame) if end.open_energy <= 0.0 else temperature
        out = air.outlet(outlets[index], pressure, gas, 0.0, end, frame) + air.leakage(pressure, gas, end, frame)
        flows.append(float(out + sign * across))
    return flows[0], flows[1]


def _supply(flows: tuple[float, float], rig: RicherRig) -> float:
    frame = rig.frame
    return frame.supply_pressure - (sum(flows) / frame.regulator if frame.tank_volume > 0.0 else 0.0)


def _inlets(core: NDArray[np.float64], outlets: tuple[float, float], rig: RicherRig) -> tuple[float, float]:
    flows = _outflows(core, outlets, rig)
    supply, temperature = _supply(flows, rig), rig.frame.supply_temperature
    found = []
    for index, end in enumerate((rig.front, rig.rear)):
        per_area = float(air.inlet(1e-6, supply, float(core[8 + index]), temperature, end, rig.frame)) / 1e-6
        found.append(max(0.0, flows[index] / per_area) + end.valve_overlap)
    return found[0], found[1]


def _fill_flows(
    state: NDArray[np.float64], inlets: tuple[float, float], outlets: tuple[float, float], rig: RicherRig
) -> None:
    flows = _outflows(state, outlets, rig)
    state[TANK] = _supply(flows, rig)
    state[FRONT + COLUMN], state[REAR + COLUMN] = flows
