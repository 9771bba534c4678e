# SPDX-License-Identifier: Apache-2.0
"""The quarter car on one air spring (Eqs. 4.53-4.57, corrected by errata 7) and its compiled integrator.

State (5): sprung and unsprung height [m], their rates, spring pressure [Pa absolute]. All z
upwards from the ground datum.
Inputs: inlet and outlet opening [m2], held over a period, and road height [m], linear over a period.

Kernel arguments
----------------
x, x0 : state (5,): sprung and unsprung height, m, their rates, m/s, absolute pressure, Pa
a, b, c, d, k : rates of the state
dt, period, steps : a step, s; a control period, s, and the RK4 steps in it
inlet, outlet : openings, m2; commands : both, (N, 2)
road : height of the ground, m, at one instant or at the ends of each period
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import brentq

from pneumo_ros.errors import InputError
from pneumo_ros.plant.air_spring import (
    AreaSurface,
    Gas,
    build_surface,
    effective_area,
    inlet_flow,
    load_surface,
    outlet_flow,
    pressure_power,
    pressure_rate,
)
from pneumo_ros.plant.half_car import BUMP_STOP_HEIGHT, BUMP_STOP_STIFFNESS, gas_of
from pneumo_ros.plant.integrator import DEFAULT_STEP, substeps
from pneumo_ros.rig import Rig
from pneumo_ros.units import GRAVITY, INCH, PSI

STATE_NAMES = ("sprung", "unsprung", "sprung_rate", "unsprung_rate", "pressure")

State = tuple[float, float, float, float, float]


class Corner(NamedTuple):
    """Masses and what lies between body and ground of one corner, SI."""

    sprung_mass: float
    unsprung_mass: float
    tyre_stiffness: float
    damping: float
    design_height: float
    stop_height: float = BUMP_STOP_HEIGHT
    stop_stiffness: float = BUMP_STOP_STIFFNESS


@dataclass(frozen=True)
class QuarterCar:
    """A quarter car ready to integrate: parameters only, no state.

    Attributes
    ----------
    corner : masses and stiffnesses
    gas : of the spring
    surface : effective area over height and gauge pressure
    step : longest RK4 step, s
    """

    corner: Corner
    gas: Gas
    surface: AreaSurface
    step: float = DEFAULT_STEP

    def simulate(
        self, state: NDArray[np.float64], commands: NDArray[np.float64], road: NDArray[np.float64], period: float
    ) -> NDArray[np.float64]:
        """Trajectory over N periods: openings (N, 2), m2, road (N + 1,), m -> states (N + 1, 5)."""
        return simulate_quarter(
            np.asarray(state, dtype=float),
            np.ascontiguousarray(commands, dtype=float),
            np.ascontiguousarray(road, dtype=float),
            period,
            substeps(period, self.step),
            self.corner,
            self.gas,
            self.surface,
        )

    def rates(self, state: NDArray[np.float64], command: NDArray[np.float64], road: float) -> NDArray[np.float64]:
        """Time derivative of the state, (5,): command (2,) m2, road m."""
        x = tuple(np.asarray(state, dtype=float))
        return np.array(
            quarter_derivative(x, float(command[0]), float(command[1]), road, self.corner, self.gas, self.surface)
        )


@dataclass(frozen=True)
class QuarterTrim:
    """A quarter car at rest on a flat road: state (5,), inlet and outlet opening, m2."""

    state: NDArray[np.float64]
    inlet: float
    outlet: float

    @property
    def command(self) -> NDArray[np.float64]:
        """(2,) inlet and outlet opening, m2."""
        return np.array([self.inlet, self.outlet])


def constant_area_surface(area: float) -> AreaSurface:
    """The surface of a pneumatic cylinder: one area, m2, at every height and pressure (Section 6.3)."""
    heights, pressures = np.linspace(0.5, 3.0, 4) * INCH, np.array([5.0, 50.0, 100.0]) * PSI
    return build_surface(heights, pressures, np.full((4, 3), area))


@njit(cache=True, error_model="numpy", inline="always")
def quarter_derivative(
    x: State, inlet: float, outlet: float, road: float, corner: Corner, gas: Gas, surface: AreaSurface
) -> State:
    """Right-hand side of Eqs. 4.53-4.57."""
    zs, zu, vs, vu, pressure = x
    height, height_rate = zs - zu, vs - vu
    gauge = pressure - gas.ambient_pressure
    stop = corner.stop_stiffness * max(0.0, corner.stop_height - height)
    force = gauge * effective_area(height, gauge, surface) - corner.damping * height_rate + stop
    return (
        vs,
        vu,
        force / corner.sprung_mass - GRAVITY,
        (corner.tyre_stiffness * (road - zu) - force) / corner.unsprung_mass - GRAVITY,
        pressure_rate(pressure, height, height_rate, inlet, outlet, gas),
    )


@njit(cache=True)
def _moved(x: State, k: State, dt: float) -> State:
    return (x[0] + dt * k[0], x[1] + dt * k[1], x[2] + dt * k[2], x[3] + dt * k[3], x[4] + dt * k[4])


@njit(cache=True)
def _mean(a: State, b: State, c: State, d: State) -> State:
    """RK4's weighted sum (a + 2b + 2c + d) / 6, written out like the half car's to stay in registers."""
    s = 1.0 / 6.0
    return (
        s * (a[0] + 2.0 * (b[0] + c[0]) + d[0]),
        s * (a[1] + 2.0 * (b[1] + c[1]) + d[1]),
        s * (a[2] + 2.0 * (b[2] + c[2]) + d[2]),
        s * (a[3] + 2.0 * (b[3] + c[3]) + d[3]),
        s * (a[4] + 2.0 * (b[4] + c[4]) + d[4]),
    )


@njit(cache=True, error_model="numpy")
def simulate_quarter(
    x0: NDArray[np.float64],
    commands: NDArray[np.float64],
    road: NDArray[np.float64],
    period: float,
    steps: int,
    corner: Corner,
    gas: Gas,
    surface: AreaSurface,
) -> NDArray[np.float64]:
    """Fixed-step RK4: (5,), (N, 2), (N + 1,) -> (N + 1, 5)."""
    count = commands.shape[0]
    out = np.empty((count + 1, 5))
    out[0] = x0
    x = (x0[0], x0[1], x0[2], x0[3], x0[4])
    dt = period / steps
    for i in range(count):
        u, w = commands[i, 0], commands[i, 1]
        slope = (road[i + 1] - road[i]) / steps
        for j in range(steps):
            r = road[i] + j * slope
            k1 = quarter_derivative(x, u, w, r, corner, gas, surface)
            k2 = quarter_derivative(_moved(x, k1, 0.5 * dt), u, w, r + 0.5 * slope, corner, gas, surface)
            k3 = quarter_derivative(_moved(x, k2, 0.5 * dt), u, w, r + 0.5 * slope, corner, gas, surface)
            k4 = quarter_derivative(_moved(x, k3, dt), u, w, r + slope, corner, gas, surface)
            x = _moved(x, _mean(k1, k2, k3, k4), dt)
        for m in range(5):
            out[i + 1, m] = x[m]
    return out


def quarter_car(
    rig: Rig, sprung_mass: float, surface: AreaSurface | None = None, mean_area: float | None = None
) -> tuple[QuarterCar, QuarterTrim]:
    """A quarter car with a rig's front axle, gas and outlet, and its trim at design height.

    Parameters
    ----------
    rig : where everything but the sprung mass comes from
    sprung_mass : kg; the thesis never states the quarter car's (errata 17)
    surface : effective area surface, the 2M2A's by default; :func:`constant_area_surface` makes a cylinder of it
    mean_area : m2; volume is then mean_area times height (a cylinder) instead of the 2M2A's

    Raises
    ------
    InputError
        if no pressure below the supply carries the mass.
    """
    surface = surface or load_surface()
    corner = Corner(
        sprung_mass,
        rig.unsprung_mass_front.value,
        rig.tyre_stiffness_front.value,
        rig.bushing_damping.value,
        rig.design_height.value,
    )
    gas = gas_of(rig, _static_pressure(rig, sprung_mass, surface))
    if mean_area is not None:
        gas = gas._replace(volume_offset=0.0, mean_area=mean_area)
    return QuarterCar(corner, gas, surface), _quarter_trim(corner, gas, rig.outlet_area_front.value)


def _static_pressure(rig: Rig, sprung_mass: float, surface: AreaSurface) -> float:
    load, height, ambient = sprung_mass * GRAVITY, rig.design_height.value, rig.ambient_pressure.value
    top = rig.supply_pressure.value - ambient

    def missing(gauge: float) -> float:
        return gauge * float(effective_area(height, gauge, surface)) - load

    if missing(top) <= 0.0:
        raise InputError(
            f"impossible trim: the spring cannot carry {load:.4g} N",
            where=rig.name,
            key="sprung_mass",
            value=sprung_mass,
            allowed=f"below {(missing(top) + load) / GRAVITY:.3g} kg at the supply's pressure",
            remedy="raise supply_pressure or lower the mass",
        )
    return float(brentq(missing, 0.0, top, xtol=1e-7, rtol=1e-14)) + ambient


def _quarter_trim(corner: Corner, gas: Gas, outlet: float) -> QuarterTrim:
    pressure = gas.reference_pressure
    power = pressure_power(pressure, gas)
    inlet = outlet_flow(outlet, pressure, power, gas) / inlet_flow(1.0, pressure, power, gas)
    axle = -(corner.sprung_mass + corner.unsprung_mass) * GRAVITY / corner.tyre_stiffness
    return QuarterTrim(np.array([axle + corner.design_height, axle, 0.0, 0.0, pressure]), float(inlet), outlet)
