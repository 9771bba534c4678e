# SPDX-License-Identifier: Apache-2.0
"""The half car on two air springs (Eqs. 4.63-4.72, corrected by errata 1, 7, 8) and its compiled integrator.

State (10), :data:`~pneumo_ros.rig.channels.STATE_FIELDS`: heave, pitch, unsprung front, unsprung rear [m, rad, m, m],
their rates, front and rear spring pressure [Pa absolute]. All z are upwards from the ground datum; pitch is positive
nose up.
Inputs: commanded orifice areas (front inlet, rear inlet, front outlet, rear outlet) [m2], held over a period, and road
height (front, rear) [m], linear over a period.

Kernel arguments
----------------
x, x0, state : (10,): heave, pitch, two axle heights, their rates, two absolute pressures; m, rad, m/s, rad/s, Pa
a, b, c, d, k : rates of the state
dt, period, steps : a step, s; a control period, s, and the RK4 steps in it
height, height_rate : of a spring, m and m/s, extension positive
pressure, ambient : absolute, Pa
scale, damping : factor on the effective area, 1; of the bushing, N s/m
inlet_front, inlet_rear, outlet_front, outlet_rear : openings, m2; command, commands : the four, (4,), (N, 4)
road_front, road_rear : heights of the ground, m; road : both at the ends of each period
p, packed, start : numbers of :attr:`HalfCar.packed`, and where a spring's begin
heights, pressures, cubics : fields of :class:`~pneumo_ros.plant.air_spring.AreaSurface`
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.plant.air_spring import (
    MEAN_AREA,
    VOLUME_OFFSET,
    AreaSurface,
    Gas,
    effective_area,
    load_surface,
    pressure_rate,
)
from pneumo_ros.plant.orifice import critical_ratio, flow_function
from pneumo_ros.rig import LIMITS, Rig
from pneumo_ros.rig.channels import sprung_points
from pneumo_ros.units import GRAVITY, INCH

BUMP_STOP_HEIGHT = 1.2 * INCH  # m, below it the stop pushes; not in the thesis: keeps every run bounded
BUMP_STOP_STIFFNESS = 2e5  # N/m

DEFAULT_STEP = 0.5e-3  # s: RK4 within 5e-5 of the converged trajectory

State = tuple[float, float, float, float, float, float, float, float, float, float]


class Body(NamedTuple):
    """Masses, arms and what lies between body and ground, SI."""

    sprung_mass: float
    pitch_inertia: float
    front_arm: float
    rear_arm: float
    unsprung_mass_front: float
    unsprung_mass_rear: float
    tyre_stiffness_front: float
    tyre_stiffness_rear: float
    damping_front: float
    damping_rear: float
    area_scale_front: float
    area_scale_rear: float
    stop_height: float
    stop_stiffness: float


@dataclass(frozen=True)
class HalfCar:
    """A half car ready to integrate: parameters only, no state.

    Attributes
    ----------
    body : masses and stiffnesses
    front, rear : gas of each spring
    surface : effective area over height and gauge pressure
    step : longest RK4 step, s
    """

    body: Body
    front: Gas
    rear: Gas
    surface: AreaSurface
    step: float = DEFAULT_STEP

    @cached_property
    def packed(self) -> NDArray[np.float64]:
        """(42,) body, front and rear gas in one array.

        Handing 42 numbers to compiled code one by one costs more than a whole control period of simulation (6 us
        against 1 us); one array costs 0.1 us.
        """
        return np.array([*self.body, *self.front, *self.rear])

    def advance(
        self, state: NDArray[np.float64], command: NDArray[np.float64], road: NDArray[np.float64], period: float
    ) -> NDArray[np.float64]:
        """State after one period.

        Parameters
        ----------
        state : (10,) float64
        command : (4,) float64, orifice areas, m2, held
        road : (2, 2) float64, front and rear height, m, at the start (row 0) and end (row 1) of the period
        period : s
        """
        surface = self.surface
        return advance_packed(
            state, command, road, period, substeps(period, self.step), self.packed, surface.heights,
            surface.pressures, surface.cubics,
        )  # fmt: skip

    def simulate(
        self, state: NDArray[np.float64], commands: NDArray[np.float64], road: NDArray[np.float64], period: float
    ) -> NDArray[np.float64]:
        """Trajectory over N periods: commands (N, 4), road (N + 1, 2) -> states (N + 1, 10)."""
        return simulate(
            np.asarray(state, dtype=float),
            np.ascontiguousarray(commands, dtype=float),
            np.ascontiguousarray(road, dtype=float),
            period,
            substeps(period, self.step),
            self.body,
            self.front,
            self.rear,
            self.surface,
        )

    def rates(
        self, state: NDArray[np.float64], command: NDArray[np.float64], road: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Time derivative of the state, (10,), at one instant: command (4,), road (2,)."""
        return np.array(
            derivative(
                tuple(np.asarray(state, dtype=float)),
                *(float(v) for v in command),
                float(road[0]),
                float(road[1]),
                self.body,
                self.front,
                self.rear,
                self.surface,
            )
        )


def substeps(period: float, step: float) -> int:
    """Number of equal RK4 steps in a period, none longer than ``step`` by more than a thousandth: a clock that runs 100
    ppm slow asks for no second one."""
    return max(1, int(np.ceil((1.0 - 1e-3) * period / step)))


@njit(cache=True, error_model="numpy")
def spring_force(
    height: float,
    height_rate: float,
    pressure: float,
    scale: float,
    damping: float,
    ambient: float,
    body: Body,
    surface: AreaSurface,
) -> float:
    """Force of one spring with its bushing and bump stop, N, positive upwards on the body."""
    gauge = pressure - ambient
    stop = body.stop_stiffness * max(0.0, body.stop_height - height)
    return gauge * scale * effective_area(height, gauge, surface) - damping * height_rate + stop


@njit(cache=True, error_model="numpy", inline="always")
def accelerations(
    spring_front: float,
    spring_rear: float,
    tyre_front: float,
    tyre_rear: float,
    extra_force: float,
    extra_moment: float,
    body: Body,
) -> tuple[float, float, float, float]:
    """Newton's law for body and axles (Eqs. 4.63-4.66): heave, m/s2, pitch, rad/s2, front and rear axle, m/s2.

    Parameters
    ----------
    spring_front, spring_rear : N, positive upwards on the body
    tyre_front, tyre_rear : N, positive upwards on the axle
    extra_force, extra_moment : what else acts on the body, N and N m nose up
    body : masses and arms
    """
    return (
        (spring_front + spring_rear + extra_force) / body.sprung_mass - GRAVITY,
        (body.front_arm * spring_front - body.rear_arm * spring_rear + extra_moment) / body.pitch_inertia,
        (tyre_front - spring_front) / body.unsprung_mass_front - GRAVITY,
        (tyre_rear - spring_rear) / body.unsprung_mass_rear - GRAVITY,
    )


@njit(cache=True, error_model="numpy", inline="always")
def derivative(
    x: State,
    inlet_front: float,
    inlet_rear: float,
    outlet_front: float,
    outlet_rear: float,
    road_front: float,
    road_rear: float,
    body: Body,
    front: Gas,
    rear: Gas,
    surface: AreaSurface,
) -> State:
    """Right-hand side of Eqs. 4.63-4.68."""
    heave, pitch, zuf, zur, heave_rate, pitch_rate, vuf, vur, pf, pr = x
    zf, zr = sprung_points(heave, pitch, body.front_arm, body.rear_arm)
    vf, vr = sprung_points(heave_rate, pitch_rate, body.front_arm, body.rear_arm)
    hf, hr, hf_rate, hr_rate = zf - zuf, zr - zur, vf - vuf, vr - vur
    ff = spring_force(hf, hf_rate, pf, body.area_scale_front, body.damping_front, front.ambient_pressure, body, surface)
    fr = spring_force(hr, hr_rate, pr, body.area_scale_rear, body.damping_rear, rear.ambient_pressure, body, surface)
    tf = body.tyre_stiffness_front * (road_front - zuf)
    tr = body.tyre_stiffness_rear * (road_rear - zur)
    heave2, pitch2, front2, rear2 = accelerations(ff, fr, tf, tr, 0.0, 0.0, body)
    return (
        heave_rate,
        pitch_rate,
        vuf,
        vur,
        heave2,
        pitch2,
        front2,
        rear2,
        pressure_rate(pf, hf, hf_rate, inlet_front, outlet_front, front),
        pressure_rate(pr, hr, hr_rate, inlet_rear, outlet_rear, rear),
    )


@njit(cache=True)
def moved(x: State, k: State, dt: float) -> State:
    """x + dt k, of the ten states."""
    return (
        x[0] + dt * k[0],
        x[1] + dt * k[1],
        x[2] + dt * k[2],
        x[3] + dt * k[3],
        x[4] + dt * k[4],
        x[5] + dt * k[5],
        x[6] + dt * k[6],
        x[7] + dt * k[7],
        x[8] + dt * k[8],
        x[9] + dt * k[9],
    )


@njit(cache=True)
def _combined(a: State, b: State, c: State, d: State) -> State:
    """RK4's weighted sum (a + 2b + 2c + d) / 6."""
    s = 1.0 / 6.0
    return (
        s * (a[0] + 2.0 * (b[0] + c[0]) + d[0]),
        s * (a[1] + 2.0 * (b[1] + c[1]) + d[1]),
        s * (a[2] + 2.0 * (b[2] + c[2]) + d[2]),
        s * (a[3] + 2.0 * (b[3] + c[3]) + d[3]),
        s * (a[4] + 2.0 * (b[4] + c[4]) + d[4]),
        s * (a[5] + 2.0 * (b[5] + c[5]) + d[5]),
        s * (a[6] + 2.0 * (b[6] + c[6]) + d[6]),
        s * (a[7] + 2.0 * (b[7] + c[7]) + d[7]),
        s * (a[8] + 2.0 * (b[8] + c[8]) + d[8]),
        s * (a[9] + 2.0 * (b[9] + c[9]) + d[9]),
    )


@njit(cache=True, error_model="numpy", nogil=True)
def simulate(
    x0: NDArray[np.float64],
    commands: NDArray[np.float64],
    road: NDArray[np.float64],
    period: float,
    steps: int,
    body: Body,
    front: Gas,
    rear: Gas,
    surface: AreaSurface,
) -> NDArray[np.float64]:
    """Fixed-step RK4: (10,), (N, 4), (N + 1, 2) -> (N + 1, 10); ``steps`` equal steps in each period, s.

    The state is ten scalars, not an array: that is what keeps it in registers and within 1.3x of plain C.
    """
    count = commands.shape[0]
    out = np.empty((count + 1, 10))
    out[0] = x0
    x = (x0[0], x0[1], x0[2], x0[3], x0[4], x0[5], x0[6], x0[7], x0[8], x0[9])
    dt = period / steps
    for i in range(count):
        u0, u1, u2, u3 = commands[i, 0], commands[i, 1], commands[i, 2], commands[i, 3]
        rf, rr = road[i, 0], road[i, 1]
        df, dr = (road[i + 1, 0] - rf) / steps, (road[i + 1, 1] - rr) / steps
        for j in range(steps):
            f0, r0 = rf + j * df, rr + j * dr
            fm, rm = f0 + 0.5 * df, r0 + 0.5 * dr
            k1 = derivative(x, u0, u1, u2, u3, f0, r0, body, front, rear, surface)
            k2 = derivative(moved(x, k1, 0.5 * dt), u0, u1, u2, u3, fm, rm, body, front, rear, surface)
            k3 = derivative(moved(x, k2, 0.5 * dt), u0, u1, u2, u3, fm, rm, body, front, rear, surface)
            k4 = derivative(moved(x, k3, dt), u0, u1, u2, u3, f0 + df, r0 + dr, body, front, rear, surface)
            x = moved(x, _combined(k1, k2, k3, k4), dt)
        for m in range(10):
            out[i + 1, m] = x[m]
    return out


@njit(cache=True)
def unpack_body(p: NDArray[np.float64]) -> Body:
    """The first 14 numbers of :attr:`HalfCar.packed`."""
    return Body(p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11], p[12], p[13])


@njit(cache=True)
def unpack_gas(p: NDArray[np.float64], start: int) -> Gas:
    """Fourteen numbers of :attr:`HalfCar.packed`, from 14 (front) or 28 (rear)."""
    q = p[start : start + 14]
    return Gas(q[0], q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8], q[9], q[10], q[11], q[12], q[13])


@njit(cache=True, error_model="numpy")
def advance_packed(
    state: NDArray[np.float64],
    command: NDArray[np.float64],
    road: NDArray[np.float64],
    period: float,
    steps: int,
    packed: NDArray[np.float64],
    heights: NDArray[np.float64],
    pressures: NDArray[np.float64],
    cubics: NDArray[np.float64],
) -> NDArray[np.float64]:
    """One period of :func:`simulate` from packed parameters: (10,), (4,), (2, 2) -> (10,)."""
    surface = AreaSurface(heights, pressures, cubics)
    body, front, rear = unpack_body(packed), unpack_gas(packed, 14), unpack_gas(packed, 28)
    return simulate(state, command.reshape(1, 4), road, period, steps, body, front, rear, surface)[1]


def half_car(
    rig: Rig, reference_pressures: tuple[float, float], surface: AreaSurface | None = None, step: float = DEFAULT_STEP
) -> HalfCar:
    """Build the half car of a rig.

    Parameters
    ----------
    rig : parameters, SI
    reference_pressures : static pressures of the *nominal* rig, front and rear, Pa absolute (Eq. 4.17's reference;
        :func:`pneumo_ros.plant.trim.trim` gives them). They stay when parameters are perturbed.
    surface : effective area surface; the 2M2A's by default
    step : longest RK4 step, s
    """
    v = {name: getattr(rig, name).value for name in LIMITS}
    body = Body(
        sprung_mass=v["sprung_mass"],
        pitch_inertia=v["pitch_inertia"],
        front_arm=v["front_arm"],
        rear_arm=v["rear_arm"],
        unsprung_mass_front=v["unsprung_mass_front"],
        unsprung_mass_rear=v["unsprung_mass_rear"],
        tyre_stiffness_front=v["tyre_stiffness_front"],
        tyre_stiffness_rear=v["tyre_stiffness_rear"],
        damping_front=v["bushing_damping"],
        damping_rear=v["bushing_damping"],
        area_scale_front=v["effective_area_scale"],
        area_scale_rear=v["effective_area_scale"],
        stop_height=BUMP_STOP_HEIGHT,
        stop_stiffness=BUMP_STOP_STIFFNESS,
    )
    front, rear = (gas_of(rig, reference) for reference in reference_pressures)
    return HalfCar(body, front, rear, surface or load_surface(), step)


def gas_of(rig: Rig, reference_pressure: float) -> Gas:
    """The gas of one spring of a rig; ``reference_pressure`` Pa absolute as in :func:`half_car`."""
    n = rig.polytropic_exponent.value
    k = (n - 1.0) / n
    supply, ambient = rig.supply_pressure.value, rig.ambient_pressure.value
    critical = float(critical_ratio(n))
    return Gas(
        exponent=n,
        k=k,
        supply_pressure=supply,
        ambient_pressure=ambient,
        supply_temperature=rig.supply_temperature.value,
        reference_pressure=reference_pressure,
        supply_power=(reference_pressure / supply) ** k,
        ambient_power=(ambient / reference_pressure) ** k,
        critical=critical,
        choked=float(flow_function(critical, n)),
        inlet_scale=rig.discharge_coefficient.value,
        outlet_scale=rig.discharge_coefficient.value,
        volume_offset=VOLUME_OFFSET * rig.volume_scale.value,
        mean_area=MEAN_AREA * rig.volume_scale.value,
    )
